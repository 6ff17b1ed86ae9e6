"""A grasp by what rubbing found: what is simulated, what is planned with, and what is said of both beforehand."""

import math
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.errors import InvalidValueError
from palpate.experiments.grasp.account import outcome, plan_notes
from palpate.experiments.grasp.config import GraspConfig
from palpate.experiments.grasp.experiment import GraspObject
from palpate.experiments.grasp.findings import against_slip
from palpate.experiments.grasp.friction_belief import (
    USUAL_SURFACE,
    NotedNudge,
    likely_surface,
    planned_with,
    rubbed_by_plant,
    slips_of,
)
from palpate.experiments.grasp.metrics import MAX_GRIP, METRICS
from palpate.experiments.grasp.minimum_grip import (
    GRIP_TOLERANCE,
    _least_of_many,
    grip_for,
    largest_load,
    least_forces,
    least_grip,
    load_under,
)
from palpate.experiments.grasp.plan import NUDGE_PARAMETERS
from palpate.experiments.kit.metric import metric_rows, metrics_of
from palpate.friction.contact_load import ContactLoad
from palpate.friction.friction_file import How
from palpate.friction.limit_surface import LimitSurface
from palpate.robots.hand_description import LIMITS, simulated_hand
from palpate.runtime import Ending
from palpate.spatial import norm
from support.found_friction import ASSUMED, FLAT, finding, found_friction, friction_file
from support.grasp_runs import plan_of, planned_again, run_grasp
from support.run_bounds import check_bounds


@pytest.fixture
def written(tmp_path):
    return partial(friction_file, tmp_path)


@pytest.fixture(scope="module")
def nudged():
    """Nudged, lifted a little, and held."""
    return run_grasp(known="nudged", load="none", rise=0.1, lift_height=0.005)


# --- what is simulated


def test_what_is_typed_goes_before_what_was_found_number_by_number(written):
    planned = plan_of(friction_file=written(), friction=0.6, norm_exponent=2.0)
    assert planned.true == LimitSurface(0.6, 0.002, 0.2, 2.0)
    assert planned.believed.friction == pytest.approx(0.8)


@pytest.mark.parametrize("gamma", [FLAT, finding(0.0, 0.0, 1.0 / 3.0, How.ASSUMED)])
@pytest.mark.parametrize("p", [ASSUMED, finding(1.96, 1.9, 2.0)])
def test_exponents_that_may_be_mujocos_leave_it_to_mujoco(written, gamma, p):
    planned = plan_of(friction_file=written(gamma=gamma, p=p))
    assert not rubbed_by_plant(planned.config)
    assert not planned.task().scene().rubbing
    assert likely_surface(found_friction(gamma=gamma, p=p)) == LimitSurface(0.8, 0.002)


def test_without_a_file_it_is_the_usual_surface_and_the_plan_says_so_in_numbers():
    config = plan_of().config
    assert plan_of().true == USUAL_SURFACE
    assert (config.friction, config.spin_length) == (USUAL_SURFACE.friction, USUAL_SURFACE.spin_length)
    assert rubbed_by_plant(GraspConfig(norm_exponent=1.5))
    assert rubbed_by_plant(GraspConfig(load_exponent=0.1))
    assert rubbed_by_plant(GraspConfig(plant=True))


@pytest.mark.parametrize("robot", [None, "ur5e-hand"])
def test_a_log_remembers_what_was_simulated_when_the_file_is_gone(written, robot):
    file = written()
    planned = plan_of(friction_file=file, robot=robot)
    file.unlink()
    again = planned_again(planned)
    assert again == planned
    assert again.true == planned.true


# --- what is planned with


