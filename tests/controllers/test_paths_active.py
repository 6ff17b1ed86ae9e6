"""Active exploration: inside its field, where the detail is; errors between rows follow Hermite interpolation.

Numbers of the error laws here are the laws' own (1/16, 1/8, 1/24, 1/192), not the constants of the code.
"""

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
    TouchNoise,
)
from palpate.controllers.paths.active import reached
from palpate.controllers.paths.felt_rows import FeltRow, missed, missed_around
from palpate.controllers.paths.strips import innovation_error
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


def explored(solid=bump, *goal, **options):
    """An active exploration of 30 mm by 30 mm on a height field, and its legs."""
    active = Active(0.03, 0.03, Goal(*goal, **options))
    return active, explore(active, HeightWorld(solid))


def test_extra_strokes_go_where_the_detail_is():
    """The same surface gives the same legs again; time at a speed is a path length."""
    active, found = explored()
    flat = explored(lambda u, v: 0.0 * u)[1]
    assert all(math.dist(a, b) == pytest.approx(0.03) for a, b in strokes(flat))

    def near(legs):
        way = np.concatenate([np.linspace(a, b, 1 + int(math.dist(a, b) / 1e-4)) for a, b in strokes(legs)])
        return np.mean(np.linalg.norm(way - BUMP, axis=1) < 4e-3)

    assert near(found) > 1.6 * near(flat)
    assert explore(active, HeightWorld(bump)) == explored()[1] == found
    assert explored(time=10.0, speed=0.02)[1] == explored(length=0.2)[1]


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


def test_a_part_of_the_field_and_a_larger_error_are_less_work():
    """Greedy: a little more travel for a little less work may happen."""
    part, most, whole = (explored(area=area, length=5.0)[0].path_length for area in (0.3, 0.7, 1.0))
    assert part < most < whole
    coarse, medium, fine = (
        explored(bump, e, GoalError.LARGEST, length=5.0)[0].path_length for e in (2e-4, 1e-4, 2e-5)
    )
    assert coarse <= 1.1 * medium
    assert medium < fine


def test_the_path_length_and_a_loss_end_it():
    active = Active(0.04, 0.04, Goal(length=0.1))
    explore(active, HeightWorld(bump))
    assert 0.1 <= active.path_length < 0.2
    lost = Active(0.04, 0.04)
    legs = explore(lost, HeightWorld(bump, lost=lambda u, v: v > 0.0))
    assert [mark.event for mark in lost.marks] == [PathEvent.LOST]
    assert all(b[1] <= 0.02 for _, b in strokes(legs))
    assert Active(0.02, 0.02).next(LegResult(LegEnd.LOST, (0.0, 0.0, 0.0))) is None


def test_what_cannot_be_reached_is_marked_and_not_asked_for_again():
    active = Active(0.02, 0.02, Goal(length=3.0))
    legs = explore(active, Fenced(bump, missing=lambda u, v: v > 5e-3))
    assert PathEvent.UNREACHABLE in {mark.event for mark in active.marks}
    tried = [leg.to for leg in legs if isinstance(leg, Hop) and leg.to[1] > 5e-3]
    assert len(tried) == len(set(tried))
    assert any(isinstance(leg, Stroke) for leg in legs)


@pytest.mark.slow
def test_the_tip_slides_from_stroke_to_stroke_but_not_past_what_stopped_it():
    assert [leg for leg in explored()[1] if isinstance(leg, Hop)] == [Hop((-0.015, -0.015))]
    wall = HeightWorld(lambda u, v: 2e-3 * math.tanh((u - 4e-3) / 2e-4), steep=1.2)
    legs = explore(Active(0.03, 0.03, Goal(length=1.0)), wall)
    assert sum(isinstance(leg, Hop) for leg in legs) > 1  # lifted after every stop
    assert all(b[0] != a[0] for a, b in strokes(legs))


@pytest.mark.parametrize("offset", [0.0, 1.1e-3, 2.2e-3])
def test_a_seam_along_the_rows_is_found_and_gets_rows_of_its_own(offset):
    """Along a row nothing changes: only the difference from the prediction of its neighbours reveals the seam."""
    middle = 1.3e-3 + offset
    legs = explored(lambda u, v: 5e-4 * math.exp(-((v - middle) ** 2) / (2 * 1e-3**2)), 5e-5, GoalError.LARGEST)[1]
    at = np.sort([b[1] for a, b in strokes(legs) if abs(a[0] - b[0]) > 0.02])
    assert np.diff(at[np.abs(at - middle) < 3e-3]).max() < 2.2e-3
    assert np.diff(at[at < -5e-3]).max() > 3e-3


QUIET = TouchNoise(height=0.0, slope=0.0)

STRETCH = 2e-4

GAP = 40 * STRETCH

