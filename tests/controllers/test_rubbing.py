"""Rubbing on a made-up plane: motions, a run with its losses, the survey and its limits."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.controllers.rub_program import FIRST_SHARE, MIN_DURATION, RAMPS, Survey, SurveyWanted
from palpate.controllers.rubbing import RubbingController
from palpate.controllers.rubs import RAMP, Rub, RubMeasurement
from palpate.runtime.data import Phase
from support.rubbed_plane import PERIOD, WANTED, RubbedPlane, rub

SLIDE, TURN = Rub(2.0, 0.02, 0.0, 0.3), Rub(2.0, 0.0, 2.0, 0.3)


class Listed:
    """A program of listed rubs that keeps the measurements."""

    def __init__(self, *rubs):
        self.rubs = rubs

    def start(self):
        self.left, self.felt = list(self.rubs), []

    def next(self, felt):
        self.felt += [felt] if felt is not None else []
        return self.left.pop(0) if self.left else None


def rubbed(plane, *rubs, parameters=WANTED, **when):
    """The controller, its rows, and the measurements of its program."""
    program = Listed(*rubs)
    controller = RubbingController(parameters, program, PERIOD)
    return controller, rub(plane, controller, **when), program


# --- motions ---


@settings(deadline=None, max_examples=50)
@given(st.floats(1e-3, 0.1), st.floats(0.5, 4.0), st.floats(-2.0, 2.0))
def test_a_motion_begins_and_ends_at_rest_and_goes_as_far_as_it_says(speed, duration, spin):
    motion = Rub(1.0, speed, spin, duration)
    time = np.linspace(0.0, duration, 4001)
    share = np.array([motion.share(t) for t in time])
    assert share[0] == share[-1] == 0.0
    assert share.max() == 1.0
    way = float(np.sum(0.5 * (share[1:] + share[:-1]) * np.diff(time)))
    assert speed * way == pytest.approx(motion.travel, rel=1e-3)
    assert abs(spin) * way == pytest.approx(motion.angle, rel=1e-3)


THERE_AND_BACK = [(SLIDE, False), (SLIDE, True), (TURN, False), (TURN, True)]


@pytest.mark.slow
@pytest.mark.parametrize("tilt", [0.0, 0.3])
def test_it_waits_in_free_air_lands_rubs_lifts_off_and_waits_again(tilt):
    """The motion back reverses the motion there and ends where it began."""
    plane = RubbedPlane(tilt=tilt)
    controller, rows, _ = rubbed(plane, SLIDE, TURN)
    between, spans = [Phase.SETTLE, Phase.SCAN] * 4, controller.spans
    assert rows.phases == [Phase.HOLD, Phase.APPROACH, *between, Phase.LIFT, Phase.HOLD, Phase.DONE]
    assert [(span.rub, span.back) for span in spans] == THERE_AND_BACK
    before, after = controller.air
    assert before.end - before.begin == pytest.approx(WANTED.tare_time, abs=2 * PERIOD)
    assert after.begin > spans[-1].end
    assert max(rows.force[: round(before.end / PERIOD)] + rows.force[round(after.begin / PERIOD) :]) == 0.0
    along = rows.velocity - np.outer(rows.velocity @ plane.out, plane.out)
    first, second = (along[round((s.begin + WANTED.pause) / PERIOD) : round(s.end / PERIOD)] for s in spans[:2])
    n = min(len(first), len(second))
    assert first[:n] == pytest.approx(-second[:n], abs=5e-4)
    assert np.linalg.norm(first, axis=1).max() == pytest.approx(SLIDE.speed, rel=0.01)
    both = slice(round(spans[0].begin / PERIOD), round(spans[1].end / PERIOD))
    assert np.linalg.norm(PERIOD * along[both].sum(axis=0)) < 0.1e-3


@pytest.mark.slow
@pytest.mark.parametrize(("tilt", "center"), [(0.0, (0.0, 0.0, 0.0)), (0.3, (0.006, -0.004, -0.01))])
def test_a_twist_turns_about_the_normal_and_leaves_the_contact_in_place(tilt, center):
    """However far from the tip frame's origin it lies: 7 mm beside it would slide at 14 mm/s."""
    plane = RubbedPlane(tilt=tilt, center=center)
    _, rows, _ = rubbed(plane, TURN)
    turn = rows.turn
    about, contact = turn @ -plane.out, rows.velocity + np.cross(turn, rows.lever)
    aside = np.linalg.norm(turn - np.outer(about, -plane.out), axis=1)
    assert (aside <= 1e-3 * np.linalg.norm(turn, axis=1) + 1e-9).all()
    sliding = np.linalg.norm(contact - np.outer(contact @ plane.out, plane.out), axis=1)
    assert sliding[turn.any(axis=1)].max() < 2e-4
    assert about.max() == pytest.approx(TURN.spin, rel=1e-3)


