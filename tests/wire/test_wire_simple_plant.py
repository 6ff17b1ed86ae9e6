"""Plants behind emulated devices: their physics, and a load over time."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.errors import InvalidValueError
from palpate.hw.emulators.server import ServoGoal
from palpate.hw.emulators.simple_plant import (
    GRAVITY,
    ElasticPlane,
    ElasticWall,
    LoadPlant,
    ServoMotor,
    SimplePlant,
    SimpleServo,
    SimpleTip,
)
from palpate.kinematics.pose import Pose, rotation_from_rotvec
from palpate.spatial import ZERO, norm, rotate

VECTORS = st.tuples(*[st.floats(-0.5, 0.5)] * 3)


def driven(plant: SimplePlant, velocity: tuple[float, ...], turning: tuple[float, ...], seconds: float) -> None:
    vx, vy, vz = velocity
    wx, wy, wz = turning
    for _ in range(round(seconds / plant.period)):
        plant.step((vx, vy, vz), (wx, wy, wz), ())


@given(VECTORS, st.sampled_from([0.0005, 0.002, 0.008]))
@settings(max_examples=20, deadline=None)
def test_a_lag_costs_its_time_constant(velocity: tuple[float, ...], period: float) -> None:
    """After a while the distance is v (t - lag), whatever the step."""
    tip = SimpleTip(Pose())
    driven(SimplePlant(tip, period=period), velocity, ZERO, 0.4)
    # trapezoids of an exponential: second order in the step
    expected = [v * (0.4 - tip.lag) for v in velocity]
    assert tip.pose_base_tip.position == pytest.approx(expected, abs=0.5 * period**2 / tip.lag + 1e-12)


@given(VECTORS)
@settings(max_examples=20, deadline=None)
def test_turning_without_lag_is_exact(turning: tuple[float, ...]) -> None:
    tip = SimpleTip(Pose(), lag=0.0)
    plant = SimplePlant(tip)
    driven(plant, ZERO, turning, 0.002)  # from rest: half the distance
    driven(plant, ZERO, turning, 0.399 - 0.001)
    wx, wy, wz = (0.399 * w for w in turning)
    got, wanted = tip.pose_base_tip.rotation, rotation_from_rotvec((wx, wy, wz))
    assert [x for row in got for x in row] == pytest.approx([x for row in wanted for x in row], abs=1e-9)


@given(VECTORS, st.floats(-0.01, 0.01), st.floats(100.0, 1e5))
def test_the_plane_pushes_up_whatever_way_the_tip_is_turned(
    rotvec: tuple[float, ...], depth: float, stiffness: float
) -> None:
    x, y, z = rotvec
    rotation = rotation_from_rotvec((x, y, z))
    plant = SimplePlant(SimpleTip(Pose((0.1, 0.2, -depth), rotation), ElasticPlane(0.0, stiffness)))
    sample = plant.start().wrenches[0]
    fx, fy, fz, *moment = sample.wrench
    assert rotate(rotation, (fx, fy, fz)) == pytest.approx((0.0, 0.0, max(0.0, stiffness * depth)), abs=1e-9)
    assert moment == [0.0, 0.0, 0.0]
    # at rest an accelerometer feels what holds it up
    assert rotate(rotation, sample.acceleration) == pytest.approx((0.0, 0.0, GRAVITY), abs=1e-9)
    assert norm(sample.acceleration) == pytest.approx(GRAVITY)


@given(st.floats(0.0, 0.01), st.floats(-1.0, 1.0))
def test_a_damped_plane_takes_energy_and_never_pulls(depth: float, speed: float) -> None:
    elastic, damped = ElasticPlane(0.0, 1e3), ElasticPlane(0.0, 1e3, damping=50.0)
    extra = damped.force(-depth, speed) - elastic.force(-depth, speed)
    assert extra * speed <= 0.0
    assert damped.force(-depth, speed) >= 0.0


@given(
    goal=st.floats(-0.5, 0.5),
    current=st.floats(0.1, 1.0),
    speed=st.just(0.0) | st.floats(0.5, 5.0),
    stiffness=st.floats(1.0, 1e4),
)
@settings(max_examples=15, deadline=None)
def test_a_servo_comes_to_rest_where_its_torques_balance(
    goal: float, current: float, speed: float, stiffness: float
) -> None:
    motor, wall = ServoMotor(), ElasticWall(0.2, stiffness)
    servo = SimpleServo(motor, wall)
    for _ in range(2000):
        servo.step(ServoGoal(True, goal, current, speed), 0.002)
        assert abs(servo.state.current) <= current
        assert speed == 0.0 or abs(servo.state.velocity) <= speed + 1e-12
    net = motor.torque_constant * servo.state.current + wall.torque(servo.state.position)
    assert abs(net) <= motor.friction + 1e-6
    assert abs(servo.state.velocity) < 1e-3


def test_a_servo_that_runs_into_a_wall_stalls_with_its_goal_current() -> None:
    servo = SimpleServo(wall=ElasticWall(0.2, 50.0))
    for _ in range(2000):
        servo.step(ServoGoal(True, 1.0, 0.3, 0.0), 0.002)
    assert servo.state.current == 0.3
    # friction holds part of it on the way in
    pressed = (0.35 * 0.3 - 0.01) / 50.0
    assert servo.state.position == pytest.approx(0.2 + pressed, abs=1e-5)


def test_a_servo_without_torque_stays_where_friction_holds_it() -> None:
    servo = SimpleServo()
    for _ in range(100):
        servo.step(ServoGoal(False, 1.0, 1.0, 0.0), 0.002)
    assert (servo.state.position, servo.state.current) == (0.0, 0.0)


def test_free_speed_is_what_drag_leaves() -> None:
    servo = SimpleServo()
    servo.step(ServoGoal(True, 1e3, 1.47, 0.0), 0.002)
    assert servo.state.velocity == pytest.approx((0.35 * 1.47 - 0.01) / 0.048)
    # 103 rev/min of the data sheet
    assert servo.state.velocity == pytest.approx(103.0 * 2.0 * math.pi / 60.0, rel=0.05)


def test_bad_numbers_are_refused() -> None:
    for make in (
        lambda: ElasticPlane(math.nan),
        lambda: ElasticPlane(0.0, -1.0),
        lambda: SimpleTip(lag=-1.0),
        lambda: SimplePlant(period=0.0),
        lambda: ElasticWall(math.inf),
        lambda: ServoMotor(drag=0.0),
        lambda: SimplePlant().step(ZERO, ZERO, (ServoGoal(True, 0.0, 0.0, 0.0),)),
    ):
        with pytest.raises(InvalidValueError):
            make()


@given(period=st.floats(1e-4, 0.1), steps=st.integers(0, 50))
def test_the_load_is_that_of_its_time(period: float, steps: int) -> None:
    plant = LoadPlant(lambda time: (time, 0.0, -1.0, 0.0, math.sin(time), 0.0), period)
    for _ in range(2):  # a second start is as the first
        state = plant.start()
        for _ in range(steps):
            state = plant.step(ZERO, ZERO, ())
        assert state.time == steps * period
        (sample,) = state.wrenches
        assert sample.time == state.time
        assert sample.wrench == (state.time, 0.0, -1.0, 0.0, math.sin(state.time), 0.0)
    assert state.arm.velocity_base_tip == ZERO
    plant.close()
