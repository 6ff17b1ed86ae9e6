"""What rows say of the strips between them: the error laws of Hermite interpolation, noise, and when to stop.

Numbers here are the laws' own (1/16, 1/8, 1/24, 1/192), not the constants of the code.
"""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.controllers.paths import ActiveSettings, Goal, GoalError, TouchNoise
from palpate.controllers.paths.innovation import innovation_error
from palpate.controllers.paths.missed import missed, missed_around
from palpate.controllers.paths.reached import reached
from palpate.controllers.paths.row import Row
from palpate.errors import InvalidValueError

QUIET = TouchNoise(height=0.0, slope=0.0)
STRETCH = 2e-4
GAP = 40 * STRETCH
BEND = 3e5  # fourth derivative of heights [1/m^3]: rows 8 mm apart miss 3 um


def row(slope, cross_slope=lambda u: 0.0 * u, half=0.02):
    u = np.linspace(-half, half, round(2 * half / STRETCH) + 1)
    return Row(0.0, u, 0.0 * u, slope(u), cross_slope(u))


def across(v, height, slope, columns=9):
    """Rows at v over all columns: what `innovation_error` takes."""
    v = np.asarray(v, dtype=np.float64)
    below = np.arange(len(v))[:, None] - 1 + np.zeros((1, columns), np.intp)
    return v, np.repeat(height(v)[:, None], columns, 1), np.repeat(slope(v)[:, None], columns, 1), below


def quartic(v):
    return BEND * v**4 / 24


def quartic_slope(v):
    return BEND * v**3 / 6


# -- along a row --------------------------------------------------------------------------------------------------


def test_a_fourth_derivative_is_missed_as_hermite_interpolation_misses_it():
    at = np.linspace(-0.01, 0.01, 41)
    for gap in (GAP, 2 * GAP):
        # in the middle of a gap: f'''' gap^4 / 384
        assert missed(row(quartic_slope), gap, at) == pytest.approx(BEND * gap**4 / 384, rel=3e-3)


def test_a_bent_cross_slope_is_missed_as_an_end_slope_counts():
    at = np.linspace(-0.01, 0.01, 41)
    found = missed(row(lambda u: 0.0 * u, lambda u: 7.0 * u**2), GAP, at)
    # the mean of both ends is off by 7 (gap / 2)^2, and a slope counts gap / 8
    assert found == pytest.approx(GAP / 8 * 7.0 * (GAP / 2) ** 2, rel=1e-6)


@settings(max_examples=30, deadline=None, derandomize=True)
@given(st.tuples(*[st.floats(-1.0, 1.0)] * 5))
def test_tilt_curvature_and_its_change_hide_nothing_and_add_nothing(terms):
    a, b, c, d, e = terms
    at = np.linspace(-0.01, 0.01, 21)
    smooth = row(lambda u: a + 5.0 * b * u + 200.0 * c * u**2, lambda u: d + 5.0 * e * u)
    assert missed(smooth, GAP, at) == pytest.approx(0.0, abs=1e-12)
    wave = row(lambda u: 0.1 * np.sin(900 * u), lambda u: 0.1 * np.cos(700 * u))
    both = row(
        lambda u: a + 5.0 * b * u + 0.1 * np.sin(900 * u), lambda u: d + 5.0 * e * u + 0.1 * np.cos(700 * u)
    )
    assert missed(both, GAP, at) == pytest.approx(missed(wave, GAP, at), abs=1e-12)


def test_a_row_speaks_only_of_gaps_that_it_spans_but_for_a_stretch_and_a_half():
    straight = row(lambda u: 0.3 + 0.0 * u)
    limit = 0.02 - GAP / 2 + 1.5 * STRETCH
    at = np.array([-limit - 1e-5, -limit + 1e-5, 0.0, limit - 1e-5, limit + 1e-5])
    found = missed(straight, GAP, at)
    assert np.isnan(found).tolist() == [True, False, False, False, True]
    assert found[1:4] == pytest.approx(0.0, abs=1e-12)  # beyond its ends it goes on straight
    assert np.isnan(missed(Row(0.0, *np.zeros((4, 1))), GAP, at)).all()


def test_what_noise_alone_misses_is_foreseen_with_a_little_to_spare():
    noise, rng = TouchNoise(height=0.0, slope=2e-3), np.random.default_rng(1)
    at = STRETCH * np.arange(-70, 71, 10)
    for gap in (8 * STRETCH, 20 * STRETCH, 60 * STRETCH):
        squares = []
        for _ in range(600):
            slope, cross = noise.slope * rng.normal(size=(2, 201))
            squares.append(missed(row(lambda u, s=slope: s, lambda u, s=cross: s), gap, at) ** 2)
        # coefficients of each stretch's slope: half a stretch inside, a quarter less gap / 8 at both ends
        along = (gap / STRETCH - 2) * STRETCH**2 / 4 + 2 * (STRETCH / 4 - gap / 8) ** 2
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