def test_loads_are_reached_before_the_finger_moves_and_kept_while_it_does():
    """Commands change no faster than the slew allows."""
    light, heavy = replace(SLIDE, normal_force=1.0), replace(SLIDE, normal_force=3.0)
    controller, rows, _ = rubbed(RubbedPlane(), light, heavy, replace(TURN, normal_force=1.0))
    for span in controller.spans:
        inside = rows.force[round(span.begin / PERIOD) : round(span.end / PERIOD)]
        assert np.array(inside) == pytest.approx(span.rub.normal_force, rel=0.05)
    for command, slew in ((rows.velocity, WANTED.slew), (rows.turn, 125.0)):
        assert np.linalg.norm(np.diff(command, axis=0), axis=1).max() <= slew * PERIOD * (1 + 1e-9)


@pytest.mark.slow
@settings(deadline=None, max_examples=4)
@given(st.floats(0.1, 1.2), st.floats(1e-3, 8e-3), st.floats(-0.3, 0.3))
def test_what_is_felt_is_what_the_plane_bears_however_it_lies(friction, spin_length, tilt):
    slid, turned = rubbed(RubbedPlane(friction, spin_length, tilt=tilt), SLIDE, TURN)[2].felt
    assert slid.friction == pytest.approx(friction, rel=0.02)
    assert turned.torque_ratio == pytest.approx(friction * spin_length, rel=0.05)
    assert abs(slid.rise) < 0.05
    assert abs(turned.rise) < 0.15


def test_a_surface_that_is_not_there_is_looked_for_only_so_far():
    """A contact that only yields rises to the end."""
    near = replace(WANTED, approach_distance=0.005)
    _, rows, _ = rubbed(RubbedPlane(), SLIDE, vanish=0.0, parameters=near)
    way = PERIOD * sum(np.linalg.norm(c.velocity_base_tip) for c in rows.command)
    assert rows.phases == [Phase.HOLD, Phase.APPROACH, Phase.LOST]
    assert way == pytest.approx(near.approach_distance, rel=0.05)
    assert rubbed(RubbedPlane(friction=50.0, skin=60.0), SLIDE)[2].felt[0].rise > 0.5


def test_contact_that_is_lost_once_is_sought_and_the_rub_done_again():
    """A contact that is lost for good ends the run at rest."""
    controller, rows, _ = rubbed(RubbedPlane(), SLIDE, TURN, vanish=1.15, back=1.3)
    assert Phase.SEEK in rows.phases
    assert rows.phase[-1] is Phase.DONE
    assert controller.lost == 1
    assert [(span.rub, span.back) for span in controller.spans] == THERE_AND_BACK
    controller, rows, _ = rubbed(RubbedPlane(), SLIDE, TURN, vanish=1.15)
    assert rows.phase[-1] is Phase.LOST
    assert not rows.velocity[-1].any()
    assert not rows.turn[-1].any()
    assert len(controller.spans) % 2 == 0 or not controller.spans[-1].back


@pytest.mark.slow
@pytest.mark.parametrize("tilt", [0.0, 0.02])
def test_strokes_straight_into_the_surface_lead_along_it_there_and_back(tilt):
    """No controller may raise in mid-run; friction is that of any other way."""
    into = replace(WANTED, along=(0.0, 0.0, 1.0))
    controller, rows, program = rubbed(RubbedPlane(tilt=tilt), SLIDE, parameters=into)
    assert rows.phase[-1] is Phase.DONE
    assert len(controller.spans) == 2
    assert program.felt[0].friction == pytest.approx(0.5, rel=0.02)


