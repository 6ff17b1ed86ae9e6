"""Rubbing: what the finger does, on a made-up plane, and what a program makes of it."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.controllers.rub_program import MIN_DURATION, Survey, SurveyWanted
from palpate.controllers.rubbing import RubbingController
from palpate.controllers.rubs import Rub, RubMeasurement
from palpate.errors import InvalidValueError
from palpate.runtime.data import Phase
from support.rubbed_plane import GAIN, PERIOD, WANTED, RubbedPlane, rub

SLIDE, TURN = Rub(2.0, 0.02, 0.0, 0.3), Rub(2.0, 0.0, 2.0, 0.3)


class Listed:
    """A program that asks for what stands in a list, and keeps what was felt."""

    def __init__(self, *rubs):
        self.rubs = rubs

    def start(self):
        self.left, self.felt = list(self.rubs), []

    def next(self, felt):
        if felt is not None:
            self.felt.append(felt)
        return self.left.pop(0) if self.left else None


def rubbed(plane, *rubs, parameters=WANTED, **when):
    controller = RubbingController(parameters, Listed(*rubs), PERIOD)
    return controller, rub(plane, controller, **when)


def felt(controller):
    assert isinstance(controller.program, Listed)
    return controller.program.felt


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


def test_a_rub_that_does_not_move_or_has_no_time_is_refused():
    with pytest.raises(InvalidValueError, match="must slide or turn"):
        Rub(1.0, 0.0, 0.0, 0.5)
    with pytest.raises(InvalidValueError, match=r"duration = 0.05 s: must be more than 0.08 s"):
        Rub(1.0, 0.01, 0.0, 0.05)


# --- a run ---


@pytest.mark.slow
@pytest.mark.parametrize("tilt", [0.0, 0.3])
def test_it_waits_in_free_air_lands_rubs_lifts_off_and_waits_again(tilt):
    controller, rows = rubbed(RubbedPlane(tilt=tilt), SLIDE, TURN)
    between = [Phase.SETTLE, Phase.SCAN] * 4
    assert rows.phases == [Phase.HOLD, Phase.APPROACH, *between, Phase.LIFT, Phase.HOLD, Phase.DONE]
    assert [(span.rub, span.back) for span in controller.spans] == [
        (SLIDE, False),
        (SLIDE, True),
        (TURN, False),
        (TURN, True),
    ]
    before, after = controller.air
    assert before.end - before.begin == pytest.approx(WANTED.tare_time, abs=2 * PERIOD)
    assert after.begin > controller.spans[-1].end
    assert max(rows.force[: round(before.end / PERIOD)]) == 0.0
    assert max(rows.force[round(after.begin / PERIOD) :]) == 0.0


@pytest.mark.parametrize("tilt", [0.0, 0.3])
def test_the_motion_back_reverses_the_motion_there_and_ends_where_it_began(tilt):
    plane = RubbedPlane(tilt=tilt)
    controller, rows = rubbed(plane, SLIDE)
    there, back = controller.spans
    at = np.array([command.velocity_base_tip for command in rows.command])
    along = at - np.outer(at @ plane.out, plane.out)
    first, second = (
        along[round((span.begin + WANTED.pause) / PERIOD) : round(span.end / PERIOD)] for span in (there, back)
    )
    n = min(len(first), len(second))
    assert first[:n] == pytest.approx(-second[:n], abs=5e-4)
    assert np.linalg.norm(first, axis=1).max() == pytest.approx(SLIDE.speed, rel=0.01)
    rubbing = slice(round(there.begin / PERIOD), round(back.end / PERIOD))
    assert np.linalg.norm(PERIOD * along[rubbing].sum(axis=0)) < 0.1e-3


@pytest.mark.slow
@pytest.mark.parametrize("tilt", [0.0, 0.3])
@pytest.mark.parametrize("center", [(0.0, 0.0, 0.0), (0.006, -0.004, -0.01)])
def test_a_twist_turns_about_the_normal_and_leaves_the_contact_in_place(tilt, center):
    """However far from the tip frame's origin it lies: 7 mm beside it would slide at 14 mm/s."""
    plane = RubbedPlane(tilt=tilt, center=center)
    _, rows = rubbed(plane, TURN)
    n = -plane.out
    turned = 0.0
    for command, lever in zip(rows.command, rows.lever, strict=True):
        turn, velocity = np.array(command.angular_velocity_base_tip), np.array(command.velocity_base_tip)
        assert np.linalg.norm(turn - (turn @ n) * n) <= 1e-3 * np.linalg.norm(turn) + 1e-9
        if np.any(turn):
            contact = velocity + np.cross(turn, lever)
            assert np.linalg.norm(contact - (contact @ n) * n) < 2e-4
        turned = max(turned, float(turn @ n))
    assert turned == pytest.approx(TURN.spin, rel=1e-3)