BEND = 3e5  # fourth derivative of heights [1/m^3]: rows 8 mm apart miss 3 um


def row(slope, cross_slope=lambda u: 0.0 * u, half=0.02):
    u = np.linspace(-half, half, round(2 * half / STRETCH) + 1)
    return FeltRow(0.0, u, 0.0 * u, slope(u), cross_slope(u))


def across(v, height, slope, columns=9):
    """Rows at v over all columns: arguments of `innovation_error`."""
    v = np.asarray(v, dtype=np.float64)
    below = np.arange(len(v))[:, None] - 1 + np.zeros((1, columns), np.intp)
    return v, np.repeat(height(v)[:, None], columns, 1), np.repeat(slope(v)[:, None], columns, 1), below


def surprise(v, height, slope, noise=QUIET):
    return innovation_error(*across(v, height, slope), noise, 5e-4)


def zero(v):
    return 0.0 * v


def quartic(v):
    return BEND * v**4 / 24


def quartic_slope(v):
    return BEND * v**3 / 6


# -- along a row --------------------------------------------------------------------------------------------------


def test_a_fourth_derivative_is_missed_as_hermite_interpolation_misses_it():
    """Mid-gap error: fourth derivative times gap^4 / 384. Noise is subtracted as a variance, down to zero."""
    at, bent = np.linspace(-0.01, 0.01, 101), row(quartic_slope)
    for gap in (GAP, 2 * GAP):
        assert missed(bent, gap, at) == pytest.approx(BEND * gap**4 / 384, rel=3e-3)
    error = BEND * GAP**4 / 384
    assert missed_around(bent, GAP, at, 0.36 * error**2) == pytest.approx(0.8 * error, rel=5e-3)
    assert missed_around(bent, GAP, at, 1.01 * error**2) == pytest.approx(0.0, abs=1e-12)
    assert missed_around(bent, 0.05, at, 0.0) == pytest.approx(0.0, abs=1e-12)  # longer than the row
    # the mean cross slope of both ends is off by 7 (gap / 2)^2, and a slope counts gap / 8
    found = missed(row(lambda u: 0.0 * u, lambda u: 7.0 * u**2), GAP, at)
    assert found == pytest.approx(GAP / 8 * 7.0 * (GAP / 2) ** 2, rel=1e-6)


@settings(max_examples=30, deadline=None, derandomize=True)
@given(st.tuples(*[st.floats(-1.0, 1.0)] * 5))
def test_tilt_curvature_and_its_change_hide_nothing_and_add_nothing(terms):
    a, b, c, d, e = terms
    at = np.linspace(-0.01, 0.01, 21)

    def found(share, curve, wave):
        along = row(
            lambda u: share * (a + 5.0 * b * u + curve * c * u**2) + wave * np.sin(900 * u),
            lambda u: share * (d + 5.0 * e * u) + wave * np.cos(700 * u),
        )
        return missed(along, GAP, at)

    assert found(1.0, 200.0, 0.0) == pytest.approx(0.0, abs=1e-12)
    assert found(1.0, 0.0, 0.1) == pytest.approx(found(0.0, 0.0, 0.1), abs=1e-12)


def test_a_row_speaks_only_of_gaps_that_it_spans_but_for_a_stretch_and_a_half():
    straight = row(lambda u: 0.3 + 0.0 * u)
    limit = 0.02 - GAP / 2 + 1.5 * STRETCH
    at = np.array([-limit - 1e-5, -limit + 1e-5, 0.0, limit - 1e-5, limit + 1e-5])
    found = missed(straight, GAP, at)
    assert np.isnan(found).tolist() == [True, False, False, False, True]
    assert found[1:4] == pytest.approx(0.0, abs=1e-12)  # beyond its ends it goes on straight
    assert np.isnan(missed(FeltRow(0.0, *np.zeros((4, 1))), GAP, at)).all()


@pytest.mark.parametrize("stretches", [8, 20, 60])
def test_the_error_of_noise_alone_is_predicted_with_a_little_to_spare(stretches):
    noise, rng, gap = TouchNoise(height=0.0, slope=2e-3), np.random.default_rng(1), stretches * STRETCH
    at, rows = STRETCH * np.arange(-70, 71, 10), noise.slope * rng.normal(size=(600, 2, 201))
    squares = [missed(row(lambda u, s=s: s, lambda u, c=c: c), gap, at) ** 2 for s, c in rows]
    # coefficients of each stretch's slope: half a stretch inside, a quarter less gap / 8 at both ends
    along = (stretches - 2) * STRETCH**2 / 4 + 2 * (STRETCH / 4 - gap / 8) ** 2
    law = noise.slope**2 * (along + 1.5 * (gap / 8) ** 2)
    assert np.mean(squares) / law == pytest.approx(1.0, rel=0.05)
    # taken as if the slopes at the ends were not part of the profile too
    spare = noise.slope**2 * (gap * STRETCH / 8 + 3 * STRETCH**2 / 8)
    assert noise.missed_variance(gap, STRETCH) / (law + spare) == pytest.approx(1.0, rel=1e-9)


