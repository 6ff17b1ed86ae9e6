"""The active exploration: inside its field, replayable, nothing left out, and where the detail is."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.controllers.paths import Active, Ended, Event, Goal, Hop, LegEnd, Measure, Stroke
from palpate.errors import InvalidValueError
from paths_world import HeightWorld, explore

BUMP = (4e-3, -3e-3)


def bump(u, v):
    return 1.5e-3 * math.exp(-((u - BUMP[0]) ** 2 + (v - BUMP[1]) ** 2) / (2 * 1.2e-3**2))


def strokes(legs):
    """Rows as (begin, end)."""
    pairs = zip(legs[::2], legs[1::2], strict=False)
    return [(hop.to, stroke.corners[-1]) for hop, stroke in pairs if isinstance(stroke, Stroke)]


@settings(max_examples=4, deadline=None, derandomize=True)
@given(
    st.floats(0.01, 0.04),
    st.floats(0.01, 0.04),
    st.tuples(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3)),
    st.floats(0.0, 0.4),
)
def test_it_stays_in_its_field_and_leaves_no_strip_wider_than_the_prior(width, depth, center, slope):
    active = Active(width, depth, Goal(length=0.5), center=center)
    legs = explore(active, HeightWorld(lambda u, v: slope * u + bump(u - center[0], v - center[1])))
    points = np.array([leg.to if isinstance(leg, Hop) else leg.corners[-1] for leg in legs])
    half = np.array([width, depth]) / 2
    low, high = center - half, center + half
    assert (points >= low - 1e-9).all()
    assert (points <= high + 1e-9).all()
    whole = sorted(a[1] for a, b in strokes(legs) if abs(a[0] - b[0]) > width * (1 - 1e-6))
    assert whole[0] == pytest.approx(low[1])
    assert whole[-1] == pytest.approx(high[1])
    assert np.diff(whole).max() <= 0.0067 * 1.06
    longest = max(math.dist(a, b) for a, b in strokes(legs))
    assert longest <= width * (1 + 1e-9)


def test_told_the_same_it_asks_for_the_same():
    active = Active(0.02, 0.02)
    first = explore(active, HeightWorld(bump))
    assert explore(active, HeightWorld(bump)) == first
    assert explore(Active(0.02, 0.02), HeightWorld(bump)) == first


def test_extra_strokes_go_where_the_detail_is():
    flat = explore(Active(0.03, 0.03), HeightWorld(lambda u, v: 0.0 * u))
    found = explore(Active(0.03, 0.03), HeightWorld(bump))
    extra = strokes(found)[len(strokes(flat)) :]
    assert extra
    off = [abs(a[1] - BUMP[1]) for a, _ in extra]
    assert np.median(off) < 5e-3
    assert max(math.dist(a, b) for a, b in extra) < 0.03


def test_a_rough_surface_gets_closer_rows_than_a_smooth_one():
    def rows(wavelength):
        k = 2 * math.pi / wavelength
        legs = explore(
            Active(0.04, 0.04, Goal(length=0.35)),
            HeightWorld(lambda u, v: 1e-3 * math.sin(k * u) * math.cos(k * v)),
        )
        return strokes(legs)[1][0][1] - strokes(legs)[0][0][1]

    # the error of cubic interpolation goes with (gap / wavelength)^4: gaps go as wavelengths
    assert rows(0.024) / rows(0.012) == pytest.approx(2.0, rel=0.25)


def test_the_way_and_a_loss_end_it():
    active = Active(0.04, 0.04, Goal(length=0.1))
    explore(active, HeightWorld(bump))
    assert 0.1 <= active.way < 0.2
    lost = Active(0.04, 0.04)
    legs = explore(lost, HeightWorld(bump, lost=lambda u, v: v > 0.0))
    assert [mark.event for mark in lost.marks] == [Event.LOST]
    assert all(b[1] <= 0.02 for _, b in strokes(legs))


def test_what_cannot_be_reached_is_marked_and_not_asked_for_for_ever():
    active = Active(0.02, 0.02, Goal(length=3.0))
    legs = explore(active, HeightWorld(bump, missing=lambda u, v: v > 5e-3))
    assert Event.UNREACHABLE in {mark.event for mark in active.marks}
    tried = [leg.to for leg in legs if isinstance(leg, Hop) and leg.to[1] > 5e-3]
    assert len(tried) == len(set(tried))
    assert any(isinstance(leg, Stroke) for leg in legs)


def test_a_goal_met_later_costs_more():
    def way(error):
        active = Active(0.03, 0.03, Goal(error, Measure.LARGEST, length=5.0))
        explore(active, HeightWorld(bump))
        return active.way

    assert way(2e-4) <= way(1e-4) < way(2e-5)


def test_goals_and_fields_that_cannot_be_are_refused():
    with pytest.raises(InvalidValueError, match="goal error"):
        Goal(0.0)
    with pytest.raises(InvalidValueError, match="goal area"):
        Goal(area=1.1)
    with pytest.raises(InvalidValueError, match="width"):
        Active(-1.0, 0.02)
    assert Active(0.02, 0.02).next(Ended(LegEnd.LOST, (0.0, 0.0, 0.0))) is None