def test_loads_are_reached_before_the_finger_moves_and_kept_while_it_does():
    light, heavy = replace(SLIDE, normal_force=1.0), replace(SLIDE, normal_force=3.0)
    controller, rows = rubbed(RubbedPlane(), light, heavy, replace(TURN, normal_force=1.0))
    for span in controller.spans:
        inside = rows.force[round(span.begin / PERIOD) : round(span.end / PERIOD)]
        assert np.array(inside) == pytest.approx(span.rub.normal_force, rel=0.05)


def test_commands_change_no_faster_than_the_slew_allows():
    _, rows = rubbed(RubbedPlane(), SLIDE, TURN)
    velocity = np.array([command.velocity_base_tip for command in rows.command])
    turn = np.array([command.angular_velocity_base_tip for command in rows.command])
    assert np.linalg.norm(np.diff(velocity, axis=0), axis=1).max() <= WANTED.slew * PERIOD * (1 + 1e-9)
    assert np.linalg.norm(np.diff(turn, axis=0), axis=1).max() <= 125.0 * PERIOD * (1 + 1e-9)


@pytest.mark.slow
@settings(deadline=None, max_examples=4)
@given(st.floats(0.1, 1.2), st.floats(1e-3, 8e-3), st.floats(-0.3, 0.3))
def test_what_is_felt_is_what_the_plane_bears_however_it_lies(friction, spin_length, tilt):
    controller, _ = rubbed(RubbedPlane(friction, spin_length, tilt=tilt), SLIDE, TURN)
    slid, turned = felt(controller)
    assert slid.friction == pytest.approx(friction, rel=0.02)
    assert turned.torque_ratio == pytest.approx(friction * spin_length, rel=0.05)
    assert abs(slid.rise) < 0.05
    assert abs(turned.rise) < 0.15


def test_what_only_yields_rises_to_the_end():
    controller, _ = rubbed(RubbedPlane(friction=50.0, skin=60.0), SLIDE)
    assert felt(controller)[0].rise > 0.5


# --- what goes wrong ---


def test_a_surface_that_is_not_there_is_looked_for_only_so_far():
    near = replace(WANTED, approach_distance=0.005)
    _, rows = rubbed(RubbedPlane(), SLIDE, vanish=0.0, parameters=near)
    assert rows.phases == [Phase.HOLD, Phase.APPROACH, Phase.LOST]
    way = PERIOD * sum(np.linalg.norm(c.velocity_base_tip) for c in rows.command)
    assert way == pytest.approx(near.approach_distance, rel=0.05)


def test_contact_that_is_lost_once_is_sought_and_the_rub_done_again():
    controller, rows = rubbed(RubbedPlane(), SLIDE, TURN, vanish=1.15, back=1.3)
    assert Phase.SEEK in rows.phases
    assert rows.phase[-1] is Phase.DONE
    assert controller.lost == 1
    assert [(span.rub, span.back) for span in controller.spans] == [
        (SLIDE, False),
        (SLIDE, True),
        (TURN, False),
        (TURN, True),
    ]


def test_contact_that_is_lost_for_good_ends_the_run_at_rest():
    controller, rows = rubbed(RubbedPlane(), SLIDE, TURN, vanish=1.15)
    assert rows.phase[-1] is Phase.LOST
    assert rows.command[-1].velocity_base_tip == rows.command[-1].angular_velocity_base_tip == (0.0, 0.0, 0.0)
    assert len(controller.spans) % 2 == 0 or not controller.spans[-1].back


@pytest.mark.slow
@pytest.mark.parametrize("tilt", [0.0, 0.02])
def test_strokes_straight_into_the_surface_go_along_it_there_and_back_all_the_same(tilt):
    """No controller may raise in mid-run; friction is that of any other way."""
    controller, rows = rubbed(RubbedPlane(tilt=tilt), SLIDE, parameters=replace(WANTED, along=(0.0, 0.0, 1.0)))
    assert rows.phase[-1] is Phase.DONE
    assert len(controller.spans) == 2
    plain, _ = rubbed(RubbedPlane(tilt=tilt), SLIDE)
    assert felt(controller)[0].friction == pytest.approx(felt(plain)[0].friction, rel=0.02)


# --- the survey ---