def test_a_kink_rings_three_quarters_of_a_gap_to_both_sides():
    kink = row(lambda u: 0.1 * np.sign(u))
    at = STRETCH * np.arange(-60, 61)
    found = missed_around(kink, GAP, at, 0.0)
    # beside a kink of s per side the gap misses s (|x| - gap / 4) up to gap / 2: averaged over a quarter each way
    assert found[60] == pytest.approx(0.1 * GAP / 4 / math.sqrt(3), rel=0.06)
    rings = np.abs(at[found > 1e-9])
    assert rings.max() == pytest.approx(0.75 * GAP, abs=1.5 * STRETCH)
    assert found == pytest.approx(found[::-1], abs=1e-12)


@settings(max_examples=40, deadline=None, derandomize=True)
@given(st.floats(1e-3, 5e-3), st.floats(-0.01, 0.01), st.floats(0.55, 1.8))
def test_uneven_strips_share_a_surprise_by_their_squared_ratio(a, begin, ratio):
    """Equal strips err by twice the Hermite error; an uneven one counts twice the other strip at the most."""
    b = a * ratio

    def error(*gaps):
        v = begin + np.cumsum([0.0, *gaps])
        return surprise(v, lambda v: quartic(v - begin), lambda v: quartic_slope(v - begin))

    left, equal, low, high = error(a, b), error(a, a), error(5 * a, a), error(a, 5 * a)
    # x^2 (x - a - b)^2 times the fourth derivative / 24 and its derivative, a slope counting (a + b) / 8
    off = math.hypot(BEND * (a * b) ** 2 / 24, (a + b) / 8 * BEND * a * b * (b - a) / 12)
    assert left[1] == pytest.approx(off / 8 / ratio**2, rel=1e-5)
    assert left[2] == pytest.approx(off / 8 * ratio**2, rel=1e-5)
    assert equal[0] == pytest.approx(0.0, abs=1e-15)
    assert equal[1:] == pytest.approx(2 * BEND * a**4 / 384, rel=1e-5)
    assert low[1] == pytest.approx(100 * low[2], rel=1e-5)  # 2^2 against (1 / 5)^2
    assert high[2:0:-1] == pytest.approx(low[1:], rel=1e-5)  # mirrored


@settings(max_examples=30, deadline=None, derandomize=True)
@given(st.tuples(*[st.floats(-1.0, 1.0)] * 4), st.tuples(*[st.floats(5e-4, 5e-3)] * 4))
def test_a_cubic_across_has_no_innovation(terms, gaps):
    cubic = np.polynomial.Polynomial([1e-3 * terms[0], terms[1], 20 * terms[2], 1e3 * terms[3]])
    assert surprise(np.cumsum(gaps), cubic, cubic.deriv()) == pytest.approx(0.0, abs=1e-12)


def test_noise_of_three_rows_is_taken_off_and_leaves_no_less_than_nothing():
    """One column's reading is shared with a quarter of the gap to both sides."""
    a, rise = 3e-3, 1e-4
    ridge = [-a, 0.0, a], lambda v: rise * (v == 0.0), zero
    for sd, tilt in ((4e-5, 0.0), (0.0, 0.05), (3e-5, 0.04)):
        rest = rise**2 - 1.5 * (sd**2 + (2 * a / 8 * tilt) ** 2)
        left = surprise(*ridge, TouchNoise(height=sd, slope=tilt))
        assert left[1:] == pytest.approx(math.sqrt(rest) / 8, rel=1e-9)
    assert (surprise(*ridge, TouchNoise(height=rise)) == 0.0).all()
    v, height, slope, below = across([-4e-3, 0.0, 4e-3], zero, zero, columns=41)
    height[1, 20] = rise
    left = innovation_error(v, height, slope, below, QUIET, 5e-4)
    assert np.flatnonzero(left[1]).tolist() == list(range(16, 25))  # a quarter of 8 mm is four columns
    assert left[1, 16:25] == pytest.approx(rise / 3 / 8, rel=1e-9)


@pytest.mark.parametrize(("step", "silent"), [(0.9e-4, True), (1.1e-4, False)])
def test_two_strokes_on_one_line_and_columns_without_three_rows_say_nothing(step, silent):
    for rows in ([0.0, step, 3e-3], [0.0, 3e-3, 3e-3 + step]):
        assert (surprise(rows, lambda v: 1e-4 * np.arange(3) ** 2, zero) == 0.0).all() == silent
    v, height, slope, below = across([-3e-3, 0.0, 3e-3], quartic, quartic_slope)
    below[1, :4] = -1
    left = innovation_error(v, height, slope, below, QUIET, 5e-4)
    assert (left[:, :4] == 0.0).all()
    assert left[1:, 4:] == pytest.approx(2 * BEND * 3e-3**4 / 384, rel=1e-6)  # nor do they dilute the others
    assert (surprise([0.0, 1e-3], quartic, quartic_slope) == 0.0).all()