@settings(max_examples=100)
@given(
    st.floats(1.0, 2.0),
    st.floats(0.0, 1.0),
    st.floats(0.0, 1.0),
    st.floats(0.1, 5.0),
    st.floats(0.0, 0.03),
    st.sampled_from([How.MEASURED, How.ASSUMED]),
)
def test_no_p_that_may_be_true_needs_more_grip_than_the_one_planned_with(p, below, above, force, torque, how):
    lower, upper = p - below * (p - 1.0), p + above * (2.0 - p)
    surface = planned_with(found_friction(p=finding(p, lower, upper, how)))
    for true in np.linspace(lower, upper, 5).tolist():
        exact = replace(surface, norm_exponent=true)
        assert surface.least_normal_force(force, torque) >= exact.least_normal_force(force, torque) * (1.0 - 1e-9)


def test_a_nudge_is_felt_at_its_own_grip():
    """e grows with the grip: at 1 N it is less than what is felt at 2 N, and at 2 N that again."""
    belief = NotedNudge(LimitSurface(0.35, 0.002, 0.25), 2.0)
    belief.start()
    belief.learn(0, 0.5, 0.005)
    belief.learn(1, 0.5, None)
    assert belief.surface(0).spin_length < 0.005
    assert belief.surface(0).spin_length_at(2.0) == pytest.approx(0.005)
    assert belief.surface(1).spin_length == pytest.approx(0.002)
    assert [each.spin_length for each in belief.found] == [0.005, None]
    belief.start()
    assert not belief.found


@pytest.mark.slow
def test_a_nudge_takes_as_long_as_planned(nudged):
    """From the last touch to the lift, and all of it before the pull: stroke and twists ramp up and down."""
    touched = float(nudged.truth.time[int(nudged.truth.touching.all(axis=1).argmax())])
    lifted = float(nudged.truth.time[int(np.flatnonzero(nudged.truth.height > 1e-3)[0])])
    assert lifted - touched > NUDGE_PARAMETERS.duration
    assert lifted - touched < NUDGE_PARAMETERS.duration + 0.7
    assert float(nudged.truth.time[nudged.carried][0]) < nudged.planned.times.begin


# --- slip that is listened for


@pytest.mark.parametrize("share", [0.4, 0.5, 0.7, 1.0])
def test_even_less_than_half_of_the_friction_that_was_believed_is_heard_to_slip(share):
    """A contact in full slip carries mu f_n, ripple and all. 0.62 was believed, and said to be off by 30 %."""
    config = GraspConfig(known="untouched")
    slips = slips_of(config, LimitSurface(0.62, 0.006), simulated_hand(2).geometry.tips[0], 1e-3)
    told = []
    for i in range(300):
        pressed = 1.6 + 0.1 * math.sin(2.0 * math.pi * 100.0 * 1e-3 * i)
        load = ContactLoad(pressed, (0.0, 0.0, share * 0.62 * pressed), 0.0)
        told.append(slips.step(1e-3 * i, (load, load))[0])
    assert any(told)


# --- what is said


def told(config):
    return " ".join(plan_notes(plan_of(config)))


FOUND = "mu = 0.8, e = 2 mm at 1 N, gamma = 0.2, p = 1.5 was found"
OTHER = ("does not have the friction of", "Leave out --friction --spin-length,", FOUND)


@pytest.mark.parametrize(
    ("found", "fields", "words", "absent"),
    [
        ({}, {"friction": 0.5, "spin_length": 0.004}, OTHER, ()),
        ({}, {"friction": 0.803}, ("The simulated object has the friction of",), ()),  # within its interval
        ({}, {}, ("rubbed with 4 N at most", "e grew no more"), ("Nobody",)),
        ({"loads": (1.0, 12.0)}, {}, (), ("rubbed with",)),
        ({}, {"load": "none"}, (), ("rubbed with",)),
        ({"p": ASSUMED}, {}, ("41 %", "--fit-exponents"), ()),
    ],
)
def test_notes_compare_the_simulated_surface_and_the_load_with_what_was_rubbed(
    found, fields, words, absent, written
):
    said = told(GraspConfig(friction_file=written(**found), **fields))
    assert [word for word in words if word not in said] == []
    assert [word for word in absent if word in said] == []


