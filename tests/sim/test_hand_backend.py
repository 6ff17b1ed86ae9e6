"""The back end of a grasp: the seam, determinism, snapshots, what closing leaves, what is felt."""

import itertools
import math

import numpy as np
import pytest

from palpate.kinematics.servo_model import PULSE
from palpate.runtime.data import Command
from palpate.runtime.touch import Finger, Touch
from palpate.sensing.compensation import SensorPayload
from palpate.sim import Box, Lift, SphereObject
from palpate.sim.hand.backend import HandBackend
from palpate.sim.hand.hand import three_finger_hand, two_finger_hand
from palpate.sim.hand.scene import HeldObject, build_grasp_scene
from palpate.sim.objects.table import Table
from palpate.sim.sensor.model import SeededSensor, white_noise

LIFT = Lift()
TWO = build_grasp_scene(two_finger_hand(), HeldObject(Box((0.06, 0.05, 0.06))), carrier=LIFT, table=Table(-0.03))
THREE = build_grasp_scene(three_finger_hand(), HeldObject(SphereObject(0.03)), carrier=LIFT, table=Table(-0.03))
FIXED = build_grasp_scene(two_finger_hand(), HeldObject(Box((0.06, 0.05, 0.06))), table=Table(-0.03))
SCENES = pytest.mark.parametrize("scene", [TWO, THREE], ids=["two fingers", "three fingers"])
NOISY = white_noise(0.01, 1e-4)


def command(i, fingers):
    """Grip, press harder, lift, let down."""
    force = 2.0 + 1.5 * math.sin(0.01 * i) if i > 1200 else 2.0
    return Command((0.0, 0.0, 0.01 * math.sin(0.004 * i) if i > 1500 else 0.0), grip_force=(force,) * fingers)


def run(backend, periods=2200, first=0):
    fingers = backend.scene.hand.fingers
    return [backend.step(command(i, fingers)) for i in range(first, first + periods)]


def test_fingers_do_not_share_their_noise():
    backend = HandBackend(TWO, sensor=NOISY)
    backend.start()
    samples = [backend.step(Command()) for _ in range(500)]
    noise = np.array([[wrench.wrench[0] for wrench in sample.wrenches] for sample in samples])
    assert abs(np.corrcoef(noise.T)[0, 1]) < 0.2


@pytest.mark.parametrize("periods", [1, 2, 5])
def test_samples_are_one_period_apart_and_the_truth_is_theirs(periods):
    backend = HandBackend(TWO, periods * 1e-3)
    times = [backend.start().time]
    for _ in range(50):
        times.append(backend.step(Command(grip_force=(1.0, 1.0))).time)
        assert backend.truth().time == times[-1]
    assert times[0] == 0.0
    assert [b - a for a, b in itertools.pairwise(times)] == pytest.approx([backend.period] * 50)


@SCENES
def test_joint_positions_are_as_fine_and_as_old_as_encoder_and_bus_make_them(scene):
    backend, hand = HandBackend(scene), scene.hand
    backend.start()
    samples = run(backend, 1000)
    steps = [q / (PULSE * hand.finger.ratio) for sample in samples for q in sample.hand.joint_position]
    assert steps == pytest.approx(np.round(steps), abs=1e-9)
    assert max(steps) > 2
    ages = {round((sample.time - sample.hand.time) / backend.period) for sample in samples}
    assert ages == set(range(round(hand.bus_period / backend.period)))


@SCENES
def test_closing_leaves_the_grip_and_stops_the_lift(scene):
    """Nothing is dropped: neither by closing, nor by a command that says nothing of the hand."""
    n = scene.hand.fingers
    with HandBackend(scene) as backend:
        backend.start()
        for _ in range(2500):
            backend.step(Command(grip_force=(4.0,) * n))
        for _ in range(1000):
            backend.step(Command((0.0, 0.0, 0.02)))
        height, grip = backend.truth().position[2], math.hypot(*backend.truth().fingers[0].force[:2])
    backend.close()
    for _ in range(1000):
        sample = backend.step(Command())
    truth = backend.truth()
    assert abs(truth.position[2] - height) < 1e-3
    assert math.hypot(*sample.arm.velocity_base_tip) < 1e-9
    assert math.hypot(*truth.fingers[0].force[:2]) == pytest.approx(grip, rel=0.01)


def test_a_force_of_zero_lets_go():
    backend = HandBackend(FIXED)
    backend.start()
    for _ in range(2000):
        backend.step(Command(grip_force=(3.0, 3.0)))
    assert all(finger.touching for finger in backend.truth().fingers)
    for _ in range(2000):
        backend.step(Command(grip_force=(0.0, 0.0)))
    assert not any(finger.touching for finger in backend.truth().fingers)
    assert backend.truth().joint_position[0] == pytest.approx(0.0, abs=1e-3)


@SCENES
def test_the_lift_floats_where_it_is_left(scene):
    """Palm and fingers are balanced: no command, no motion."""
    backend = HandBackend(scene)
    backend.start()
    for _ in range(300):
        sample = backend.step(Command())
    assert sample.arm.position_base_tip == pytest.approx(scene.palm, abs=1e-8)


def test_the_lift_follows_a_ramp_with_the_lag_of_its_servo():
    backend = HandBackend(TWO)
    start = backend.start().arm.position_base_tip[2]
    for _ in range(500):
        sample = backend.step(Command((0.0, 0.0, 0.02)))
    rise = sample.arm.position_base_tip[2] - start
    assert 0.02 * sample.time - rise == pytest.approx(0.02 * 2.0 / LIFT.bandwidth, abs=5e-5)
    assert sample.arm.velocity_base_tip == pytest.approx((0.0, 0.0, 0.02), abs=1e-6)


@pytest.mark.parametrize("blow", [1e12, math.nan])
def test_a_simulation_that_diverges_says_so(blow, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # where MuJoCo writes MUJOCO_LOG.TXT
    backend = HandBackend(TWO)
    backend.start()
    backend._data.qvel[0] = blow
    with pytest.raises(FloatingPointError, match="diverged"):
        backend.step(Command())


@SCENES
def test_every_finger_feels_the_object_that_it_holds(scene):
    hand, backend = scene.hand, HandBackend(scene, sensor=SeededSensor())
    finger = Finger(hand.tip.surface, SensorPayload(hand.tip.mass, hand.tip.center_of_mass))
    touch = Touch(*[finger] * hand.fingers)
    touch.sense(backend.start())
    grip = Command(grip_force=(3.0,) * hand.fingers)
    for _ in range(2000):
        backend.step(grip)
    for _ in range(500):
        backend.step(Command((0.0, 0.0, 0.02)))
    for _ in range(1000):
        observed = touch.sense(backend.step(grip))
        assert all(finger.touching for finger in observed.fingers)
