"""One back end, whatever carries the tip: lag, following-error limits, turning, and the sensor behind the tip."""

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
from palpate.sim import (
    ArmCarrier,
    Box,
    ContactLaw,
    Fidelity,
    Fixed,
    Integrator,
    Lift,
    SphereObject,
    Stage,
    Tip,
    TurningStage,
    build_scene,
    white_noise,
)
from palpate.sim.carriers.carriage import LARGEST_SERVO_STEP
from palpate.sim.fidelity import GRAVITY
from palpate.sim.friction.law import FrictionLaw
from palpate.spatial import IDENTITY, ZERO, cross, rotate, subtract
from palpate.surfaces import Ellipsoid, Sphere
from support.held_object import standing
from support.simulated import angle_between, started
from support.simulated import move as go

TIP = Tip(Sphere(0.008))
LONG = Tip(Ellipsoid((0.006, 0.008, 0.012), center=(0.001, -0.002, 0.03)), mass=0.1)
"""Its weight pulls beside the centre of the stage's ball joint."""
POINT = (0.0, 0.0, 0.02)
"""A point of the tip frame beside its origin [m]."""
FREE, STEP = (0.0, 0.0, 0.3), 0.5e-3
RUBBER = FrictionLaw(0.4, 0.3, spin_length=0.003, load_exponent=0.3, norm_exponent=1.4)
STAGE, TURNING, ARM = Stage(), TurningStage(), ArmCarrier()
CARRIERS = {"stage": STAGE, "turning stage": TURNING, "arm": ARM}

carriers = pytest.mark.parametrize("carrier", CARRIERS.values(), ids=CARRIERS)
turning = pytest.mark.parametrize("carrier", [TURNING, ARM], ids=["turning stage", "arm"])
directions = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: math.hypot(*v) > 0.1)


def backend_of(carrier=TURNING, start=(0.0, 0.0, 0.2), tip=TIP, target=None, law=None, sensor=None, **more):
    scene = build_scene(tip, target or SphereObject(0.04), law or ContactLaw(), start, carrier, **more)
    return started(scene, sensor=sensor)


def turn_between(after, before):
    """Turn from one rotation to another as a vector [rad], base frame."""
    return np.array(rotvec_from_rotation(times(after, transposed(before))))


def scaled(axis, length):
    return tuple((length / np.linalg.norm(axis) * np.array(axis)).tolist())


@carriers
def test_a_tip_starts_upright_where_it_was_placed_and_stays_there(carrier):
    backend = backend_of(carrier)
    for sample in (backend.start(), go(backend, 300)):
        assert sample.arm.position_base_tip == pytest.approx((0.0, 0.0, 0.2), abs=1e-8)
        assert np.allclose(sample.arm.rotation_base_tip, IDENTITY, atol=1e-8)
        # the tip's weight hangs on the sensor
        assert sample.wrenches[0].wrench[2] == pytest.approx(-TIP.mass * GRAVITY, rel=1e-6)
        assert sample.wrenches[0].acceleration[2] == pytest.approx(GRAVITY, rel=1e-6)


@pytest.mark.slow
@carriers
@pytest.mark.parametrize("friction", [None, RUBBER], ids=["MuJoCo's friction", "plant"])
def test_the_sensor_feels_the_true_contact(carrier, friction):
    backend = backend_of(carrier, (0.0, 0.0, 0.0285), target=Box(), friction=friction)
    sample, truth = go(backend, 400, (0.002, 0.0, -0.002)), backend.truth()
    assert truth.touching
    assert truth.force[0] < -0.1  # it rubs
    given = sample.wrenches[0]
    felt = np.array(given.wrench[:3]) + TIP.mass * np.array(given.acceleration)  # at rest up: weight comes off
    rotation = np.array(sample.arm.rotation_base_tip)
    assert rotation @ felt == pytest.approx(truth.force, abs=1e-3 * np.linalg.norm(truth.force))


def test_an_arm_reports_its_joints_and_keeps_to_their_speed():
    backend = backend_of(ARM, (0.0, 0.0, 0.1))
    joints = [backend.step(Command((0.0, 0.25, 0.1))).arm.joint_position for _ in range(300)]
    assert np.shape(joints) == (300, 6)
    assert np.abs(np.diff(joints, axis=0)).max() < np.pi * 1e-3