# --- the survey ---

SURVEY = SurveyWanted((1.0, 4.0), 0.01, (0.005, 0.02), most_travel=0.025)


def answered(wanted, mu=0.5, e=0.003, rise=lambda rub: 0.0):
    """All rubs of a survey of a surface that answers so, and the survey."""
    survey, asked, felt = Survey(wanted), [], None
    survey.start()
    while (motion := survey.next(felt)) is not None:
        asked.append(motion)
        felt = RubMeasurement(motion, mu if motion.speed else 0.0, mu * e if motion.spin else 0.0, rise(motion))
        assert len(asked) < 200
    return asked, survey


def complete(survey):
    """Whether all parts of the surface were measured."""
    return survey.stuck_sliding == survey.stuck_turning == [] and survey.exponents_measured


def test_a_survey_rubs_and_turns_in_both_directions_at_every_load_and_every_speed_at_one():
    """Strokes lead in three directions and to other places; a tip that cannot turn never has to."""
    asked, survey = answered(SURVEY)
    assert complete(survey)
    strokes = {(r.normal_force, r.speed) for r in asked if not r.spin}
    assert strokes == {(1.0, 0.01), (4.0, 0.005), (4.0, 0.01), (4.0, 0.02)}
    for load in SURVEY.loads:
        spins = [r.spin for r in asked if r.normal_force == load and not r.speed]
        assert (len(spins), sum(spins)) == (2, 0.0)
    assert all(r.duration >= MIN_DURATION and (r.speed == 0.0 or r.travel >= 0.999 * SURVEY.travel) for r in asked)
    aside = [r for r in answered(SurveyWanted((1.0, 2.0, 4.0), 0.01))[0] if r.heading]
    assert {round(math.degrees(r.heading)) for r in aside} == {60, 120}
    assert all(r.normal_force == 2.0 and r.travel > 0.01 for r in aside)
    assert not any(r.spin for r in answered(replace(SURVEY, most_spin=0.0))[0])
    assert math.isfinite(SURVEY.expected_duration)


@pytest.mark.parametrize("slips_from", [0.008, math.inf], ids=["slips late", "elastic"])
def test_an_elastic_contact_is_rubbed_farther_each_time_and_given_up_at_the_most(slips_from):
    """A contact that slips late is rubbed just far enough."""
    late = math.isfinite(slips_from)
    asked, survey = answered(SURVEY, rise=lambda r: float(r.travel < slips_from) if r.speed else float(not late))
    ways = [r.travel for r in asked if r.normal_force == 1.0 and r.speed]
    assert ways == sorted(ways)
    if late:
        assert ways[-2] < 0.008 <= ways[-1] < 0.017
        assert complete(survey)
    else:
        assert ways[-1] == pytest.approx(SURVEY.most_travel)
        angles = [r.angle for r in asked if r.normal_force == 1.0 and r.spin]
        assert max(angles) == pytest.approx(SURVEY.most_angle)
        assert survey.stuck_sliding == survey.stuck_turning == [1.0, 4.0]


def test_exponents_take_slips_of_both_kinds_at_once_and_known_e_at_both_loads():
    """They keep to the angular acceleration too."""
    asked, survey = answered(replace(SURVEY, exponent_slips=18, angular_acceleration=4.0))
    mixed = [r for r in asked if r.speed and r.spin]
    assert complete(survey)
    assert {r.normal_force for r in mixed} == {1.0, 4.0}
    assert {0.4, 2.5} <= {round(r.speed / (0.003 * r.spin), 2) for r in mixed}
    assert all(r.ramp >= abs(r.spin) / 4.0 * (1.0 - 1e-12) for r in mixed)
    assert all(r.duration >= RAMPS * r.ramp * (1.0 - 1e-12) for r in mixed)
    _, stuck = answered(replace(SURVEY, exponent_slips=18), rise=lambda rub: 1.0 if rub.spin else 0.0)
    assert not stuck.exponents_measured