SURVEY = SurveyWanted((1.0, 4.0), 0.01, (0.005, 0.02), most_travel=0.025)


def answered(wanted, mu=0.5, e=0.003, rise=lambda rub: 0.0):
    """All rubs of a survey of a surface that answers so, and the survey."""
    survey, asked = Survey(wanted), []
    survey.start()
    felt = None
    while (motion := survey.next(felt)) is not None:
        asked.append(motion)
        felt = RubMeasurement(motion, mu if motion.speed else 0.0, mu * e if motion.spin else 0.0, rise(motion))
        assert len(asked) < 200
    return asked, survey


def test_a_survey_rubs_and_turns_in_both_directions_at_every_load_and_every_speed_at_one():
    asked, survey = answered(SURVEY)
    assert survey.stuck_sliding == survey.stuck_turning == []
    assert survey.exponents_measured
    assert {(r.normal_force, r.speed) for r in asked if not r.spin} == {
        (1.0, 0.01),
        (4.0, 0.005),
        (4.0, 0.01),
        (4.0, 0.02),
    }
    for load in SURVEY.loads:
        spins = [r.spin for r in asked if r.normal_force == load and not r.speed]
        assert len(spins) == 2
        assert sum(spins) == 0.0
    assert all(r.duration >= MIN_DURATION and (r.speed == 0.0 or r.travel >= 0.999 * SURVEY.travel) for r in asked)


@settings(deadline=None, max_examples=30)
@given(st.floats(1e-3, 8e-3), st.floats(0.002, 0.05))
def test_twists_slip_about_as_fast_as_strokes_once_e_is_known_and_never_faster_than_the_tip_turns(e, speed):
    asked, _ = answered(replace(SURVEY, speed=speed, speeds=()), e=e)
    last = [abs(r.spin) for r in asked if r.normal_force == 4.0 and r.spin]
    assert all(abs(r.spin) <= SURVEY.most_spin for r in asked)
    assert last[-1] == pytest.approx(min(SURVEY.most_spin, max(0.2, speed / e)))


def test_what_seems_elastic_is_rubbed_farther_each_time_and_given_up_at_the_most():
    asked, survey = answered(SURVEY, rise=lambda rub: 1.0)
    ways = [r.travel for r in asked if r.normal_force == 1.0 and r.speed]
    assert ways == sorted(ways)
    assert ways[-1] == pytest.approx(SURVEY.most_travel)
    angles = [r.angle for r in asked if r.normal_force == 1.0 and r.spin]
    assert max(angles) == pytest.approx(SURVEY.most_angle)
    assert survey.stuck_sliding == survey.stuck_turning == [1.0, 4.0]


def test_what_slips_late_is_rubbed_just_far_enough():
    asked, survey = answered(SURVEY, rise=lambda rub: 1.0 if rub.speed and rub.travel < 0.008 else 0.0)
    ways = [r.travel for r in asked if r.normal_force == 1.0 and r.speed]
    assert ways[-2] < 0.008 <= ways[-1] < 0.017
    assert survey.stuck_sliding == survey.stuck_turning == []
    assert survey.exponents_measured


def test_exponents_take_slips_of_both_kinds_at_once_and_known_e_at_both_loads():
    asked, survey = answered(replace(SURVEY, exponent_slips=18))
    mixed = [r for r in asked if r.speed and r.spin]
    assert survey.stuck_sliding == survey.stuck_turning == []
    assert survey.exponents_measured
    assert {r.normal_force for r in mixed} == {1.0, 4.0}
    ratios = {round(r.speed / (0.003 * r.spin), 2) for r in mixed}
    assert {0.4, 2.5} <= ratios
    assert all(abs(r.spin) <= SURVEY.most_spin for r in asked)
    _, stuck = answered(replace(SURVEY, exponent_slips=18), rise=lambda rub: 1.0 if rub.spin else 0.0)
    assert not stuck.exponents_measured


def test_a_tip_that_cannot_turn_is_never_asked_to():
    asked, _ = answered(replace(SURVEY, most_spin=0.0))
    assert not any(r.spin for r in asked)


def test_surveys_that_cannot_be_are_refused():
    with pytest.raises(InvalidValueError, match="each above the one before"):
        SurveyWanted((2.0, 1.0), 0.01)
    with pytest.raises(InvalidValueError, match=r"speed = 0.1 m/s: .* rub more slowly"):
        SurveyWanted((1.0,), 0.1)
    assert math.isfinite(SURVEY.expected_duration)
    assert GAIN.gain_margin > 2.0
