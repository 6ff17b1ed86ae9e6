"""Turning within its limits: commanded and measured, nonsense refused, whatever else is commanded."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.errors import InvalidValueError
from palpate.open_kinds import as_written
from palpate.robots.robot_file import read_robot_file
from palpate.runtime.data import Command, Phase
from palpate.runtime.loop import run
from palpate.runtime.result import Ending
from palpate.runtime.supervision import CONTACT_FORCE, AtMost, Guard, Limits, Stop, Supervisor
from palpate.spatial import ZERO
from palpate.yaml_text import yaml_text
from runtime.puppets import PERIOD, REST, PuppetBackend, PuppetController, sample, touch

any_float = st.floats(allow_nan=True, allow_infinity=True)
STOP = Command(REST, Phase.STOP)
SLOW = Limits(angular_speed=0.5, angular_acceleration=100.0)


def observation(rate=ZERO, time=0.0):
    now = touch().sense(sample(time=time))
    return replace(now, arm=replace(now.arm, angular_velocity_base_tip=rate))


def started(limits=None):
    supervisor = Supervisor(limits)
    supervisor.start(PERIOD)
    return supervisor


def turning(rate, velocity=REST, grip=None):
    return Command(velocity, Phase.SCAN, grip, rate)


def step(supervisor, now, command):
    return supervisor.check(now, command) if supervisor.admits(now) else supervisor.react(now)


def ramp(supervisor, last, periods, first=0):
    """Turn faster and faster about z, up to `last`; every command must pass."""
    for i in range(1, periods + 1):
        command = turning((0.0, 0.0, last * i / periods))
        assert step(supervisor, observation(time=(first + i) * PERIOD), command) is command


@settings(max_examples=300, deadline=None, derandomize=True)
@given(st.tuples(any_float, any_float, any_float))
def test_whatever_turn_is_commanded_what_passes_is_finite_and_within_the_limits(rate):
    supervisor = started()
    passed = step(supervisor, observation(), turning(rate)).angular_velocity_base_tip
    size = math.hypot(*passed)
    assert size <= 2.5 * (1 + 1e-8)
    assert size / PERIOD <= 250.0 * (1 + 1e-8)  # it came from rest
    if all(map(math.isfinite, rate)) and math.hypot(*rate) <= 250.0 * PERIOD * (1 - 1e-12):
        assert passed == rate
    assert (supervisor.trip is None) == (passed == rate)


@pytest.mark.parametrize("axis", [(1.0, 0.0, 0.0), (0.0, -0.6, 0.8)])
def test_a_controller_that_asks_for_too_fast_a_turn_is_stopped(axis):
    supervisor = started(SLOW)
    for i in range(1, 6):  # 0.1 rad/s in a millisecond is 100 rad/s^2
        command = turning(tuple(0.1 * i * a for a in axis))
        assert step(supervisor, observation(time=i * PERIOD), command) is command
    assert step(supervisor, observation(time=0.01), turning(tuple(0.51 * a for a in axis))) == STOP
    assert str(supervisor.trip).startswith("commanded angular speed was 0.51 rad/s")
    assert supervisor.trip.limit == "0.5 rad/s"


@pytest.mark.parametrize("jump", [(0.0, 0.0, 0.101), (0.08, 0.0, -0.08)])
def test_a_jump_of_the_turn_trips_a_ramp_does_not(jump):
    supervisor = started(SLOW)
    ramp(supervisor, 0.3, 3)
    rate = tuple(np.add((0.0, 0.0, 0.3), jump).tolist())
    assert step(supervisor, observation(time=0.01), turning(rate)) == STOP
    assert supervisor.trip.measure == "commanded angular acceleration"
    assert supervisor.trip.limit == "100 rad/s^2"


def test_a_stop_of_the_turn_is_a_change_like_any_other():
    supervisor = started(SLOW)
    ramp(supervisor, 0.5, 5)
    assert step(supervisor, observation(time=0.01), turning(ZERO)) == STOP
    assert supervisor.trip.measure == "commanded angular acceleration"


def test_the_limit_is_of_the_turn_alone_not_of_what_else_is_commanded():
    supervisor = started(SLOW)
    command = turning((0.05, 0.0, 0.0), (0.02, 0.0, 0.0), (3.0,))
    assert step(supervisor, observation(), command) is command
    silent = turning((0.1, 0.0, 0.0), (0.02, 0.0, 0.0))
    assert step(supervisor, observation(time=PERIOD), silent) is silent
    # what it remembers is the turn, too, when the grip is left as it was
    assert step(supervisor, observation(time=2 * PERIOD), turning((0.0, 0.15, 0.0))).phase is Phase.STOP
    assert supervisor.trip.measure == "commanded angular acceleration"


@pytest.mark.parametrize("rate", [(0.0, 0.0, 2.76), (2.0, 2.0, 0.0)])
def test_a_robot_that_turns_faster_than_it_may_is_stopped(rate):
    supervisor = started()
    assert supervisor.admits(observation((0.0, 0.0, 2.74)))  # servos overshoot
    assert not supervisor.admits(observation(rate, PERIOD))
    assert "measured angular speed of the tip" in str(supervisor.trip)
    assert supervisor.trip.limit == "2.75 rad/s"


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_an_angular_velocity_that_is_no_number_stops_the_robot(bad):
    supervisor = started()
    assert not supervisor.admits(observation((0.0, bad, 0.0)))
    assert supervisor.trip.measure == "arm state"


@pytest.mark.parametrize(
    "rate",
    [
        None,
        0.0,
        (),
        (0.0, 0.0),
        (0.0, 0.0, 0.0, 0.0),
        ("a", "b", "c"),
        (0.0, math.nan, 0.0),
        (math.inf, -math.inf, 0.0),
        (1e308, 1e308, 1e308),
        (None, 0.0, 0.0),
        ((0.0,), (0.0,), (0.0,)),
        {},
    ],
)
def test_what_is_no_turn_never_reaches_the_robot(rate):
    supervisor = started()
    assert step(supervisor, observation(), turning(rate)) == STOP
    assert supervisor.trip.measure == "commanded angular velocity"
    assert supervisor.finished


def test_an_array_that_its_owner_fills_again_is_passed_as_it_was():
    supervisor = started()
    own = np.array([0.01, 0.02, 0.03])
    passed = step(supervisor, observation(), turning(own))
    assert passed.angular_velocity_base_tip == (0.01, 0.02, 0.03)
    own[:] = 0.2  # within all limits by itself, but a jump of 0.3 rad/s
    own *= -1.0
    assert passed.angular_velocity_base_tip == (0.01, 0.02, 0.03)
    assert step(supervisor, observation(time=PERIOD), turning(own)) == STOP


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan, math.inf])
@pytest.mark.parametrize("name", ["angular_speed", "angular_acceleration"])
def test_limits_that_limit_nothing_are_refused(name, bad):
    with pytest.raises(InvalidValueError, match=f"^{name}_rad_per_s"):
        Limits(**{name: bad})


ROBOT = """\
palpate_robot: 1
name: a turning one
backend: {kind: turning_stage}
period_s: 0.001
fingers:
  - surface: {kind: sphere, radius_m: 0.008}
    payload: {mass_kg: 0.03}