@pytest.mark.parametrize(("bandwidth", "mass"), [(50.0, 5.0), (100.0, 2.0), (200.0, 5.0)])
def test_a_ramp_is_followed_with_the_lag_of_a_critically_damped_servo(bandwidth, mass):
    stage, speed = Stage(mass=mass, bandwidth=bandwidth), 0.03
    sample = go(backend_of(stage), 600, (speed, 0.0, -speed))
    # the sample belongs to the state before its last time step; the reference starts at the first step
    behind = speed * (sample.time + STEP) - sample.arm.position_base_tip[0]
    assert stage.lag == 2.0 / bandwidth
    assert behind / speed == pytest.approx(stage.lag, abs=1.5 * STEP)
    assert sample.arm.velocity_base_tip == pytest.approx((speed, 0.0, -speed), abs=1e-9)


TURNERS = [TurningStage(bandwidth=50.0, inertia=0.05), TURNING, TurningStage(bandwidth=200.0, inertia=0.005), ARM]


@pytest.mark.parametrize("carrier", TURNERS, ids=["slow", "stage", "quick", "arm"])
@settings(max_examples=5, deadline=None)
@given(axis=directions)
def test_a_steady_turn_about_any_axis_is_followed_with_the_lag_of_its_servo(carrier, axis):
    """Within 0.3 mrad, and with the tip frame's origin where it was within 50 um; an arm's lag is fed forward."""
    rate, backend = scaled(axis, 0.4), backend_of(carrier)
    before, after = go(backend, 300, rate=rate), go(backend, 400, rate=rate)
    turned = turn_between(after.arm.rotation_base_tip, before.arm.rotation_base_tip)
    assert turned == pytest.approx(np.array(rate) * (after.time - before.time), abs=0.2e-3)
    elapsed = after.time + STEP - (0.0 if carrier is ARM else carrier.lag)
    reference = rotation_from_rotvec(tuple(elapsed * w for w in rate))
    assert angle_between(reference, after.arm.rotation_base_tip) < 0.3e-3
    assert math.dist(after.arm.position_base_tip, (0.0, 0.0, 0.2)) < 50e-6
    assert after.arm.angular_velocity_base_tip == pytest.approx(rate, abs=2e-3 if carrier is ARM else 1e-9)


@turning
def test_axes_are_those_of_the_base_whatever_the_tip_has_turned_to(carrier):
    backend, expected = backend_of(carrier), np.eye(3)
    for rate in ((0.8, 0.0, 0.0), (0.0, -0.6, 0.0), (0.0, 0.0, 0.7)):
        turned = go(backend, 600, rate=rate)
        assert turned.arm.angular_velocity_base_tip == pytest.approx(rate, abs=5e-3)
        expected = np.array(rotation_from_rotvec(tuple(0.6 * w for w in rate))) @ expected
        assert np.allclose(go(backend, 300).arm.rotation_base_tip, expected, atol=1e-3)


@turning
def test_without_angular_velocity_a_tip_keeps_its_orientation(carrier):
    """However it moves, whatever it has turned to before."""
    backend = backend_of(carrier)
    go(backend, 500, rate=(0.3, -0.4, 0.5))
    before = go(backend, 300).arm
    for i in range(1000):
        after = backend.step(Command((0.05 * math.cos(0.01 * i), 0.05 * math.sin(0.01 * i), 0.02))).arm
        # the first command is a jump from rest to 54 mm/s: joints of unlike inertia follow it unlike
        assert angle_between(after.rotation_base_tip, before.rotation_base_tip) < (0.4e-3 if i < 60 else 0.15e-3)
    assert math.dist(after.position_base_tip, before.position_base_tip) > 0.01


@turning
@settings(max_examples=8, deadline=None)
@given(axis=directions)
def test_turning_about_a_point_leaves_the_point_where_it_is(carrier, axis):
    """velocity = omega x (tip - point), sample by sample: the point ends less than 60 um away after 0.28 rad.

    The rest comes from the start, where position and angle settle at their own pace, and of the chord per period.
    """

    def point(sample):
        return np.add(sample.arm.position_base_tip, rotate(sample.arm.rotation_base_tip, POINT))

    rate, backend = scaled(axis, 0.4), backend_of(carrier)
    first = sample = backend.step(Command())
    start = point(first)
    for _ in range(700):
        arm = subtract(sample.arm.position_base_tip, tuple(start.tolist()))
        sample = backend.step(Command(cross(rate, arm), angular_velocity_base_tip=rate))
    assert angle_between(sample.arm.rotation_base_tip, first.arm.rotation_base_tip) > 0.25
    assert np.linalg.norm(point(sample) - start) < 0.06e-3


