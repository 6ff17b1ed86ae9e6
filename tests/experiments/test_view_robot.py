"""What a view shows of runs on a real robot: what they were told of, and a stage in the place of the arm."""

import numpy as np
import pytest
from palpate.commands.view.twin import shown_plan

from palpate.commands.view.plan import simulated_model, view_scene
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.plan import plan as plan_exploration
from palpate.experiments.grasp.config import GraspConfig
from palpate.experiments.grasp.plan import plan as plan_grasp
from palpate.kinematics.pose import Pose, rotation_from_rotvec
from palpate.kinematics.posture import Posture
from palpate.robots.known_truth import scene_of
from palpate.sim.render.parts import carried_body
from palpate.sim.render.place import ScenePlacement
from palpate.viewing import Player
from palpate.viewing.frames import FrameLayout, Frames
from support.friction_runs import planned as planned_friction
from support.regulate_runs import planned as plan_regulation

JOINTS = (0.1, -1.5, 1.6, -1.7, -1.5, 0.2)
PLANS = {
    "explore": lambda: plan_exploration(ExploreConfig(robot="ur5e-netft", object="box")),
    "regulate": lambda: plan_regulation(robot="ur5e-netft"),
    "friction": lambda: plan_friction(FrictionConfig(robot="ur5e-netft", quick=True)),
    "regulate": lambda: plan_regulation(RegulateConfig(robot="ur5e-netft")),
    "friction": lambda: planned_friction(robot="ur5e-netft", quick=True),
}


@pytest.mark.parametrize("kind", PLANS)
def test_a_rigs_run_is_shown_on_a_stage_that_goes_where_its_tip_was(kind):
    planned = PLANS[kind]()
    assert scene_of(planned.backend) is None  # nobody knows the truth
    model = simulated_model(planned)
    scene = view_scene(planned)
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


@pytest.mark.parametrize("kind", PLANS)
def test_the_twin_touches_what_the_run_was_told_of(kind):
    planned = PLANS[kind]()
    twin = shown_plan(planned)
    assert type(twin) is type(planned)
    assert twin.limits == planned.limits
    assert scene_of(twin.backend) is not None
    assert shown_plan(twin) is twin


def test_a_rigs_grasp_is_shown_with_its_own_hand():
    believed = {"believed_friction": 0.4, "believed_spin_length": 0.003}
    planned = plan_grasp(GraspConfig(robot="ur5e-hand", **believed))
    scene = view_scene(planned)
    start = scene.placement.start
    x, y, z = start.pose_base_tip.position
    assert z == pytest.approx(planned.hand.hand.depth + planned.hand.hand.tip_along)
    risen = Posture(Pose((x, y, z + 0.04)), JOINTS, start.hand)
    assert scene.placement.poses(risen)["palm"].position[2] == pytest.approx(z + 0.04, abs=1e-12)


def test_a_run_with_joints_may_be_played_on_a_stage_but_not_on_another_arm():
    layout = FrameLayout(joints=6)
    frames = Frames(np.zeros((1, layout.width)), layout)
    Player(view_scene(PLANS["friction"]()), frames, port=0)
    simulated = planned_friction(robot="ur5e-sim", quick=True)
    layout = FrameLayout(joints=7)
    with pytest.raises(ValueError, match="7 joints, the scene 6"):
        Player(view_scene(simulated), Frames(np.zeros((1, layout.width)), layout), port=0)
