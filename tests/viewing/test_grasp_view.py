"""A hand in the view and in pictures: every body where the simulation has it, an arrow per finger."""

import math
import pickle
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
import pytest
from PIL import Image

from palpate.commands.view.scene import free_poses_in, free_poses_of, write_still, write_video
from palpate.errors import InvalidValueError
from palpate.experiments.kit.scene import scene_view
from palpate.kinematics import Pose
from palpate.kinematics.posture import Posture
from palpate.runtime import Ending, Finger, Limits, Phase, Supervisor, Touch, run
from palpate.runtime.data import Command
from palpate.runtime.log import LogWriter, Recorder, read_log
from palpate.sensing.compensation import SensorPayload
from palpate.sim import Box, Lift, SphereObject
from palpate.sim.hand.backend import HandBackend
from palpate.sim.hand.hand import three_finger_hand, two_finger_hand
from palpate.sim.hand.mount import PALM
from palpate.sim.hand.scene import OBJECT, HeldObject, build_grasp_scene
from palpate.sim.objects.table import Table
from palpate.sim.render.gl import NoRendererError
from palpate.viewing import ANY_PORT, FrameMemory, Player, RowMaker, frames_of_log

LIFTED, LIFT_TIME = 0.02, 0.5
"""[m], [s]"""


class GripAndLift:
    """Press, then lift; the grasp's controllers are not what is tested here."""

    def start(self, first):
        self._begun = first.time

    def step(self, now):
        passed = now.time - self._begun
        force = (3.0,) * len(now.fingers)
        if passed < 1.5:
            return Command(grip_force=force)
        # from rest to rest
        share = min(1.0, (passed - 1.5) / LIFT_TIME)
        rise = LIFTED / LIFT_TIME * (1.0 - math.cos(2.0 * math.pi * share))
        return Command((0.0, 0.0, rise), Phase.HOLD if passed < 2.2 else Phase.DONE, force)


@dataclass
class Grasp:
    scene: Any
    view: Any
    frames: Any
    backend: Any
    log: Any


def grasped(hand, shape, folder):
    scene = build_grasp_scene(hand, HeldObject(shape), carrier=Lift(), table=Table(-0.03))
    backend, view = HandBackend(scene), scene_view("A grasp", scene.model)
    memory = FrameMemory(RowMaker(view, free_poses=free_poses_of(backend)))
    finger = Finger(hand.tip.surface, SensorPayload(hand.tip.mass, hand.tip.center_of_mass))
    log = LogWriter(folder / "grasp.mcap", {})
    result = run(
        backend,
        Touch(*[finger] * hand.fingers),
        GripAndLift(),
        Supervisor(Limits().allowing(0.2)),
        duration=5.0,
        recorder=Recorder(log),
        observers=(memory.observe,),
    )
    assert result.ending is Ending.DONE, result.trip
    return Grasp(scene, view, memory.frames, backend, read_log(folder / "grasp.mcap"))


