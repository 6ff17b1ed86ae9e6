"""What a survey asks for stays within what it may: of angle, of spin, of how many slips tell exponents."""

import math
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.controllers.rub_program import Survey, SurveyWanted
from palpate.controllers.rubs import Rub, RubMeasurement
from palpate.errors import InvalidValueError


def asked_of(wanted, e, rise):
    survey = Survey(wanted)
    felt, asked = None, []
    while (rub := survey.next(felt)) is not None:
        asked.append(rub)
        felt = RubMeasurement(rub, 0.5 if rub.speed else 0.0, 0.5 * e if rub.spin else 0.0, rise)
        assert len(asked) < 500
    return asked


@settings(max_examples=60, deadline=None)
@given(
    st.floats(0.05, 3.0),
    st.floats(0.05, 6.0),
    st.floats(5e-4, 1e-2),
    st.sampled_from([0.0, 1.0]),
    st.sampled_from([0, 18]),
)
def test_no_motion_turns_farther_or_faster_than_it_may(most_angle, most_spin, e, rise, exponent_slips):
    wanted = SurveyWanted(
        (1.0, 4.0), 0.01, most_angle=most_angle, most_spin=most_spin, exponent_slips=exponent_slips
    )
    for rub in asked_of(wanted, e, rise):
        assert rub.angle <= most_angle * (1.0 + 1e-9)
        assert abs(rub.spin) <= most_spin * (1.0 + 1e-9)
        assert rub.travel <= wanted.most_travel * (1.0 + 1e-9)


@pytest.mark.parametrize("count", [-1, 1, 5])
def test_too_few_slips_for_exponents_are_refused_before_anything_moves(count):
    with pytest.raises(InvalidValueError, match=f"exponent_slips = {count}"):
        SurveyWanted((1.0, 4.0), 0.01, exponent_slips=count)


@pytest.mark.parametrize("spin", [math.nan, math.inf, -math.inf])
def test_a_rub_of_no_finite_spin_is_refused(spin):
    with pytest.raises(InvalidValueError, match="spin"):
        Rub(1.0, 0.0, spin, 0.5)


@settings(max_examples=40, deadline=None)
@given(st.floats(1e-3, 8e-3), st.sampled_from([(), (0.0025, 0.02)]))
def test_strokes_are_as_fast_as_twists_slip_or_have_that_speed_between_them(e, speeds):
    """mu falls with the speed on many a surface: e goes by mu at the twists' own."""
    asked = asked_of(SurveyWanted((1.0, 2.0, 4.0), 0.01, speeds), e, 0.0)
    strokes = sorted(rub.speed for rub in asked if rub.speed and rub.normal_force == 2.0 and not rub.heading)
    for load in (1.0, 2.0):
        slip = e * next(abs(rub.spin) for rub in asked if rub.spin and rub.normal_force == load)
        near = any(slip / 1.2 <= speed <= 1.021 * slip for speed in strokes)
        between = any(a <= slip <= b <= 2.2 * a for a, b in pairwise(strokes))
        assert near or between
    assert len(strokes) <= 1 + len(speeds) + 2


def test_strokes_go_in_three_directions_and_to_other_places():
    asked = asked_of(SurveyWanted((1.0, 2.0, 4.0), 0.01), 0.003, 0.0)
    aside = [rub for rub in asked if rub.heading]
    assert {round(math.degrees(rub.heading)) for rub in aside} == {60, 120}
    assert all(rub.normal_force == 2.0 and rub.travel > 0.01 for rub in aside)