@settings(max_examples=60, deadline=None)
@given(
    st.floats(0.05, 3.0),
    st.floats(0.05, 6.0),
    st.floats(5e-4, 1e-2),
    st.floats(0.0, 2.0),
    st.sampled_from([0, 18]),
    st.floats(0.05, 200.0),
)
def test_no_motion_turns_farther_or_faster_than_it_may(angle, spin, e, rise, slips, acceleration):
    wanted = SurveyWanted((1.0, 4.0), 0.01, most_angle=angle, most_spin=spin, exponent_slips=slips)
    for r in answered(wanted, e=e, rise=lambda rub: rise)[0]:
        assert r.angle <= angle * (1.0 + 1e-9)
        assert abs(r.spin) <= spin * (1.0 + 1e-9)
        assert r.travel <= wanted.most_travel * (1.0 + 1e-9)
    limited = SurveyWanted((1.0, 2.0), 0.01, most_spin=max(spin, 0.3), angular_acceleration=acceleration)
    twists = [r for r in answered(limited, rise=lambda rub: rise)[0] if r.spin]
    assert all(r.angular_acceleration == acceleration for r in twists)
    assert all(r.angle <= limited.most_angle * (1.0 + 1e-9) for r in twists)
    # the first is the shortest of all: at least as far again, if it only gives way
    assert twists[0].angle <= max(FIRST_SHARE * limited.most_angle, 0.5) * (1.0 + 1e-9) or acceleration > 10.0


@settings(deadline=None, max_examples=40)
@given(st.floats(1e-3, 8e-3), st.sampled_from([(), (0.0025, 0.02)]), st.floats(0.002, 0.05))
def test_strokes_are_as_fast_as_twists_slip_or_have_that_speed_between_them(e, speeds, speed):
    """mu falls with the speed on many a surface: e depends on mu at the twists' own speed.

    Twists slip about as fast as strokes once e is known.
    """
    asked, _ = answered(SurveyWanted((1.0, 2.0, 4.0), 0.01, speeds), e=e)
    strokes = sorted(rub.speed for rub in asked if rub.speed and rub.normal_force == 2.0 and not rub.heading)
    for load in (1.0, 2.0):
        slip = e * next(abs(rub.spin) for rub in asked if rub.spin and rub.normal_force == load)
        near = any(slip / 1.2 <= speed <= 1.021 * slip for speed in strokes)
        assert near or any(a <= slip <= b <= 2.2 * a for a, b in pairwise(strokes))
    assert len(strokes) <= 1 + len(speeds) + 2
    asked, _ = answered(replace(SURVEY, speed=speed, speeds=()), e=e)
    last = [abs(r.spin) for r in asked if r.normal_force == 4.0 and r.spin]
    assert last[-1] == pytest.approx(min(SURVEY.most_spin, max(0.2, speed / e)))


@given(st.floats(0.1, 1.0), st.floats(0.01, 200.0), st.floats(0.2, 3.0))
def test_no_twist_asks_for_more_than_the_robot_can_do(share, acceleration, spin):
    """The twist reaches its speed, keeps it for a third of the time, and turns by its angle."""
    wanted = SurveyWanted((1.0,), 0.01, angular_acceleration=acceleration)
    rub = wanted.twist(1.0, share * wanted.fastest_spin)
    speeds = [rub.spin * rub.share(i * rub.duration / 400) for i in range(401)]
    steepest = max(abs(b - a) for a, b in pairwise(speeds)) / (rub.duration / 400)
    assert steepest <= acceleration * (1.0 + 1e-9)
    assert max(speeds) == pytest.approx(rub.spin)
    assert sum(speed > 0.999 * rub.spin for speed in speeds) / 401 > 1.0 / RAMPS - 0.01
    assert sum(speeds) * rub.duration / 400 == pytest.approx(rub.angle, rel=1e-3)
    at_once = SurveyWanted((1.0,), 0.01).twist(1.0, spin)
    assert (at_once.ramp, at_once.angular_acceleration) == (RAMP, math.inf)
    assert at_once.duration == min(max(0.5, 0.5 / spin + RAMP), 5.0)