@turning
def test_moving_and_turning_do_not_disturb_one_another(carrier):
    """Both at once come to the pose that each gives alone."""
    velocity, rate = (0.03, -0.02, 0.01), (0.2, 0.5, -0.3)
    twists = ((velocity, ZERO), (ZERO, rate), (velocity, rate))
    moved, turned, both = (go(backend_of(carrier), 1000, *twist).arm for twist in twists)
    assert both.position_base_tip == pytest.approx(moved.position_base_tip, abs=0.1e-3)
    assert angle_between(both.rotation_base_tip, turned.rotation_base_tip) < 0.3e-3
    assert both.velocity_base_tip == pytest.approx(velocity, abs=0.3e-3)
    assert both.angular_velocity_base_tip == pytest.approx(rate, abs=3e-3)


@pytest.mark.parametrize(("carrier", "tip", "error"), [(TURNING, LONG, 0.0025), (ARM, TIP, 0.01)])
def test_the_angular_velocity_is_how_fast_the_rotation_changes(carrier, tip, error):
    backend, samples = backend_of(carrier, tip=tip), []
    for i in range(1000):
        rate = (math.sin(6e-3 * i), 0.5 * math.cos(8e-3 * i) - 0.5, -0.5 * math.sin(4e-3 * i))
        samples.append(backend.step(Command(angular_velocity_base_tip=rate)).arm)
    rotations = [sample.rotation_base_tip for sample in samples]
    found = [turn_between(after, before) / 2e-3 for before, after in zip(rotations, rotations[2:], strict=False)]
    reported = np.array([sample.angular_velocity_base_tip for sample in samples[1:-1]])
    assert np.abs(reported).max() > 0.5
    # MuJoCo moves with the velocity after the step: half a time step
    assert np.abs(reported - found)[100:].max() < error
    assert all(np.allclose(np.array(R).T @ R, np.eye(3), atol=1e-13) for R in rotations)


@pytest.mark.parametrize("axis", [(1.0, 0.0, 0.0), (0.6, -0.48, 0.64)])
def test_no_orientation_is_special(axis):
    """A whole turn and a half about any axis: never faster or slower."""
    backend, rate = backend_of(), tuple(2.0 * a for a in axis)
    go(backend, 300, rate=rate)
    for _ in range(4000):
        arm = go(backend, 1, rate=rate).arm
        assert arm.angular_velocity_base_tip == pytest.approx(rate, abs=1e-8)
        assert math.dist(arm.position_base_tip, (0.0, 0.0, 0.2)) < 1e-8


def test_a_long_detour_does_not_drift():
    """Half a minute of turning, and back by as much: the reference is where it was."""
    backend, rates = backend_of(fidelity=Fidelity(1e-3)), [(1.0, 0.3, -0.2), (0.0, -0.5, 1.5)]
    first = go(backend, 10).arm.rotation_base_tip
    for rate in (*rates, *(tuple(-w for w in rate) for rate in reversed(rates))):
        go(backend, 4000, rate=rate)
    assert angle_between(first, go(backend, 500).arm.rotation_base_tip) < 1e-9


@settings(max_examples=10, deadline=None)
@given(st.tuples(*[st.floats(-1.5, 1.5)] * 3))
def test_turned_or_not_the_sensor_feels_the_whole_tip_and_nothing_else(rotvec):
    backend = backend_of(start=FREE, tip=LONG)
    go(backend, 500, rate=tuple(2.0 * a for a in rotvec))
    sample = go(backend, 400)
    assert sample.arm.position_base_tip == pytest.approx(FREE, abs=1e-9)  # it does not sag
    assert sample.arm.angular_velocity_base_tip == pytest.approx(ZERO, abs=1e-9)
    weight = np.array(sample.arm.rotation_base_tip).T @ (0.0, 0.0, -LONG.mass * GRAVITY)
    given = sample.wrenches[0]
    assert given.wrench[:3] == pytest.approx(weight, abs=1e-9)
    felt = contact_wrench(given.wrench, given.acceleration, SensorPayload(LONG.mass, LONG.center_of_mass))
    assert felt == pytest.approx((0.0,) * 6, abs=1e-9)


