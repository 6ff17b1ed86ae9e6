"""Twists on robots that cannot begin to turn at once: as an arm that follows velocities with one acceleration."""

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.controllers.rub_program import FIRST_SHARE, RAMPS, Survey, SurveyWanted
from palpate.controllers.rubs import RAMP, Rub, RubMeasurement
from palpate.errors import InvalidValueError

ACCELERATION = st.floats(0.05, 200.0)
SPIN = st.floats(0.2, 3.0)


def rubs(wanted, rise=0.0, friction=0.5, length=0.003):
    """All that a survey asks for, of a surface that slips at once, or never."""
    survey = Survey(wanted)
    asked, felt = [], None
    while (rub := survey.next(felt)) is not None:
        asked.append(rub)
        felt = RubMeasurement(rub, friction if rub.speed else 0.0, friction * length if rub.spin else 0.0, rise)
    return asked


@given(st.floats(0.1, 1.0), st.floats(0.01, 200.0))
def test_no_twist_asks_for_more_than_the_robot_can_do(share, acceleration):
    wanted = SurveyWanted((1.0,), 0.01, angular_acceleration=acceleration)
    rub = wanted.twist(1.0, share * wanted.fastest_spin)
    times = [i * rub.duration / 400 for i in range(401)]
    speeds = [rub.spin * rub.share(time) for time in times]
    steepest = max(abs(b - a) for a, b in pairwise(speeds)) / (rub.duration / 400)
    assert steepest <= acceleration * (1.0 + 1e-9)
    # it gets there, and stays for a third of the way
    assert max(speeds) == pytest.approx(rub.spin)
    assert sum(speed > 0.999 * rub.spin for speed in speeds) / 401 > 1.0 / RAMPS - 0.01
    # and what it turns in all is what it says
    angle = sum(speeds) * rub.duration / 400
    assert angle == pytest.approx(rub.angle, rel=1e-3)


@given(st.floats(0.3, 3.0), ACCELERATION, st.floats(0.0, 2.0))
def test_a_survey_stays_within_the_angle_and_has_room_to_go_on(most_spin, acceleration, rise):
    wanted = SurveyWanted((1.0, 2.0), 0.01, most_spin=most_spin, angular_acceleration=acceleration)
    twists = [rub for rub in rubs(wanted, rise) if rub.spin]
    assert twists
    for rub in twists:
        assert abs(rub.spin) <= most_spin
        assert rub.angle <= wanted.most_angle * (1.0 + 1e-9)
        assert rub.angular_acceleration == acceleration
    # the first is the shortest of all: at least as far again, if it only gives way
    assert twists[0].angle <= max(FIRST_SHARE * wanted.most_angle, 0.5) * (1.0 + 1e-9) or acceleration > 10.0


@given(SPIN)
def test_a_robot_that_turns_at_once_is_asked_for_what_it_always_was(spin):
    rub = SurveyWanted((1.0,), 0.01).twist(1.0, spin)
    assert rub.ramp == RAMP
    assert rub.duration == min(max(0.5, 0.5 / spin + RAMP), 5.0)
    assert math.isinf(rub.angular_acceleration)


def test_slips_for_the_exponents_keep_to_it_too():
    wanted = SurveyWanted((1.0, 4.0), 0.01, exponent_slips=18, angular_acceleration=4.0)
    mixed = [rub for rub in rubs(wanted) if rub.spin and rub.speed]
    assert mixed
    for rub in mixed:
        assert rub.ramp >= abs(rub.spin) / 4.0 * (1.0 - 1e-12)
        assert rub.duration >= RAMPS * rub.ramp * (1.0 - 1e-12)


def test_a_rub_that_is_over_before_it_turns_is_refused():
    with pytest.raises(InvalidValueError, match="2 rad/s speeds up"):
        Rub(1.0, 0.0, 2.0, 0.5, 5.0)
    with pytest.raises(InvalidValueError, match="angular_acceleration"):
        Rub(1.0, 0.0, 2.0, 0.5, 0.0)
