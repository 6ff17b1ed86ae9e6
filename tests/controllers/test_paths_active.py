"""The active exploration: inside its field, replayable, nothing left out, and where the detail is."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from palpate.controllers.paths import (
    Active,
    ActiveSettings,
    Goal,
    GoalError,
    Hop,
    LegEnd,
    LegResult,
    PathEvent,
    Stroke,
)
from palpate.errors import InvalidValueError
from support.paths_world import HeightWorld, explore

BUMP = (4e-3, -3e-3)


def bump(u, v):
    return 1.5e-3 * math.exp(-((u - BUMP[0]) ** 2 + (v - BUMP[1]) ** 2) / (2 * 1.2e-3**2))


class Fenced(HeightWorld):
    """What is missing cannot be slid into either."""

    def do(self, leg, strategy):
        if isinstance(leg, Stroke) and any(self.missing(*corner) for corner in leg.corners):
            self.legs.append(leg)
            return self.ended(LegEnd.BLOCKED)
        return super().do(leg, strategy)


END = 1.5 * ActiveSettings().stretch
"""A row counts as felt so far beyond its last contacts [m]."""


def strokes(legs):
    """Rows as (begin, end), landed at or slid to; what is in line with a row belongs to it."""
    rows, at = [], None
    for leg in legs:
        if isinstance(leg, Stroke):
            in_line = [p for p in (at, *leg.corners) if p[1] == leg.corners[-1][1]]
            rows.append((in_line[0], in_line[-1]))
        at = leg.to if isinstance(leg, Hop) else leg.corners[-1]
    return rows


@settings(max_examples=4, deadline=None, derandomize=True)
@given(
    st.floats(0.01, 0.04),
    st.floats(0.01, 0.04),
    st.tuples(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3)),
    st.floats(0.0, 0.4),
)
@example(0.01953125, 0.0390625, (0.0, 0.0), 0.0)  # a row was felt from before its stroke begins, on the way there
def test_it_stays_in_its_field_and_leaves_no_strip_wider_than_the_prior(width, depth, center, slope):
    active = Active(width, depth, Goal(length=2.0), center=center)
    legs = explore(active, HeightWorld(lambda u, v: slope * u + bump(u - center[0], v - center[1])))
    points = np.array([point for leg in legs for point in ([leg.to] if isinstance(leg, Hop) else leg.corners)])
    half = np.array([width, depth]) / 2
    low, high = center - half, center + half
    assert (points >= low - 1e-9).all()
    assert (points <= high + 1e-9).all()
    for u in np.linspace(low[0] + 1e-3, high[0] - 1e-3, 9):
        over = sorted(row.v for row in active.rows if row.u[0] - END <= u <= row.u[-1] + END)
        assert over[0] == pytest.approx(low[1])
        assert over[-1] == pytest.approx(high[1])
        assert np.diff(over).max() <= ActiveSettings().prior + 1e-9
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
    assert all(math.dist(a, b) == pytest.approx(0.03) for a, b in strokes(flat))

    def near(legs):
        way = np.concatenate([np.linspace(a, b, 1 + int(math.dist(a, b) / 1e-4)) for a, b in strokes(legs)])
        return np.mean(np.linalg.norm(way - BUMP, axis=1) < 4e-3)

    assert near(found) > 1.6 * near(flat)


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


def test_the_path_length_and_a_loss_end_it():
    active = Active(0.04, 0.04, Goal(length=0.1))
    explore(active, HeightWorld(bump))
    assert 0.1 <= active.path_length < 0.2
    lost = Active(0.04, 0.04)
    legs = explore(lost, HeightWorld(bump, lost=lambda u, v: v > 0.0))
    assert [mark.event for mark in lost.marks] == [PathEvent.LOST]
    assert all(b[1] <= 0.02 for _, b in strokes(legs))


def test_what_cannot_be_reached_is_marked_and_not_asked_for_for_ever():
    active = Active(0.02, 0.02, Goal(length=3.0))
    legs = explore(active, Fenced(bump, missing=lambda u, v: v > 5e-3))
    assert PathEvent.UNREACHABLE in {mark.event for mark in active.marks}
    tried = [leg.to for leg in legs if isinstance(leg, Hop) and leg.to[1] > 5e-3]
    assert len(tried) == len(set(tried))
    assert any(isinstance(leg, Stroke) for leg in legs)


@pytest.mark.slow
def test_the_tip_slides_from_stroke_to_stroke_but_not_past_what_stopped_it():
    legs = explore(Active(0.03, 0.03), HeightWorld(bump))
    assert [leg for leg in legs if isinstance(leg, Hop)] == [Hop((-0.015, -0.015))]
    wall = HeightWorld(lambda u, v: 2e-3 * math.tanh((u - 4e-3) / 2e-4), steep=1.2)
    legs = explore(Active(0.03, 0.03, Goal(length=1.0)), wall)
    hops = [leg for leg in legs if isinstance(leg, Hop)]
    assert len(hops) > 1  # lifted after every stop
    assert all(b[0] != a[0] for a, b in strokes(legs))


def test_time_at_a_speed_is_a_path_length():
    by_time = explore(Active(0.03, 0.03, Goal(time=10.0, speed=0.02)), HeightWorld(bump))
    assert by_time == explore(Active(0.03, 0.03, Goal(length=0.2)), HeightWorld(bump))


def test_a_part_of_the_field_is_less_work_than_all_of_it():
    def way(area):
        active = Active(0.03, 0.03, Goal(area=area, length=5.0))
        explore(active, HeightWorld(bump))
        return active.path_length

    assert way(0.3) < way(0.7) < way(1.0)


@pytest.mark.parametrize("offset", [0.0, 1.1e-3, 2.2e-3])
def test_a_seam_along_the_rows_is_found_and_gets_rows_of_its_own(offset):
    # along a row nothing changes: only what its neighbours predicted reveals the seam
    def seam(u, v):
        return 5e-4 * math.exp(-((v - 1.3e-3 - offset) ** 2) / (2 * 1e-3**2))

    found = strokes(explore(Active(0.03, 0.03, Goal(5e-5, GoalError.LARGEST)), HeightWorld(seam)))
    at = np.array([b[1] for a, b in found if abs(a[0] - b[0]) > 0.02])
    near = at[np.abs(at - 1.3e-3 - offset) < 3e-3]
    assert np.diff(np.sort(near)).max() < 2.2e-3
    assert np.diff(np.sort(at[at < -5e-3])).max() > 3e-3


def test_a_goal_met_later_costs_more():
    def way(error):
        active = Active(0.03, 0.03, Goal(error, GoalError.LARGEST, length=5.0))
        explore(active, HeightWorld(bump))
        return active.path_length

    # greedy: a little more travel for a little less work may happen
    assert way(2e-4) <= 1.1 * way(1e-4)
    assert way(1e-4) < way(2e-5)


def test_goals_and_fields_that_cannot_be_are_refused():
    with pytest.raises(InvalidValueError, match="goal error"):
        Goal(0.0)
    with pytest.raises(InvalidValueError, match="goal area"):
        Goal(area=1.1)
    with pytest.raises(InvalidValueError, match="goal time"):
        Goal(time=0.0)
    with pytest.raises(InvalidValueError, match="goal speed"):
        Goal(speed=math.nan)
    with pytest.raises(InvalidValueError, match="width"):
        Active(-1.0, 0.02)
    assert Active(0.02, 0.02).next(LegResult(LegEnd.LOST, (0.0, 0.0, 0.0))) is None