def test_a_load_changes_no_lag_and_does_not_sag_while_it_turns():
    """Damping over stiffness is the same for every load, and the moment of its weight turns with it."""
    rate = (0.0, 0.5, 0.0)
    light, heavy = (go(backend_of(start=FREE, tip=tip), 3000, rate=rate) for tip in (TIP, LONG))
    assert angle_between(light.arm.rotation_base_tip, heavy.arm.rotation_base_tip) < 1e-5
    expected = rotation_from_rotvec((0.0, 0.5 * (heavy.time + STEP - TURNING.lag), 0.0))
    # unbalanced, 0.03 N m on 100 N m/rad would be 0.3 mrad
    assert angle_between(heavy.arm.rotation_base_tip, expected) < 0.5 * 1.5 * STEP + 1e-5
    assert math.dist(heavy.arm.position_base_tip, FREE) < 1e-6  # a circling load is not quite at rest


@pytest.mark.parametrize(
    "carrier",
    [Stage(following_error_limit=5e-4), Stage(following_error_limit=2.5e-3), Lift(following_error_limit=5e-4)],
)
def test_the_following_error_limit_bounds_the_push_and_does_not_wind_up(carrier):
    law = ContactLaw(stiffness=100e3)
    backend = backend_of(carrier, (0.0, 0.0, 0.0282), target=Box(), law=law)
    go(backend, 1500, (0.0, 0.0, -0.004))
    largest = (carrier.mass + TIP.mass) * carrier.bandwidth**2 * carrier.following_error_limit
    # within a period the reference runs on by another 4 mm/s for 1 ms
    assert backend.truth().force[2] == pytest.approx(largest, rel=0.015)
    go(backend, 200, (0.0, 0.0, 0.03))
    assert not backend.truth().touching


@pytest.mark.parametrize("angle", [0.01, 0.06])
def test_the_following_error_limit_bounds_the_torque_against_an_obstacle(angle):
    """A long tip turned against a wall: the ball's servo ends at inertia bandwidth^2 following-error limit."""
    stage = TurningStage(following_error_limit=FollowingErrorLimit(0.0025, angle))
    long, law = Tip(Sphere(0.008, center=(0.0, 0.0, -0.1))), ContactLaw(stiffness=20e3, friction=0.05)
    backend = backend_of(stage, (-0.0385, 0.0, 0.1), long, target=Box((0.06, 0.06, 0.06)), law=law)
    sample = go(backend, 2000, rate=(0.0, -0.2, 0.0))  # swings the tip, below the ball, towards the box's side
    truth = backend.truth()
    torque = np.cross(np.subtract(truth.position, sample.arm.position_base_tip), truth.force)
    assert np.linalg.norm(torque) == pytest.approx(stage.turning_stiffness * angle, rel=0.05)
    go(backend, 300, rate=(0.0, 0.5, 0.0))  # no wind-up: turning back frees the tip
    assert not backend.truth().touching


def test_a_tip_that_is_pushed_away_takes_its_reference_along():
    stage = TurningStage(following_error_limit=FollowingErrorLimit(0.0025, 0.02))
    backend = backend_of(stage)
    head = backend.scene.model.body("head").id
    backend._data.xfrc_applied[head, 3] = 3.0 * stage.turning_stiffness * 0.02
    go(backend, 200)
    backend._data.xfrc_applied[head, 3] = 0.0
    turned, again = go(backend, 300).arm.rotation_base_tip, go(backend, 300).arm
    assert angle_between(again.rotation_base_tip, turned) < 1e-9
    assert angle_between(turned, IDENTITY) > 0.1
    assert again.angular_velocity_base_tip == pytest.approx(ZERO, abs=1e-9)


@pytest.mark.parametrize(
    ("carrier", "turns"),
    [(Stage(bandwidth=LARGEST_SERVO_STEP / STEP), 0), (TurningStage(bandwidth=50.0), 1), (TURNING, 1)],
)
def test_a_start_does_not_swing(carrier, turns):
    """Critically damped, the fastest servo too: the speed never overshoots."""
    backend, speed = backend_of(carrier, fidelity=Fidelity(STEP, Integrator.EULER)), 0.5 if turns else 0.05
    arms = [go(backend, 1, (speed * (1 - turns), 0.0, 0.0), (speed * turns, 0.0, 0.0)).arm for _ in range(500)]
    speeds = [(arm.angular_velocity_base_tip if turns else arm.velocity_base_tip)[0] for arm in arms]
    assert max(speeds) < speed * (1 + (1e-6 if turns else 1e-3))
    assert speeds[-1] == pytest.approx(speed, rel=1e-6)


