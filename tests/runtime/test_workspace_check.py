"""Braking begins before the bound of the workspace: whatever it does, a tip that can be stopped stays inside."""

import math

from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.runtime.stopping import Stopping, stopping_of
from palpate.runtime.supervision.finding import Cause
from palpate.runtime.supervision.limits import Limits
from palpate.runtime.supervision.supervisor import WorkspaceCheck
from palpate.spatial import ZERO, add_scaled, toward
from runtime.puppets import sample, touch

PERIOD, LAG = 2e-3, 0.02
TOUCH = touch()
LIMITS = Limits(workspace_lower=(-0.03, -0.02, -0.02), workspace_upper=(0.02, 0.03, 0.02))


def observation(**changes):
    return TOUCH.sense(sample(**changes))


speeds = st.floats(-0.14, 0.14)
velocities = st.tuples(speeds, speeds, speeds)


@settings(max_examples=20)
@given(st.lists(velocities, min_size=1, max_size=8), st.floats(1.0, 50.0))
def test_a_tip_that_stops_as_stated_never_leaves_whatever_is_commanded(wanted, deceleration):
    """The plant follows with a lag, by no more than the stated acceleration."""
    check = WorkspaceCheck(LIMITS, Stopping(LAG + 2.0 * PERIOD, deceleration))
    position, velocity, target, stopped = ZERO, ZERO, ZERO, False
    for i in range(400):
        if not stopped:
            command = wanted[(i // 40) % len(wanted)]
            now = observation(position=position, velocity=velocity)
            stopped = check.broken(now, command) is not None
        target = toward(target, ZERO if stopped else command, deceleration * PERIOD)
        velocity = add_scaled(velocity, -math.expm1(-PERIOD / LAG), add_scaled(target, -1.0, velocity))
        position = add_scaled(position, PERIOD, velocity)
        for low, x, high in zip(LIMITS.workspace_lower, position, LIMITS.workspace_upper, strict=True):
            assert low <= x <= high


def test_what_leads_back_inside_is_allowed_outside_too():
    check = WorkspaceCheck(LIMITS, Stopping())
    outside = observation(position=(0.021, 0.0, 0.0))
    assert check.broken(outside, (-0.2, 0.0, 0.0)) is None
    assert check.broken(outside, ZERO) is None
    finding = check.broken(outside, (1e-6, 0.0, 0.0))
    assert finding.cause is Cause.MOTION
    assert "0.0210" in finding.value


def test_a_slow_arm_brakes_earlier_and_who_states_nothing_stops_as_the_default():
    now = observation(position=(0.01, 0.0, 0.0))
    assert WorkspaceCheck(LIMITS, Stopping(0.0, 5.0)).broken(now, (0.1, 0.0, 0.0)) is None
    assert WorkspaceCheck(LIMITS, Stopping(0.0, 0.1)).broken(now, (0.1, 0.0, 0.0)) is not None
    assert stopping_of(object()) == Stopping()