@pytest.fixture(scope="module", params=["two", "three"])
def grasp(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp(request.param)
    if request.param == "two":
        return grasped(two_finger_hand(), Box((0.06, 0.05, 0.06)), folder)
    return grasped(three_finger_hand(), SphereObject(0.03), folder)


def test_every_body_is_where_the_simulation_has_it(grasp):
    """All states of a random hand: what a sample and the truth tell is enough to know where everything is."""
    model, placement = grasp.scene.model, grasp.view.placement
    random, data = np.random.default_rng(1), mujoco.MjData(model)
    for _ in range(20):
        data.qpos[:] += random.uniform(-0.02, 0.02, model.nq)
        mujoco.mj_normalizeQuat(model, data.qpos)
        mujoco.mj_kinematics(model, data)
        hand = tuple(float(data.joint(f"finger{i}").qpos[0]) for i in range(grasp.scene.hand.fingers))
        palm, held = (pose_of(data.body(name)) for name in (PALM, OBJECT))
        poses = placement.poses(Posture(palm, (), hand, (held,)))
        assert len(poses) == model.nbody - 1
        for name, pose in poses.items():
            assert pose.position == pytest.approx(data.body(name).xpos, abs=1e-12)
            assert np.ravel(pose.rotation) == pytest.approx(data.body(name).xmat, abs=1e-12)


def pose_of(body):
    a, b, c, d, e, f, g, h, i = body.xmat.tolist()
    return Pose(tuple(body.xpos.tolist()), ((a, b, c), (d, e, f), (g, h, i)))


def test_the_sensors_sit_where_the_view_takes_them_to_be(grasp):
    """Contacts are drawn from the bodies' frames: the sites of the sensors have the same."""
    data = mujoco.MjData(grasp.scene.model)
    mujoco.mj_kinematics(grasp.scene.model, data)
    assert len(grasp.view.fingers) == grasp.scene.hand.fingers
    for i, body in enumerate(grasp.view.fingers):
        site = data.site(f"finger{i}_sensor")
        assert site.xpos == pytest.approx(data.body(body).xpos, abs=1e-15)
        assert site.xmat == pytest.approx(data.body(body).xmat, abs=1e-15)


def test_frames_and_log_have_the_object_that_rises_with_the_hand(grasp):
    """Without its truth, the object stands where it stood at the start."""
    first, last = grasp.frames.posture(0), grasp.frames.posture(len(grasp.frames) - 1)
    assert first.free[0].position[2] == pytest.approx(0.0, abs=1e-4)
    assert last.free[0].position == pytest.approx(grasp.backend.truth().position, abs=1e-4)
    assert last.free[0].position[2] == pytest.approx(LIFTED, abs=1e-3)
    assert last.hand != first.hand, "fingers close"
    free_poses: Any = free_poses_of(grasp.backend)
    np.testing.assert_allclose(free_poses_in(grasp.log)[-1], free_poses(), atol=0.0)
    logged = frames_of_log(grasp.log)
    assert logged.layout.free == 0
    assert len(logged) == len(grasp.frames)
    np.testing.assert_array_equal(logged.rows[:, 1:-1], grasp.frames.rows[:, 1 : logged.layout.width - 1])
    scene = pickle.loads(pickle.dumps(grasp.view))  # as it passes to another process
    assert scene.placement.poses(last) == grasp.view.placement.poses(last)
    poses = scene.placement.poses(logged.posture(len(logged) - 1))
    assert poses[OBJECT] == grasp.view.placement.start.free[0]


def test_the_browser_gets_every_body_and_the_true_contact_force_of_each_finger(grasp):
    with Player(grasp.view, grasp.frames, port=ANY_PORT) as player:
        scene = player.server.scene
        player.step(1e9)
        bodies = list(dict.fromkeys(part.body for part in grasp.view.parts if part.body))
        assert {PALM, OBJECT, *grasp.view.fingers} < set(bodies)
        poses = grasp.view.placement.poses(grasp.frames.posture(len(grasp.frames) - 1))
        for i, body in enumerate(bodies):
            assert scene.get_handle_by_name(f"/body_{i}").position == pytest.approx(poses[body].position)
        truth = grasp.backend.truth()
        for i, finger in enumerate(truth.fingers):
            arrow: Any = scene.get_handle_by_name(f"/contact_force_{i}")
            assert arrow.visible
            start, end = arrow.position + arrow.points[0]
            assert start == pytest.approx(finger.position, abs=5e-4)
            assert (end - start) / 0.015 == pytest.approx(finger.force, abs=0.02)
        assert scene.get_handle_by_name(f"/contact_force_{len(truth.fingers)}") is None


def test_a_run_of_another_hand_is_refused(grasp):
    other = two_finger_hand() if grasp.scene.hand.fingers == 3 else three_finger_hand()
    scene = build_grasp_scene(other, HeldObject(SphereObject(0.03)), carrier=Lift())
    with pytest.raises(InvalidValueError, match="do not belong together"):
        Player(scene_view("another", scene.model), grasp.frames, port=ANY_PORT)
    with pytest.raises(InvalidValueError, match="joint positions"):
        scene_view("another", scene.model).placement.poses(grasp.frames.posture(0))


@pytest.mark.slow
def test_pictures_show_object_machine_tips_and_arrows(grasp, tmp_path):
    still, video = tmp_path / "a.png", tmp_path / "a.gif"
    try:
        write_still(grasp.view, grasp.frames, still)
    except NoRendererError as error:
        pytest.skip(f"no pictures here: {error}")
    red, _, blue = np.moveaxis(np.asarray(Image.open(still)).astype(int), 2, 0)
    orange = (red > blue + 60) & (red > 120)
    assert ((blue > red + 40) & (blue > 90)).sum() > 5000, "the object"
    assert orange.sum() > 300, "fingertips"
    assert ((red < 0.2 * blue) & (blue > 60)).sum() > 50, "arrows, without the red that the object has"
    grey = (abs(red - blue) < 20) & (red < 200)
    assert grey[:240].sum() > 2000, "palm and fingers, above"
    assert write_video(grasp.view, grasp.frames, video, 10.0) > 2
    with Image.open(video) as first:
        assert first.size == (640, 480)