@pytest.mark.parametrize(("share", "stable"), [(0.98, True), (1.02, False)])
def test_the_servos_are_stable_up_to_the_stated_margin(share, stable):
    bandwidth = share * (2.0 + 2.0 * math.sqrt(2.0)) / 1e-3
    stage = TurningStage(bandwidth=bandwidth, following_error_limit=FollowingErrorLimit(0.1, 1.5))
    backend = backend_of(stage, fidelity=Fidelity(1e-3))
    backend._data.qvel[:] = 1e-6
    go(backend, 400)
    swing = np.abs(backend._data.qvel).max()
    assert (swing < 1e-7) == stable
    assert (swing > 1e-5) != stable


def test_a_load_too_bulky_for_the_head_is_refused_with_an_inertia_that_would_do():
    bulky = Tip(Sphere(0.02, center=(0.0, 0.0, -0.2)), mass=0.5)
    with pytest.raises(InvalidValueError, match=r"load has an inertia of 0.020.* give the stage more"):
        backend_of(tip=bulky, start=FREE)
    backend_of(TurningStage(inertia=0.021), FREE, bulky)


def test_another_seed_gives_other_wrenches_of_the_same_deviation_and_the_same_motion():
    runs = []
    for seed in (1, 2):
        backend = backend_of(STAGE, sensor=white_noise(0.05, 2e-3, seed))
        runs.append([backend.step(Command((0.01 * math.sin(0.05 * i), 0.005, 0.0))) for i in range(1000)])
    assert [sample.arm for sample in runs[0]] == [sample.arm for sample in runs[1]]
    one, other = (np.array([sample.wrenches[0].wrench for sample in samples]) for samples in runs)
    assert (one != other).all()
    deviation = math.sqrt(2.0) * np.array([0.05] * 3 + [2e-3] * 3)
    assert np.allclose((one - other).std(axis=0) / deviation, 1.0, atol=5 / math.sqrt(2 * len(one)))


@pytest.mark.parametrize("blow", [1e12, math.nan])
@pytest.mark.parametrize("make", [backend_of, standing], ids=["tip", "hand"])
def test_a_simulation_that_diverges_says_so(make, blow, tmp_path, monkeypatch):
    """MuJoCo would reset itself to the start without a word; MUJOCO_LOG.TXT goes to the working directory."""
    monkeypatch.chdir(tmp_path)
    backend = make()
    go(backend, 1)
    backend._data.qvel[0] = blow
    with pytest.raises(FloatingPointError, match="diverged"):
        go(backend, 1)


ABSURD = [
    Command((math.nan, 0.0, 0.0)),
    Command((0.0, 0.0, -math.inf)),
    Command((1e9, 0.0, 0.0)),
    Command(angular_velocity_base_tip=(0.0, math.nan, 0.0)),
    Command(angular_velocity_base_tip=(math.inf, -math.inf, 0.0)),
]


@pytest.mark.parametrize(
    ("make", "carrier", "command"),
    [
        *zip([backend_of] * 5, (STAGE, TURNING, ARM, Lift(), ARM), ABSURD, strict=True),
        *zip([standing] * 5, (Lift(), Fixed(), TURNING, STAGE, ARM), ABSURD, strict=True),
    ],
)
def test_an_absurd_command_is_refused_and_leaves_no_trace(make, carrier, command):
    """MuJoCo sends servos whose reference is not finite to 0: the tip would jump back to where it started."""
    backend, undisturbed = make(carrier=carrier), make(carrier=carrier)
    up = (0.0, 0.0, 0.0 if isinstance(carrier, Fixed) else 0.01)
    for each in (backend, undisturbed):
        go(each, 20, up)
    with pytest.raises(InvalidValueError, match=r"velocity_base_tip = .*must be numbers, all together below"):
        backend.step(command)
    assert [go(backend, 1, up) for _ in range(5)] == [go(undisturbed, 1, up) for _ in range(5)]
