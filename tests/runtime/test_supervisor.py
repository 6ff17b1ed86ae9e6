"""Limits that no controller can pass."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.errors import InvalidValueError
from palpate.runtime.data import Command, Phase
from palpate.runtime.supervisor import Limits, Supervisor
from runtime.puppets import PUSH, REST, sample, touch

any_float = st.floats(allow_nan=True, allow_infinity=True)
GOOD = Command((0.01, 0.0, 0.0), Phase.SCAN)


def observation(**told):
    return touch().sense(sample(**told))


def test_good_commands_pass_unchanged():
    supervisor = Supervisor()
    assert supervisor.check(observation(), GOOD) is GOOD
    assert supervisor.trip is None


@settings(max_examples=300, deadline=None, derandomize=True)
@given(st.tuples(any_float, any_float, any_float))
def test_whatever_is_commanded_what_passes_is_finite_and_not_too_fast(velocity):
    supervisor = Supervisor()
    passed = supervisor.check(observation(), Command(velocity, Phase.SCAN)).velocity_base_tip
    assert math.hypot(*passed) <= supervisor.limits.speed * (1 + 1e-15)
    acceptable = all(map(math.isfinite, velocity)) and math.hypot(*velocity) <= 0.25 * (1 - 1e-12)
    if acceptable:
        assert passed == velocity
    assert (supervisor.trip is None) == (passed == velocity)


@settings(max_examples=300, deadline=None, derandomize=True)
@given(st.tuples(*[any_float] * 6), st.tuples(*[any_float] * 3), st.tuples(*[any_float] * 3))
def test_whatever_is_sensed_motion_goes_on_only_within_the_limits(wrench, position, velocity):
    supervisor = Supervisor()
    passed = supervisor.check(observation(wrench=wrench, position=position, velocity=velocity), GOOD)
    within = (
        all(map(math.isfinite, (*wrench, *position, *velocity)))
        and math.hypot(*wrench[:3]) <= 20.0
        and all(-1.0 <= x <= 1.0 for x in position)
    )
    if not within:
        assert passed == Command(REST, Phase.HOLD)
        assert supervisor.trip is not None
    elif max(map(abs, (*wrench, *velocity))) < 1e300:
        assert passed is GOOD


def test_it_latches_and_keeps_the_first_reason():
    supervisor = Supervisor()
    supervisor.check(observation(time=0.5, wrench=(0.0, 0.0, 25.0, 0.0, 0.0, 0.0)), GOOD)
    first = supervisor.trip
    assert str(first) == "contact force was 25.00 N at t = 0.500 s; the limit is 20 N"
    for _ in range(3):
        assert supervisor.check(observation(time=1.0), GOOD) == Command(REST, Phase.HOLD)
    supervisor.check(observation(position=(9.0, 0.0, 0.0)), GOOD)
    assert supervisor.trip is first


def test_any_finger_may_trip_it():
    supervisor = Supervisor()
    wrenches = (PUSH, (0.0, 15.0, 15.0, 0.0, 0.0, 0.0))
    supervisor.check(touch(2).sense(sample(wrenches=wrenches)), GOOD)
    assert supervisor.trip.measure == "contact force"


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan, math.inf])
def test_limits_that_limit_nothing_are_refused(bad):
    with pytest.raises(InvalidValueError, match="force limit"):
        Limits(force=bad)
    with pytest.raises(InvalidValueError, match="speed limit"):
        Limits(speed=bad)


@pytest.mark.parametrize("upper", [-1.0, -2.0, math.nan])
def test_an_empty_workspace_is_refused(upper):
    with pytest.raises(InvalidValueError, match="workspace along y"):
        Limits(workspace_upper=(1.0, upper, 1.0))
