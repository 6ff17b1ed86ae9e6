"""What a view shows of runs on a real robot: what they were told of, and a stage in the place of the arm."""

from typing import Any

import numpy as np
import pytest

from palpate.commands.view.scene import shown_scene
from palpate.experiments.kit.registry import experiment_named
from palpate.kinematics.pose import Pose, rotation_from_rotvec
from palpate.kinematics.posture import Posture
from palpate.robots.known_truth import known_scene, scene_of
from palpate.robots.values import load_named_robot
from palpate.sim.render.parts import carried_body
from palpate.sim.render.place import ScenePlacement
from palpate.viewing import Player
from palpate.viewing.frames import FrameLayout, Frames

JOINTS = (0.1, -1.5, 1.6, -1.7, -1.5, 0.2)
OPTIONS = {"explore": {"object": "box"}, "regulate": {}, "friction": {"quick": True}}


def plan_of(kind, robot="ur5e-netft", twin=False, **options):
    """The plan of an experiment on a robot, or on the stage that stands for it."""
    experiment, loaded = experiment_named(kind), load_named_robot(robot)
    config = experiment.Config(robot=robot, **OPTIONS.get(kind, {}), **options)
    return experiment.plan(config, loaded.file.backend.shown(loaded) if twin else loaded, {})


@pytest.mark.parametrize("kind", OPTIONS)
def test_a_rigs_run_is_shown_on_a_stage_that_goes_where_its_tip_was(kind):
    planned = plan_of(kind)
    assert scene_of(planned.backend()) is None  # nobody knows the truth
    model = known_scene(plan_of(kind, twin=True).backend()).model
    scene = shown_scene(experiment_named(kind), planned)
    tip = model.body(carried_body(model)).name
    assert isinstance(scene.placement, ScenePlacement)
    x, y, z = scene.placement.start.pose_base_tip.position
    for turn in (0.0, 0.4):
        told = Pose((x + 0.01, y - 0.02, z - 0.003), rotation_from_rotvec((0.0, 0.0, turn)))
        shown = scene.placement.poses(Posture(told, JOINTS))[tip]
        assert np.allclose(shown.position, told.position, atol=1e-12)
        # not only is it said to be there: the scene is placed so
        data = scene.placement.place(Posture(told, JOINTS))
        assert np.allclose(data.body(tip).xpos, told.position, atol=1e-9)
        assert np.allclose(data.body(tip).xmat.reshape(3, 3), told.rotation, atol=1e-9)


def test_a_rigs_grasp_is_shown_with_its_own_hand():
    believed = {"believed_friction": 0.4, "believed_spin_length": 0.003}
    planned: Any = plan_of("grasp", "ur5e-hand", **believed)
    scene = shown_scene(experiment_named("grasp"), planned)
    start = scene.placement.start
    x, y, z = start.pose_base_tip.position
    assert z == pytest.approx(planned.hand.geometry.depth + planned.hand.geometry.tip_along)
    risen = Posture(Pose((x, y, z + 0.04)), JOINTS, start.hand)
    assert scene.placement.poses(risen)["palm"].position[2] == pytest.approx(z + 0.04, abs=1e-12)


def test_a_run_with_joints_may_be_played_on_a_stage_but_not_on_another_arm():
    layout = FrameLayout(joints=6)
    frames = Frames(np.zeros((1, layout.width)), layout)
    Player(plan_of("friction", twin=True).view(), frames, port=0)
    simulated = plan_of("friction", "ur5e-sim")
    layout = FrameLayout(joints=7)
    with pytest.raises(ValueError, match="7 joints, the scene 6"):
        Player(simulated.view(), Frames(np.zeros((1, layout.width)), layout), port=0)