# --- what the hand can do


@settings(max_examples=50)
@given(st.floats(0.2, 1.0), st.just(0.0) | st.floats(1e-9, 0.5))
def test_the_heaviest_object_is_held_and_a_heavier_one_refused_with_what_would_do(mu, margin):
    """Coulomb: each of two fingers bears mu f, so that 2 mu f is the most that can be carried."""
    with pytest.raises(InvalidValueError, match="must be at most") as refused:
        plan_of(mass=50.0, friction=mu, margin=margin)
    most = float(str(refused.value).split("must be at most ")[1].split()[0])
    needed = (1.0 + margin) * grip_for(
        GraspConfig(), LimitSurface(mu, 0.004), load_under(GraspConfig(mass=most, friction=mu))
    )
    assert 0.89 * MAX_GRIP < needed <= MAX_GRIP
    plan_of(mass=most, friction=mu, margin=margin)


def test_a_pull_that_no_grip_of_the_hand_bears_is_warned_of():
    assert "it will slip" in told(GraspConfig(pull=8.0, offset=0.03))


def test_the_largest_grip_leaves_the_sensor_room_for_the_largest_load():
    """Moment about the sensor: 12 mm before it presses the grip, 8 mm aside the load pulls, about one axis."""
    jumped, pulled = 1.125 * MAX_GRIP * 0.012, 0.5 * norm(largest_load(GraspConfig(pull=8.0))[:3]) * 0.008
    assert jumped + pulled < LIMITS.moment


# --- the least of three, for any surface


@settings(max_examples=12, deadline=None)
@given(st.floats(1.0, 2.0), st.floats(0.0, 1.0 / 3.0), st.floats(-4.0, 4.0), st.floats(-0.02, 0.02))
def test_of_two_opposed_fingers_the_programme_finds_the_least_of_any_surface(p, gamma, y, about):
    contacts = np.array([[0.03, 0.0, 0.0], [-0.03, 0.0, 0.0]])
    surface, load = LimitSurface(0.5, 0.004, gamma, p), (0.0, y, -5.0, about, 0.0, 0.0)
    first, second = (tuple(each) for each in contacts.tolist())
    least = least_grip(surface, load, (first, second), ((-1.0, 0.0, 0.0), (1.0, 0.0, 0.0)))
    found = _least_of_many(surface, np.full(2, least), np.array(load), contacts, -contacts / 0.03)
    assert found == pytest.approx([least, least], rel=3.0 * GRIP_TOLERANCE)


def test_the_least_of_three_agrees_with_itself_where_e_grows():
    """At the grip it finds e is that of this grip; and where e grows above 1 N, less of it is needed."""
    angles = 2.0 * math.pi / 3.0 * np.arange(3)
    at = 0.03 * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(3)])
    load, constant = (0.0, 0.0, -5.0, 0.02, 0.0, 0.0), LimitSurface(0.5, 0.002, 0.0, 1.5)
    grows = replace(constant, load_exponent=0.3)
    least = np.array(least_forces(grows, load, at.tolist(), (-at / 0.03).tolist()))
    assert _least_of_many(grows, least, np.array(load), at, -at / 0.03) == pytest.approx(
        least, rel=3.0 * GRIP_TOLERANCE
    )
    assert least.mean() < least_grip(constant, load, at.tolist(), (-at / 0.03).tolist())


# --- metrics


def metrics(grasp):
    return {metric.name: metric for metric in metric_rows(METRICS, grasp)}


@pytest.mark.slow
def test_what_was_dropped_was_not_set_down():
    """Ten times the friction that there is: the fingers slide up the object, which stays behind on the table."""
    grasp = run_grasp(friction=0.05, believed_friction=0.5, rise=0.2, lift_height=0.02)
    assert grasp.truth.height.max() < 1e-3
    assert grasp.dropped
    assert metrics(grasp)["dropped"].value == "yes"
    for ending in Ending:
        ended = replace(grasp, run=replace(grasp.run, ending=ending))
        assert "The object was left behind" in outcome(ended)
        assert "Set down" not in outcome(ended)