def test_noise_is_taken_off_as_a_variance_and_leaves_no_less_than_nothing():
    at = np.linspace(-0.01, 0.01, 101)
    error = BEND * GAP**4 / 384
    bent = row(quartic_slope)
    assert missed_around(bent, GAP, at, 0.36 * error**2) == pytest.approx(0.8 * error, rel=5e-3)
    assert missed_around(bent, GAP, at, 1.01 * error**2) == pytest.approx(0.0, abs=1e-12)
    assert missed_around(bent, 0.05, at, 0.0) == pytest.approx(0.0, abs=1e-12)  # longer than the row


# -- across rows --------------------------------------------------------------------------------------------------


def test_equal_strips_are_expected_to_err_twice_what_hermite_interpolation_would():
    a = 3e-3
    left = innovation_error(*across([-a, 0.0, a], quartic, quartic_slope), QUIET, 5e-4)
    assert left[0] == pytest.approx(0.0, abs=1e-15)
    assert left[1:] == pytest.approx(2 * BEND * a**4 / 384, rel=1e-6)


@settings(max_examples=40, deadline=None, derandomize=True)
@given(st.floats(1e-3, 5e-3), st.floats(-0.01, 0.01), st.floats(0.55, 1.8))
def test_uneven_strips_share_a_surprise_by_their_squared_ratio(a, begin, ratio):
    b = a * ratio
    v = begin + np.array([0.0, a, a + b])

    def height(v):
        return quartic(v - begin)

    def slope(v):
        return quartic_slope(v - begin)

    left = innovation_error(*across(v, height, slope), QUIET, 5e-4)
    # x^2 (x - a - b)^2 f'''' / 24 and its derivative, a slope counting (a + b) / 8
    off = math.hypot(BEND * (a * b) ** 2 / 24, (a + b) / 8 * BEND * a * b * (b - a) / 12)
    assert left[1] == pytest.approx(off / 8 / ratio**2, rel=1e-5)
    assert left[2] == pytest.approx(off / 8 * ratio**2, rel=1e-5)


def test_a_very_uneven_strip_counts_no_more_than_twice_the_other_strip():
    step = 1e-3
    low = innovation_error(*across([0.0, 5 * step, 6 * step], quartic, quartic_slope), QUIET, 5e-4)
    high = innovation_error(*across([-6 * step, -5 * step, 0.0], quartic, quartic_slope), QUIET, 5e-4)
    assert low[1] == pytest.approx(100 * low[2], rel=1e-6)  # 2^2 against (1 / 5)^2
    assert high[2] == pytest.approx(low[1], rel=1e-6)  # mirrored: the strips change places
    assert high[1] == pytest.approx(low[2], rel=1e-6)


@settings(max_examples=30, deadline=None, derandomize=True)
@given(st.tuples(*[st.floats(-1.0, 1.0)] * 4), st.tuples(*[st.floats(5e-4, 5e-3)] * 4))
def test_a_cubic_across_surprises_nobody(terms, gaps):
    cubic = np.polynomial.Polynomial([1e-3 * terms[0], terms[1], 20 * terms[2], 1e3 * terms[3]])
    v = np.cumsum(gaps)
    assert innovation_error(*across(v, cubic, cubic.deriv()), QUIET, 5e-4) == pytest.approx(0.0, abs=1e-12)


def test_noise_of_three_rows_is_taken_off_and_leaves_no_less_than_nothing():
    a, rise = 3e-3, 1e-4
    v, height, slope, below = across([-a, 0.0, a], lambda v: rise * (v == 0.0), lambda v: 0.0 * v)
    for sd, tilt in ((4e-5, 0.0), (0.0, 0.05), (3e-5, 0.04)):
        left = innovation_error(v, height, slope, below, TouchNoise(height=sd, slope=tilt), 5e-4)
        rest = rise**2 - 1.5 * (sd**2 + (2 * a / 8 * tilt) ** 2)
        assert left[1:] == pytest.approx(math.sqrt(rest) / 8, rel=1e-9)
    assert (innovation_error(v, height, slope, below, TouchNoise(height=rise), 5e-4) == 0.0).all()


def test_what_one_column_feels_is_shared_with_a_quarter_of_the_gap_to_both_sides():
    a, width, rise = 4e-3, 5e-4, 1e-4
    v, height, slope, below = across([-a, 0.0, a], lambda v: 0.0 * v, lambda v: 0.0 * v, columns=41)
    height[1, 20] = rise
    left = innovation_error(v, height, slope, below, QUIET, width)
    assert np.flatnonzero(left[1]).tolist() == list(range(16, 25))  # a quarter of 8 mm is four columns
    assert left[1, 16:25] == pytest.approx(rise / 3 / 8, rel=1e-9)


