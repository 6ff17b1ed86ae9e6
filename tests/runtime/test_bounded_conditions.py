"""Conditions that declare bounds, anybody's, are watched compiled, and as if they were asked one by one."""

import math
from dataclasses import dataclass, replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.runtime.data import HandSample
from palpate.runtime.supervision import (
    CONTACT_FORCE,
    AtMost,
    Bound,
    Guard,
    MonitoredQuantity,
    Supervisor,
    Violation,
    broken_by_bounds,
)
from palpate.runtime.supervision.observed_row import POSITION, row_of
from runtime.puppets import PERIOD, sample, touch

SENSE = {count: touch(count).sense for count in (1, 2)}
numbers = st.floats(-30.0, 30.0) | st.sampled_from([math.nan, math.inf, -math.inf, 1e200])


@dataclass(frozen=True)
class Below:
    """A stranger's: the tip stays below a height [m], and does not rise by more than a step [m]."""

    height: float
    step: float = math.inf

    def bounds(self, layout):
        z = POSITION + 2
        return (
            Bound(z, lambda now, before: Violation("height", "too high", "lower"), high=self.height),
            Bound(
                z,
                lambda now, before: Violation("step", f"since {before}", "less"),
                high=self.step,
                minus=layout.before(z),
            ),
        )

    def broken(self, now, before):
        return broken_by_bounds(self, now, before)


class Never:
    """Declares nothing."""

    def broken(self, now, before):
        return Violation("never", "asked", "nothing")


def tripped(*guards, heights=(0.0, 0.3), **changes):
    supervisor = Supervisor(guards=guards)
    supervisor.start(PERIOD)
    for i, z in enumerate(heights):
        now = SENSE[1](sample(i * PERIOD, position=(0.0, 0.0, z), velocity=(0.0, 0.0, 0.1), **changes))
        if not supervisor.admits(now):
            return supervisor.trip.measure
    return None


@pytest.mark.parametrize(
    ("guards", "found"),
    [
        ((Guard(Below(0.2)), Guard(Never(), 1.0)), "height"),
        ((Guard(Never(), 1e-4), Guard(Below(0.2))), "never"),
        ((Guard(Below(0.2)), Guard(Never(), 1e-4)), "height"),
        ((Guard(Below(0.2), duration=0.01), Guard(Below(1.0, 0.1))), "step"),
        ((Guard(Below(0.4)),), "motion of the tip that the arm's reported velocity does not explain"),
    ],
)
def test_guards_of_both_kinds_trip_in_their_order_and_before_comparisons(guards, found):
    assert tripped(*guards) == found


def longest(now):
    lengths = [math.hypot(*finger.force) for finger in now.fingers]
    return math.nan if any(map(math.isnan, lengths)) else max(lengths)


@settings(max_examples=200, deadline=None)
@given(st.lists(st.tuples(numbers, numbers, numbers), min_size=1, max_size=2))
def test_what_is_watched_compiled_is_broken_where_the_same_quantity_in_python_is(forces):
    now = SENSE[len(forces)](sample(wrenches=[(*force, 0.0, 0.0, 0.0) for force in forces]))
    plain = AtMost(MonitoredQuantity("the same", "N", longest), 20.0)
    assert (AtMost(CONTACT_FORCE, 20.0).broken(now, None) is None) == (plain.broken(now, None) is None)


def test_a_row_of_another_layout_begins_with_the_same_numbers():
    """So that what came or went is told by name, whatever else has moved."""
    now, later = SENSE[1](sample(1.0)), SENSE[2](sample(2.0, wrenches=[(0.1, 0.0, 2.0, 0.0, 0.0, 0.0)] * 2))
    later = replace(later, hand=HandSample(2.0, (0.1,)), arm=replace(later.arm, joint_position=(0.5,)))
    row = row_of(later, now)
    assert row.values[row.layout.joint(0)] == 0.5
    before = row_of(now, None)
    size = row.layout.size
    same = before.values[: POSITION + 3].tolist()
    assert row.values[size : size + POSITION + 3].tolist() == pytest.approx(same, nan_ok=True)
