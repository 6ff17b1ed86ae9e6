"""A servo by itself: its maker's metrics, its limits, its friction."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.kinematics.servo_model import PULSE, VELOCITY_UNIT, XL330_M288, XM430_W210
from palpate.sim.hand.servo import BRISTLE_STEP, Servo

DT = 1e-3
MODELS = pytest.mark.parametrize("model", [XM430_W210, XL330_M288], ids=lambda m: m.name)


class Shaft:
    """A servo with nothing but its own inertia on it, and a torque from outside."""

    def __init__(self, model, goal, current=math.inf, speed=math.inf):
        self.servo, self.inertia, self.q, self.v = Servo(model, DT), model.inertia, 0.0, 0.0
        self.servo.write_goals(goal, min(current, model.current_limit), min(speed, model.velocity_limit))
        self.torque = 0.0

    def run(self, steps, outside=0.0):
        for _ in range(steps):
            self.torque = self.servo.step(self.q, self.v)
            self.v += DT * (self.torque + outside) / self.inertia
            self.q += DT * self.v
        return self

    def stalled(self, steps):
        """The same with the shaft clamped."""
        for _ in range(steps):
            self.torque = self.servo.step(self.q, 0.0)
        return self


@MODELS
def test_a_shaft_shows_the_makers_stall_torque_stall_current_and_no_load_speed(model):
    shaft = Shaft(model, 50.0).stalled(20000)
    assert shaft.servo.current == pytest.approx(model.stall_current, rel=1e-12)
    # clamped from the start, the bristle is not stretched: friction is what the model says it takes
    motor = model.torque_constant * model.stall_current
    assert motor * (1 - model.load_friction) - model.coulomb == pytest.approx(model.stall_torque, rel=1e-12)
    assert model.driving_torque(model.stall_current) == pytest.approx(model.stall_torque, rel=1e-12)
    free = Shaft(replace(model, velocity_limit=1e3), 500.0).run(500)
    assert free.v == pytest.approx(model.no_load_speed, rel=1e-3)


@MODELS
@pytest.mark.parametrize("speed", [0.1, 1.0, 5.0, 1e3])
def test_it_moves_with_the_profile_velocity_up_to_its_limit(model, speed):
    shaft = Shaft(model, 500.0, speed=speed).run(1000)
    start = shaft.q
    shaft.run(1000)
    rounded = VELOCITY_UNIT * round(min(speed, model.velocity_limit) / VELOCITY_UNIT)
    assert shaft.q - start == pytest.approx(rounded, rel=0.02, abs=2 * PULSE) or speed == 1e3
    assert shaft.q - start <= model.velocity_limit * 1.01


@MODELS
@given(
    goal=st.floats(-100.0, 100.0),
    asked=st.floats(-10.0, 10.0),
    motion=st.lists(st.tuples(st.floats(-10.0, 10.0), st.floats(-50.0, 50.0)), min_size=1, max_size=20),
)
def test_the_current_never_exceeds_goal_current_nor_limit(model, goal, asked, motion):
    servo = Servo(model, DT)
    servo.write_goals(goal, asked, 1.0)
    for position, velocity in motion:
        servo.step(position, velocity)
        assert abs(servo.current) <= servo.goal_current <= model.current_limit
        assert servo.goal_current <= abs(asked) + 0.5 * model.current_unit


@MODELS
def test_a_goal_is_reached_to_what_friction_leaves(model):
    """A P controller stops where its current no longer overcomes Coulomb friction."""
    shaft = Shaft(model, 1.0, speed=1.0).run(3000)
    per_radian = model.gain_p / 128 / PULSE * model.voltage / 885 / model.resistance * model.torque_constant
    assert abs(shaft.q - 1.0) <= model.coulomb / (1 - model.load_friction) / per_radian + PULSE
    resting = shaft.q
    shaft.run(1000)
    assert abs(shaft.q - resting) < 0.02 * PULSE  # on the edge of a pulse it may tremble within its bristle


@MODELS
@pytest.mark.parametrize(("share", "way"), [(0.02, 0), (0.98, 0), (-0.1, 1), (1.1, -1)])
def test_a_shaft_stands_between_driving_and_holding_torque_and_moves_beyond(model, share, way):
    current = 0.2 * model.stall_current
    low, high = model.driving_torque(current), model.holding_torque(current)
    assert high - low == pytest.approx(2 * (model.coulomb + model.load_friction * model.torque_constant * current))
    middle, load = 0.5 * (low + high), low + share * (high - low)
    shaft = Shaft(model, 500.0, current).stalled(20000)
    for i in range(2000 if way == 0 else 0):  # from where motor and load balance without friction
        shaft.run(1, -(middle + (load - middle) * i / 2000))
    shaft.run(1000 if way == 0 else 100, -load)
    if way:
        assert way * shaft.v > 0.0
        return
    resting = shaft.q
    shaft.run(5000, -load)
    assert abs(shaft.q - resting) < 1e-9
    assert abs(resting) < (high - middle) * DT**2 / (BRISTLE_STEP * model.inertia)  # the bristle gives way


@MODELS
@given(torque=st.floats(0.0, 3.0))
def test_currents_and_torques_are_inverse_to_each_other(model, torque):
    assert model.driving_torque(model.driving_current(torque)) == pytest.approx(torque, abs=1e-12)
    if torque > model.coulomb:
        assert model.holding_torque(model.yielding_current(torque)) == pytest.approx(torque)
    else:
        assert model.yielding_current(torque) == 0.0
    assert model.yielding_current(torque) <= model.driving_current(torque)


@MODELS
def test_friction_takes_energy_and_never_gives_any(model):
    """A cycle driven from outside without current costs 4 coulomb amplitude."""
    servo, amplitude = Servo(model, DT), 0.1
    servo.write_goals(0.0, 0.0, 1.0)
    q = amplitude * np.sin(2 * np.pi * np.arange(4000) / 2000)
    work = 0.0
    for a, b in itertools.pairwise(q):
        work -= servo.step(a, (b - a) / DT) * (b - a)
    assert work == pytest.approx(2 * 4 * model.coulomb * amplitude, rel=0.02)


@MODELS
@given(position=st.floats(-3.0, 3.0), current=st.floats(0.0, 1.0))
def test_it_goes_on_from_its_state_bit_for_bit(model, position, current):
    one, other = Servo(model, DT), Servo(model, DT)
    one.write_goals(position, current, 2.0)
    for i in range(5):
        one.step(0.01 * i, 0.1)
    other.set_state(one.state())
    assert [one.step(0.05 - 0.01 * i, -0.3) for i in range(5)] == [
        other.step(0.05 - 0.01 * i, -0.3) for i in range(5)
    ]


def test_an_integral_does_not_wind_up_against_a_wall():
    model = replace(XM430_W210, gain_i=500)
    shaft = Shaft(model, 1.0, current=0.5).stalled(20000)
    assert shaft.servo.current == pytest.approx(0.5, abs=model.current_unit)
    shaft.servo.write_goals(-0.1, 0.5, 100.0)
    shaft.stalled(400)
    assert shaft.servo.current < 0.0