# -- the end ------------------------------------------------------------------------------------------------------


LENGTHS = [
    (Goal(), math.inf),
    (Goal(length=0.3), 0.3),
    (Goal(time=10.0, speed=0.03), 0.3),
    (Goal(length=0.2, time=10.0, speed=0.03), 0.2),
    (Goal(length=0.4, time=10.0, speed=0.03), 0.3),
]


@pytest.mark.parametrize(("goal", "length"), LENGTHS)
def test_a_goal_ends_at_its_length_or_its_time_whichever_is_less(goal, length):
    assert goal.path_length == pytest.approx(length)


def test_errors_count_as_a_mean_square_or_nearly_as_the_largest():
    """All or nothing of a field may be the goal."""
    assert (Goal(area=0.0).area, Goal(area=1.0).area, GoalError.RMS.value) == (0.0, 1.0, 2.0)
    errors = np.array([1.0] * 9 + [3.0]) ** GoalError.LARGEST.value  # a tenth of the area errs threefold
    assert errors[-1] / errors.sum() == pytest.approx(0.9)
    assert ActiveSettings.suited(GoalError.LARGEST).caution < ActiveSettings.suited(GoalError.RMS).caution


def ends(goal, error, gap=4e-3, field=4e-6, margin=0.5):
    full = np.ones(len(error))
    return reached(goal, margin, np.array(error), gap * full, 1e-6 * full, field=field, prior=6e-3)


BEST_KNOWN, FOUR = [9e-4, 0.0, 9e-4, 0.0], [0.0] * 4

ENDS = {
    "below the margin": (Goal(1e-4, GoalError.LARGEST), [0.0, 0.0, 0.0, 0.99 * 5e-5], {}, True),
    "above the margin": (Goal(1e-4, GoalError.LARGEST), [0.0, 0.0, 0.0, 1.01 * 5e-5], {}, False),
    "below the error": (Goal(1e-4, GoalError.LARGEST), [0.0, 0.0, 0.0, 0.99 * 1e-4], {"margin": 1.0}, True),
    "above the error": (Goal(1e-4, GoalError.LARGEST), [0.0, 0.0, 0.0, 1.01 * 1e-4], {"margin": 1.0}, False),
    # 4 cells, all but one free of error: the mean square is a quarter of the last one's
    "RMS below the margin": (Goal(1e-4, GoalError.RMS), [0.0, 0.0, 0.0, 0.99 * 1e-4], {}, True),
    "RMS above the margin": (Goal(1e-4, GoalError.RMS), [0.0, 0.0, 0.0, 1.01 * 1e-4], {}, False),
    "RMS below the error": (Goal(1e-4, GoalError.RMS), [0.0, 0.0, 0.0, 0.99 * 2e-4], {"margin": 1.0}, True),
    "RMS above the error": (Goal(1e-4, GoalError.RMS), [0.0, 0.0, 0.0, 1.01 * 2e-4], {"margin": 1.0}, False),
    "best known half": (Goal(1e-4, GoalError.LARGEST, area=0.5), BEST_KNOWN, {}, True),
    "more than the known": (Goal(1e-4, GoalError.LARGEST, area=0.9), BEST_KNOWN, {}, False),
    "all of the field": (Goal(1e-4, GoalError.LARGEST), BEST_KNOWN, {}, False),
    "RMS, best known half": (Goal(1e-4, GoalError.RMS, area=0.5), BEST_KNOWN, {}, True),
    "RMS, more than the known": (Goal(1e-4, GoalError.RMS, area=0.9), BEST_KNOWN, {}, False),
    "RMS, all of the field": (Goal(1e-4, GoalError.RMS), BEST_KNOWN, {}, False),
    "widest known strip": (Goal(area=0.5), FOUR, {"gap": 6e-3}, True),
    "wide strip": (Goal(area=0.5), FOUR, {"gap": 6.1e-3}, False),
    "wide strip, all of the field": (Goal(), FOUR, {"gap": 6.1e-3}, False),
    "a third of the field": (Goal(area=0.5), FOUR, {"field": 1.2e-5}, False),
}


@pytest.mark.parametrize("name", ENDS)
def test_a_goal_is_reached_where_its_error_less_a_margin_is_expected(name):
    """A part of the field is its best known part; wide strips are not known."""
    goal, error, options, expected = ENDS[name]
    assert ends(goal, error, **options) == expected