def test_two_strokes_on_one_line_and_columns_without_three_rows_say_nothing():
    for step, silent in ((0.9e-4, True), (1.1e-4, False)):
        for v in ([0.0, step, 3e-3], [0.0, 3e-3, 3e-3 + step]):
            found = innovation_error(
                *across(v, lambda v: 1e-4 * np.arange(3) ** 2, lambda v: 0.0 * v), QUIET, 5e-4
            )
            assert (found == 0.0).all() == silent
    v, height, slope, below = across([-3e-3, 0.0, 3e-3], quartic, quartic_slope)
    below[1, :4] = -1
    left = innovation_error(v, height, slope, below, QUIET, 5e-4)
    assert (left[:, :4] == 0.0).all()
    assert left[1:, 4:] == pytest.approx(2 * BEND * 3e-3**4 / 384, rel=1e-6)  # nor do they dilute the others
    assert (innovation_error(*across([0.0, 1e-3], quartic, quartic_slope), QUIET, 5e-4) == 0.0).all()


# -- the end ------------------------------------------------------------------------------------------------------


def test_a_goal_ends_at_its_length_or_its_time_whichever_is_less():
    assert Goal().path_length == math.inf
    assert Goal(length=0.3).path_length == 0.3
    assert Goal(time=10.0, speed=0.03).path_length == pytest.approx(0.3)
    assert Goal(length=0.2, time=10.0, speed=0.03).path_length == 0.2
    assert Goal(length=0.4, time=10.0, speed=0.03).path_length == pytest.approx(0.3)


def test_errors_count_as_a_mean_square_or_nearly_as_the_largest():
    assert GoalError.RMS.value == 2.0
    errors = np.array([1.0] * 9 + [3.0])  # a tenth of the area errs threefold
    share = 3.0**GoalError.LARGEST.value / (errors**GoalError.LARGEST.value).sum()
    assert share == pytest.approx(0.9)
    assert ActiveSettings.suited(GoalError.LARGEST).caution < ActiveSettings.suited(GoalError.RMS).caution


def test_all_or_nothing_of_a_field_may_be_wanted_and_no_more():
    assert Goal(area=0.0).area == 0.0
    assert Goal(area=1.0).area == 1.0
    for fields in ({"area": -1e-9}, {"area": 1 + 1e-9}, {"area": math.nan}, {"error": math.inf}, {"error": -1e-5}):
        with pytest.raises(InvalidValueError, match=next(iter(fields))):
            Goal(**fields)
    for fields in ({"length": 0.0}, {"time": -1.0}, {"speed": math.inf}):
        with pytest.raises(InvalidValueError, match=next(iter(fields))):
            Goal(**fields)


def ends(goal, error, gap=4e-3, area=1e-6, field=4e-6, margin=0.5):
    error = np.asarray(error, dtype=np.float64)
    full = np.ones_like(error)
    return reached(goal, margin, error, gap * full, area * full, field=field, prior=6e-3)


@pytest.mark.parametrize(("measure", "last"), [(GoalError.LARGEST, 1.0), (GoalError.RMS, 2.0)])
def test_a_goal_is_reached_where_its_error_less_a_margin_is_expected(measure, last):
    # 4 cells, all but one free of error: the mean square is a quarter of the last one's
    goal = Goal(1e-4, measure)
    assert ends(goal, [0.0, 0.0, 0.0, 0.99 * last * 5e-5])
    assert not ends(goal, [0.0, 0.0, 0.0, 1.01 * last * 5e-5])
    assert ends(goal, [0.0, 0.0, 0.0, 0.99 * last * 1e-4], margin=1.0)
    assert not ends(goal, [0.0, 0.0, 0.0, 1.01 * last * 1e-4], margin=1.0)


def test_a_part_of_the_field_is_the_best_known_part_and_wide_strips_are_not_known():
    errors = [9e-4, 0.0, 9e-4, 0.0]
    for measure in GoalError:
        assert ends(Goal(1e-4, measure, area=0.5), errors)
        assert not ends(Goal(1e-4, measure, area=0.9), errors)
        assert not ends(Goal(1e-4, measure), errors)
    assert ends(Goal(area=0.5), np.zeros(4), gap=6e-3)
    assert not ends(Goal(area=0.5), np.zeros(4), gap=6.1e-3)
    assert not ends(Goal(), np.zeros(4), gap=6.1e-3)
    assert not ends(Goal(area=0.5), np.zeros(4), field=1.2e-5)  # what was felt is a third of the field