def test_what_was_never_measured_has_no_figure():
    """A run that ended before anything pulled: no slip of 0 mm, but none known."""

    def stop(sample, now, command):
        if now.time > 0.3:
            raise RuntimeError("a made-up fault")

    grasp = run_grasp(observers=(stop,))
    rows, values = metrics(grasp), metrics_of(GraspObject(), grasp)
    assert rows["largest grip"].text == "-"
    assert not [name for name in rows if any(word in name for word in ("slip ", "spin ", "least"))]
    measured = ("slip_m", "spin_rad", "slip_aloft_m", "spin_aloft_rad", "grip_ratio", "tightest", "grip_max_n")
    assert {values[key] for key in measured} == {None}


@pytest.mark.slow
def test_what_a_nudge_found_is_told_against_the_truth(nudged):
    mu, e = metrics(nudged)["mu, by the nudge"], metrics(nudged)["e, by the nudge"]
    assert mu.value == pytest.approx(0.5, rel=0.02)
    assert e.value == pytest.approx(4.0, abs=0.25)
    for metric, true in ((mu, 0.5), (e, 4.0)):
        low, high = (float(word) for word in metric.note.split("err: ")[1].split(";")[0].split(" to "))
        assert low < true < high
        assert f"true {true:g}" in metric.note


# --- What keeps a grip from giving way again depends on why it did ---


REAL = {"robot": "ur5e-hand", "believed_friction": 0.4, "believed_spin_length": 0.003}
"""A hand whose true friction is unknown."""


@pytest.mark.parametrize(
    ("options", "told", "unheard"),
    [
        (REAL, ("--margin", "palpate friction"), ()),
        ({"known": "touched"}, ("--margin",), ("palpate friction",)),
        (
            {"known": "touched", "believed_friction": 0.9},
            ("estimate of mu was 0.9, and the true mu is 0.5", "palpate friction", "--known nudged"),
            ("--margin",),
        ),
        (
            {"known": "touched", "believed_spin_length": 0.008},
            ("estimate of e was 8 mm, and the true e is ", "palpate friction"),
            ("--margin",),
        ),
        ({"known": "nudged", "believed_friction": 0.9}, ("palpate friction",), ("--known nudged",)),
        ({"controller": "coulomb", "believed_friction": 0.9}, ("--controller limit-surface",), ("mu",)),
        ({"friction": 0.05}, ("--pull",), ("--margin", "estimate")),
    ],
)
def test_advice_fits_the_cause(options, told, unheard):
    advice = against_slip(plan_of(**options))
    assert all(words in advice for words in told)
    assert not any(words in advice for words in unheard)


# --- What is held for long, or suddenly pulled at: no slip beyond what is claimed, and its grip is told ---


@pytest.mark.slow
def test_what_is_held_while_zeros_wander_fast_does_not_slip_and_its_grip_is_told():
    done = run_grasp(load="none", rise=4.0, drift=6.0)
    check_bounds(done, {"growth": (0.9, done.planned.hold_growth)}, dropped=False, gave_way=())
    assert any("grip may grow" in note for note in done.planned.dry_run().notes)


def test_where_nothing_wanders_far_nothing_is_told_or_paid():
    quiet = plan_of(load="none", drift=0.0)
    assert quiet.hold_growth == 1.0
    assert quiet.preload_cost == 0.0
    assert not quiet.dry_run().notes
    assert not plan_notes(plan_of())


def test_the_price_of_a_preload_is_told_before_the_run():
    planned = plan_of(preload=1.5)
    factor = 1.0 + planned.preload_cost / planned.resting_grip
    assert any(f"steps up to 1.5 N in 5 ms, 6 mm aside: grip x {factor:.2g}" in n for n in planned.dry_run().notes)
