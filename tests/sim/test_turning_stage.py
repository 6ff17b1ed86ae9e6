"""The stage that turns: its servos, its following-error limit, what its sensor feels, and any orientation like any
other."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.errors import InvalidValueError
from palpate.kinematics import FollowingErrorLimit
from palpate.kinematics.pose import rotation_from_rotvec, rotvec_from_rotation, times, transposed
from palpate.runtime.data import Command
from palpate.sensing.compensation import SensorPayload, contact_wrench
from palpate.sim import Box, ContactLaw, Fidelity, MujocoBackend, SphereObject, Tip, TurningStage, build_scene
from palpate.spatial import IDENTITY, ZERO
from palpate.surfaces import Ellipsoid, Sphere

CENTERED = Tip(Sphere(0.008))
LONG = Tip(Ellipsoid((0.006, 0.008, 0.012), center=(0.001, -0.002, 0.03)), mass=0.1)
"""Its weight pulls beside the ball."""

FREE = (0.0, 0.0, 0.3)
directions = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: math.hypot(*v) > 0.1)


def backend_of(stage=None, tip=CENTERED, start=FREE, fidelity=None, target=None, law=None):
    scene = build_scene(
        tip, target or SphereObject(), law or ContactLaw(), start, stage or TurningStage(), fidelity
    )
    backend = MujocoBackend(scene)
    backend.start()
    return backend


def turn(backend, rate, periods, velocity=ZERO):
    command = Command(velocity, angular_velocity_base_tip=rate)
    for _ in range(periods):
        sample = backend.step(command)
    return sample


def angle_between(a, b):
    return math.hypot(*rotvec_from_rotation(times(a, transposed(b))))


@pytest.mark.parametrize("bandwidth", [50.0, 100.0, 200.0])
@pytest.mark.parametrize("inertia", [0.005, 0.05])
@settings(max_examples=5, deadline=None)
@given(axis=directions)
def test_a_steady_turn_about_any_axis_is_followed_with_the_lag_of_its_servo(bandwidth, inertia, axis):
    stage = TurningStage(bandwidth=bandwidth, inertia=inertia)
    rate = tuple((0.5 / np.linalg.norm(axis) * np.array(axis)).tolist())
    backend = backend_of(stage)
    sample = turn(backend, rate, 500)
    # the sample belongs to the state before its last time step; the reference starts at the first step
    reference = sample.time + backend.scene.fidelity.time_step - stage.lag
    wanted = rotation_from_rotvec(tuple(reference * w for w in rate))
    assert angle_between(sample.arm.rotation_base_tip, wanted) < 0.5 * 1.5 * backend.scene.fidelity.time_step
    assert sample.arm.angular_velocity_base_tip == pytest.approx(rate, abs=1e-9)


def test_a_load_changes_no_lag():
    """Damping over stiffness is the same, whatever is carried."""
    rate = (0.2, 0.3, -0.4)
    samples = [turn(backend_of(tip=tip), rate, 600) for tip in (CENTERED, LONG)]
    assert angle_between(*(sample.arm.rotation_base_tip for sample in samples)) < 1e-5


@pytest.mark.parametrize("axis", [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.6, -0.48, 0.64)])
def test_no_orientation_is_special(axis):
    """A whole turn and a half about any axis, tumbling about another one halfway: never faster or slower."""
    backend = backend_of()
    rate = tuple(2.0 * a for a in axis)
    turn(backend, rate, 300)
    for _ in range(4000):
        sample = backend.step(Command(angular_velocity_base_tip=rate))
        assert sample.arm.angular_velocity_base_tip == pytest.approx(rate, abs=1e-8)
        assert math.dist(sample.arm.position_base_tip, FREE) < 1e-8


def test_the_angular_velocity_is_how_fast_the_rotation_changes():
    backend = backend_of(tip=LONG)
    samples = []
    for i in range(1000):
        rate = tuple(math.sin(2.0 * math.pi * f * 1e-3 * i) for f in (1.0, 1.3, -0.7))
        samples.append(backend.step(Command(angular_velocity_base_tip=rate)))
    rotations = [sample.arm.rotation_base_tip for sample in samples]
    found = [
        np.array(rotvec_from_rotation(times(after, transposed(before)))) / 2e-3
        for before, after in zip(rotations[:-2], rotations[2:], strict=True)
    ]
    told = [sample.arm.angular_velocity_base_tip for sample in samples[1:-1]]
    assert np.abs(told).max() > 0.5
    # MuJoCo moves with the velocity after the step: half a time step of 8 rad/s^2
    assert np.abs(np.array(told) - found).max() < 0.0025
    for sample in samples:
        R = np.array(sample.arm.rotation_base_tip)
        assert np.allclose(R.T @ R, np.eye(3), atol=1e-14)


def test_a_long_detour_does_not_drift():
    """A hundred seconds of turning, and back by as much: the reference is where it was."""
    backend = backend_of(fidelity=Fidelity(1e-3))
    first = turn(backend, ZERO, 10).arm.rotation_base_tip
    rates = [(1.0, 0.3, -0.2), (0.0, -0.5, 1.5)]
    for rate in rates:
        turn(backend, rate, 10000)
    for rate in reversed(rates):
        turn(backend, tuple(-w for w in rate), 10000)
    last = turn(backend, ZERO, 500).arm.rotation_base_tip
    assert angle_between(first, last) < 1e-9


@settings(max_examples=10, deadline=None)
@given(st.tuples(*[st.floats(-1.5, 1.5)] * 3))
def test_turned_or_not_the_sensor_feels_the_whole_tip_and_nothing_else(rotvec):
    backend = backend_of(tip=LONG)
    turn(backend, tuple(2.0 * a for a in rotvec), 500)
    sample = turn(backend, ZERO, 400)
    assert sample.arm.position_base_tip == pytest.approx(FREE, abs=1e-9)  # it does not sag
    assert sample.arm.angular_velocity_base_tip == pytest.approx(ZERO, abs=1e-9)
    weight = np.array(sample.arm.rotation_base_tip).T @ (0.0, 0.0, -LONG.mass * 9.80665)
    given = sample.wrenches[0]
    assert given.wrench[:3] == pytest.approx(weight, abs=1e-9)
    felt = contact_wrench(given.wrench, given.acceleration, SensorPayload(LONG.mass, LONG.center_of_mass))
    assert felt == pytest.approx((0.0,) * 6, abs=1e-9)


def test_it_does_not_sag_while_it_turns():
    """The moment of a weight beside the ball is known to it, and turns with it."""
    backend = backend_of(tip=LONG)
    rate = (0.0, 0.5, 0.0)
    reference = 0.0
    for _ in range(3000):
        sample = backend.step(Command(angular_velocity_base_tip=rate))
    reference = 0.5 * (sample.time + 0.5e-3 - 0.02)
    wanted = rotation_from_rotvec((0.0, reference, 0.0))
    # unbalanced, 0.03 N m on 100 N m/rad would be 0.3 mrad
    assert angle_between(sample.arm.rotation_base_tip, wanted) < 0.5 * 1.5 * 0.5e-3 + 1e-5
    assert math.dist(sample.arm.position_base_tip, FREE) < 1e-6  # what circles is not quite at rest


@pytest.mark.parametrize("angle", [0.01, 0.06])
def test_the_leash_bounds_the_torque_against_an_obstacle(angle):
    """A long tip turned against a wall: what the ball's servo gives ends at inertia bandwidth^2 following-error
    limit."""
    stage = TurningStage(following_error_limit=FollowingErrorLimit(0.0025, angle))
    long = Tip(Sphere(0.008, center=(0.0, 0.0, -0.1)))
    law = ContactLaw(stiffness=20e3, friction=0.05)
    start = (-0.0385, 0.0, 0.1)
    backend = backend_of(stage, long, start, target=Box((0.06, 0.06, 0.06)), law=law)
    rate = (0.0, -0.2, 0.0)  # swings the tip, below the ball, towards +x: into the box's side
    turn(backend, rate, 2000)
    truth = backend.truth()
    assert truth.touching
    torque = np.cross(np.subtract(truth.position, backend.step(Command()).arm.position_base_tip), truth.force)
    assert np.linalg.norm(torque) == pytest.approx(stage.turning_stiffness * angle, rel=0.05)
    turn(backend, (0.0, 0.5, 0.0), 300)  # no wind-up: turning back frees the tip
    assert not backend.truth().touching


def test_pushed_away_it_stays_on_its_leash_and_comes_back():
    stage = TurningStage(following_error_limit=FollowingErrorLimit(0.0025, 0.02))
    backend = backend_of(stage)
    head = backend.scene.model.body("head").id
    torque = 3.0 * stage.turning_stiffness * 0.02
    backend._data.xfrc_applied[head, 3] = torque
    turn(backend, ZERO, 200)
    backend._data.xfrc_applied[head, 3] = 0.0
    turned = turn(backend, ZERO, 300).arm.rotation_base_tip
    again = turn(backend, ZERO, 300).arm
    assert angle_between(again.rotation_base_tip, turned) < 1e-9
    assert angle_between(turned, IDENTITY) > 0.1  # it gave way: the reference followed
    assert again.angular_velocity_base_tip == pytest.approx(ZERO, abs=1e-9)


@pytest.mark.parametrize("bandwidth", [50.0, 100.0])
def test_a_start_into_a_turn_does_not_swing(bandwidth):
    """Critically damped: no overshoot of the speed."""
    backend = backend_of(TurningStage(bandwidth=bandwidth))
    speeds = [turn(backend, (0.5, 0.0, 0.0), 1).arm.angular_velocity_base_tip[0] for _ in range(500)]
    assert max(speeds) < 0.5 * (1 + 1e-6)
    assert speeds[-1] == pytest.approx(0.5, abs=1e-6)


@pytest.mark.parametrize(("share", "stable"), [(0.98, True), (1.02, False)])
def test_the_servos_are_stable_up_to_the_stated_margin(share, stable):
    time_step = 1e-3
    stage = TurningStage(
        bandwidth=share * (2.0 + 2.0 * math.sqrt(2.0)) / time_step,
        following_error_limit=FollowingErrorLimit(0.1, 1.5),
    )
    backend = backend_of(stage, fidelity=Fidelity(time_step))
    backend._data.qvel[:] = 1e-6
    turn(backend, ZERO, 400)
    swing = np.abs(backend._data.qvel).max()
    assert (swing < 1e-7) == stable
    assert (swing > 1e-5) != stable


def test_a_load_too_bulky_for_the_head_is_refused_with_one_that_would_do():
    bulky = Tip(Sphere(0.02, center=(0.0, 0.0, -0.2)), mass=0.5)
    with pytest.raises(InvalidValueError, match=r"load has an inertia of 0.020.* give the stage more"):
        backend_of(tip=bulky)
    backend_of(TurningStage(inertia=0.021), bulky)