limits:
  angular_speed_rad_per_s: 0.7
  angular_acceleration_rad_per_s2: 40
"""


def test_a_robot_file_gives_the_limits_of_turning_and_reads_back_to_the_same():
    robot = read_robot_file(ROBOT)
    limits = robot.limits
    assert (limits.angular_speed, limits.angular_acceleration) == (0.7, 40.0)
    assert read_robot_file(yaml_text(as_written(robot))) == robot
    silent = Limits()
    assert (silent.angular_speed, silent.angular_acceleration) == (2.5, 250.0)


@pytest.mark.parametrize("key", ["angular_speed_rad_per_s", "angular_acceleration_rad_per_s2"])
@pytest.mark.parametrize("value", ["0", "-1", ".nan", ".inf", "1e5", "fast"])
def test_a_robot_file_with_a_limit_that_cannot_be_is_refused_with_its_key(key, value):
    line = next(line for line in ROBOT.splitlines() if key in line)
    with pytest.raises(InvalidValueError, match=key):
        read_robot_file(ROBOT.replace(line, f"  {key}: {value}"))


@pytest.mark.parametrize("wrong", ["angular_speed_deg_per_s", "angular_speed"])
def test_a_key_with_another_unit_is_refused_with_the_right_one(wrong):
    with pytest.raises(InvalidValueError, match="angular_speed_rad_per_s"):
        read_robot_file(ROBOT.replace("angular_speed_rad_per_s", wrong))


class Fling:
    """A reaction that is faster than it may be. A `Reaction`."""

    def step(self, now, since, grip):
        return turning((0.0, 2.0, 0.0), (0.01, 0.0, 0.0), grip)


def test_a_reaction_that_turns_too_fast_is_slowed_down_and_keeps_its_way():
    """Sliding and turning by the same share: what it would have done, later."""
    supervisor = Supervisor(SLOW, guards=(Guard(AtMost(CONTACT_FORCE, -1.0), reaction=(Fling(), Stop())),))
    supervisor.start(PERIOD)
    now = observation()
    assert not supervisor.admits(now)
    passed = supervisor.react(now)
    assert passed.angular_velocity_base_tip == pytest.approx((0.0, 0.5, 0.0))
    assert passed.velocity_base_tip == pytest.approx((0.0025, 0.0, 0.0))


@pytest.mark.parametrize("change", [turning((0.0, 3.0, 0.0)), turning((math.nan, 0.0, 0.0)), turning("round")])
def test_in_the_loop_it_is_brought_to_rest(change):
    backend = PuppetBackend()
    result = run(backend, touch(), PuppetController({20: change}), duration=0.05)
    assert result.ending is Ending.TRIPPED
    assert "angular" in result.trip.measure
    assert result.at_rest
    assert backend.at_rest
    assert not any(any(command.angular_velocity_base_tip) for command in backend.commands)
