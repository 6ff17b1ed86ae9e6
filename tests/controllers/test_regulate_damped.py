"""What makes a regulation bear what it does not know: damped contacts, gentle steps, seeming motion."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.controllers import SurfaceFilter, SurfaceMotion, force_gain
from palpate.controllers.damped_contact import (
    MIN_GAIN_MARGIN,
    MIN_MODULUS_MARGIN,
    DampedContact,
    SpringMounting,
)
from palpate.controllers.force_program import StepForce, Tones
from palpate.controllers.gains import ForceGain
from palpate.controllers.gated_surface_motion import GatedSurfaceMotion
from palpate.controllers.regulate_parameters import RegulateParameters, live_regulation
from palpate.controllers.set_force import SetForce
from palpate.controllers.set_point_filter import SetPointFilter
from palpate.controllers.tangent_motion import PathTable
from palpate.errors import InvalidValueError

PERIOD = 1e-3
stiffnesses, delays = st.floats(300.0, 3e5), st.floats(1.5e-3, 0.05)


# --- damped contacts ---


@settings(deadline=None, max_examples=30)
@given(stiffnesses, delays)
def test_the_gain_for_a_spring_is_that_of_the_default_loop_gain(stiffness, delay):
    gain = DampedContact(stiffness).gain(delay)
    assert gain.loop_gain == pytest.approx(force_gain(stiffness, delay).loop_gain, rel=1e-4)


@settings(deadline=None, max_examples=30)
@given(stiffnesses, delays, st.floats(0.0, 0.3), st.floats(1e4, 1e6))
def test_the_margins_are_kept_however_it_is_damped(stiffness, delay, damping, servo):
    contact = DampedContact(stiffness, damping, servo)
    found = contact.margins(contact.gain(delay))
    assert found.gain_margin >= MIN_GAIN_MARGIN * (1.0 - 1e-3)
    assert found.modulus_margin >= MIN_MODULUS_MARGIN * (1.0 - 1e-6)


def grows(contact, gain, delay):
    """Whether the loop, simulated with a whole number of delays, ends with more than it began with."""
    step = delay / 200.0
    underway = [0.0] * 200
    x, spring = 1e-3, 1e-3  # of the tip, and of the contact's spring, the rest being the servo's
    K, c, Ks = contact.stiffness, contact.stiffness * contact.damping_time, contact.servo_stiffness
    forces = []
    for _ in range(200 * 60):
        underway.append(-gain * Ks * (x - spring))
        x += step * underway.pop(0)
        # c spring' + K spring = Ks (x - spring), implicitly
        spring = (c * spring + step * Ks * x) / (c + step * (K + Ks))
        forces.append(abs(Ks * (x - spring)))
    return max(forces[-2000:]) > max(forces[2000:4000])


@pytest.mark.parametrize(("stiffness", "damping"), [(1e3, 0.14), (20e3, 0.03), (5e3, 0.005)])
def test_a_simulated_loop_is_unstable_just_beyond_its_gain_margin(stiffness, damping):
    contact, delay = DampedContact(stiffness, damping, 87e3), 0.02
    critical = contact.gain(delay).gain * contact.margins(contact.gain(delay)).gain_margin
    assert not grows(contact, 0.9 * critical, delay)
    assert grows(contact, 1.1 * critical, delay)


def test_what_is_mounted_softly_is_as_stiff_as_its_contact_to_what_is_fast():
    soft = DampedContact(20e3, 0.03, 5e4, SpringMounting(2e3, 60.0, 1.0))
    assert soft.surface_stiffness == pytest.approx(1.0 / (1.0 / 20e3 + 1.0 / 2e3))
    spring = DampedContact(soft.surface_stiffness, soft.surface_damping_time, 5e4)
    assert soft.gain(0.0215).gain < spring.gain(0.0215).gain
    with pytest.raises(InvalidValueError, match="unstable on this contact; take at most"):
        soft.margins(ForceGain(20.0 * soft.gain(0.0215).gain, soft.series, 0.0215))


# --- set-point filter ---


@settings(deadline=None, max_examples=30)
@given(st.floats(0.005, 0.1), st.floats(0.5, 5.0), st.floats(5.1, 9.0))
def test_a_jump_is_gone_over_to_exactly_like_a_critically_damped_spring(tau, first, second):
    steps = SetPointFilter(tau, PERIOD)
    steps.reset(first)
    for i in range(60):
        steps.step(second, 0.0)
        x = i * PERIOD / tau
        assert steps.force == pytest.approx(second + (first - second) * (1.0 + x) * math.exp(-x), abs=1e-9)
        assert steps.rate == pytest.approx((second - first) * x / tau * math.exp(-x), abs=1e-6)
        assert steps.stepping == (1.0 if i <= 5.0 * tau / PERIOD - 1 else steps.stepping)


@settings(deadline=None, max_examples=20)
@given(st.floats(0.005, 0.1), st.floats(0.5, 20.0))
def test_what_changes_at_a_known_rate_passes_as_it_is(tau, frequency):
    tones, steps = Tones(2.0, 0.5, (frequency,), begin=0.0), SetPointFilter(tau, PERIOD)
    steps.reset(2.0)
    for i in range(300):
        force, rate = tones.at(i * PERIOD)
        steps.step(force, rate)
        if i * PERIOD < tones.duration:
            # but where a sine turns, between two samples
            assert steps.force == pytest.approx(force, abs=5e-3)
        assert steps.stepping == 0.0


def test_jumps_without_end_leave_half_of_the_time():
    steps, going = SetPointFilter(0.03, PERIOD), []
    steps.reset(1.0)
    for i in range(2000):
        steps.step(1.0 + (i // 10) % 2, 0.0)
        going.append(steps.stepping)
    assert 0.4 < np.mean(np.array(going) != 0.0) <= 0.56


def test_a_set_force_gets_where_the_profile_does_and_hardly_beyond():
    profile = StepForce(2.0, 3.0, 1.0)
    for step_time in (0.0, 0.03):
        wanted = SetForce(0.02, 0.02, PERIOD, damping_time=0.1, step_time=step_time)
        wanted.hold(2.0)
        forces = []
        for i in range(2000):
            wanted.step(*profile.at(i * PERIOD))
            forces.append(wanted.force)
        assert forces[:1000] == pytest.approx([2.0] * 1000)
        assert forces[-1] == pytest.approx(3.0, abs=1e-6)
        assert max(forces) <= 3.01


# --- a surface while the force steps ---

FILTER = SurfaceFilter(20e3, 0.02, 0.06)


@settings(deadline=None, max_examples=20)
@given(st.sampled_from([-1.0, 1.0]), st.floats(0.2, 0.9))
def test_a_contact_that_is_softer_than_thought_is_no_surface_that_yields_while_the_force_steps(way, ratio):
    gated, following = GatedSurfaceMotion(FILTER, PERIOD), SurfaceMotion(FILTER, PERIOD)
    force = 2.0
    for _ in range(100):
        velocity = way * 1e-3
        force += ratio * FILTER.stiffness * velocity * PERIOD
        gated.update_in_step(velocity, force, way)
        following.update(velocity, force)
    assert gated.velocity == pytest.approx(0.0, abs=1e-12)
    assert following.velocity * way > 0.1e-3


@settings(deadline=None, max_examples=20)
@given(st.sampled_from([-1.0, 1.0]), st.floats(1.1, 4.0))
def test_what_brakes_the_step_is_believed(way, ratio):
    gated, following = GatedSurfaceMotion(FILTER, PERIOD), SurfaceMotion(FILTER, PERIOD)
    force = 2.0
    for _ in range(20):
        velocity = way * 1e-3
        force += ratio * FILTER.stiffness * velocity * PERIOD
        gated.update_in_step(velocity, force, way)
        following.update(velocity, force)
    assert gated.velocity * way <= following.velocity * way + 1e-12 < 0.0


# --- recorded paths ---


@settings(deadline=None, max_examples=30)
@given(
    st.lists(
        st.tuples(st.floats(0.05, 1.0), st.floats(-0.05, 0.05), st.floats(-0.05, 0.05)), min_size=2, max_size=8
    ),
    st.floats(-100.0, 100.0),
)
def test_a_path_leads_through_its_positions_whenever_its_clock_began(rows, begin):
    times = tuple(begin + sum(step for step, _, _ in rows[:i]) for i in range(len(rows)))
    path = PathTable(times, tuple((x, y, 0.5) for _, x, y in rows))
    at = np.zeros(3)
    for i in range(1, len(rows)):
        # Simpson's rule is exact for the derivative of a cubic
        a, b = times[i - 1] - begin, times[i] - begin
        ends = [np.array(path.velocity(t)) for t in (a + 1e-9, 0.5 * (a + b), b - 1e-9)]
        at = at + (b - a) / 6.0 * (ends[0] + 4.0 * ends[1] + ends[2])
        assert at == pytest.approx(np.array(path.positions[i]) - path.positions[0], abs=1e-6)
    assert path.velocity(0.0) == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)
    assert path.velocity(-1.0) == path.velocity(times[-1] - begin + 1.0) == (0.0, 0.0, 0.0)


def test_paths_that_are_none_are_refused():
    with pytest.raises(InvalidValueError, match="two at least"):
        PathTable((0.0,), ((0.0, 0.0, 0.0),))
    with pytest.raises(InvalidValueError, match=r"times\[1\] = 0 s: must be later than 0 s"):
        PathTable((0.0, 0.0), ((0.0, 0.0, 0.0),) * 2)


# --- what may be changed ---


def test_live_force_and_gain_stay_in_their_ranges():
    gain = force_gain(20e3, 0.02)
    live = live_regulation(RegulateParameters(gain, 0.02, 1.0, 2.0, (0.5, 5.0)))
    live.check("force", 5.0)
    for name, value in (("force", 5.1), ("force_gain", 1.3 * gain.gain), ("force_gain", 0.0)):
        with pytest.raises(InvalidValueError, match="must lie between"):
            live.check(name, value)
    with pytest.raises(InvalidValueError, match="must lie in its range"):
        RegulateParameters(gain, 0.02, 1.0, 2.0, (2.5, 5.0))
