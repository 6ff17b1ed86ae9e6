"""Laws of force control and their gains against the delayed spring: margins, damping, profiles of force."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.controllers import (
    Admittance,
    ConstantForce,
    DirectForce,
    ForceGain,
    NormalForce,
    RampForce,
    SineForce,
    VirtualBody,
    force_gain,
    series_stiffness,
    tracking_delay,
)
from palpate.controllers.force_law import least_damping
from palpate.controllers.gains import MAX_LIVE_LOOP_GAIN, MIN_LIVE_LOOP_GAIN
from palpate.controllers.margins import loop_margins, whole_delays
from palpate.controllers.measured_admittance import MIN_PHASE_MARGIN, STIFFER, measured_admittance
from palpate.controllers.measured_loop import ForceResponse
from palpate.errors import InvalidValueError
from support.delayed_spring import delayed_loop

STIFFNESS, DELAY, PERIOD = 15e3, 0.02, 1e-3


def step_response(loop_gain, delays=60):
    """Force over time in units of T of v = k (1 - F), dF/dt = K v(t - T), from F = 0; a thousand steps per T."""
    forces = delayed_loop(lambda time, force, _: loop_gain * (1.0 - force), 1.0, 1000, (delays + 1) * 1000, 1e-3)
    return forces[1000:]


def test_the_default_settles_with_next_to_no_overshoot():
    gain = force_gain(STIFFNESS, DELAY)
    force = step_response(gain.loop_gain)
    assert gain.loop_gain == pytest.approx(0.5)
    assert force.max() < 1.05
    assert abs(force[-1] - 1.0) < 1e-6
    assert gain.phase_margin_deg == pytest.approx(61.4, abs=0.1)


def test_at_the_margin_it_swings_with_a_period_of_four_delays():
    force = step_response(math.pi / 2) - 1.0
    crossings = np.flatnonzero((force[:-1] < 0.0) & (force[1:] >= 0.0)) / 1000
    assert np.diff(crossings)[-5:] == pytest.approx([4.0] * 5, abs=0.02)


@settings(max_examples=100, deadline=None, derandomize=True)
@given(st.floats(1e2, 1e6), st.floats(1e-4, 1.0), st.floats(1e-3, 1.57))
def test_every_gain_below_the_limit_is_accepted_and_none_above(stiffness, delay, loop_gain):
    """A delayed integrator is stable up to a loop gain of pi / 2; the live range keeps a margin of 2.6.

    The refusal of an unstable gain advises one that is stable.
    """
    gain = force_gain(stiffness, delay, loop_gain)
    least, most = gain.live_range
    assert gain.loop_gain == pytest.approx(loop_gain)
    assert gain.gain_margin == pytest.approx(math.pi / 2 / loop_gain)
    assert gain.phase_margin_deg > 0.0
    with pytest.raises(InvalidValueError, match="unstable") as refusal:
        ForceGain(gain.gain * gain.gain_margin * 1.001, stiffness, delay)
    advised = float(str(refusal.value).rsplit("at most ", 1)[1].split()[0])
    assert ForceGain(advised, stiffness, delay).gain_margin > 2.5
    assert least <= gain.gain <= most
    assert most * stiffness * delay <= max(MAX_LIVE_LOOP_GAIN, loop_gain) * (1 + 1e-12)
    if loop_gain <= MAX_LIVE_LOOP_GAIN:
        assert ForceGain(most, stiffness, delay).gain_margin > 2.6
        assert ForceGain(most, stiffness, delay).phase_margin_deg > 55.0


@settings(max_examples=30, deadline=None, derandomize=True)
@given(
    st.lists(st.tuples(st.integers(1, 400), st.floats(MIN_LIVE_LOOP_GAIN, MAX_LIVE_LOOP_GAIN)), min_size=1),
    st.floats(0.1, 1.0),
)
def test_a_gain_that_leaps_about_within_its_live_range_cannot_make_the_loop_unstable(pieces, saturation):
    """Yorke's theorem, on e' = -a(t) e(t - 1) from rest; a push that saturates is a smaller gain."""
    steps, delays = 50, 80
    gains = np.resize(np.repeat([x for _, x in pieces], [n for n, _ in pieces]), delays * steps)
    error = np.ones((delays + 1) * steps)
    for i in range(steps, len(error) - 1):
        push = min(max(gains[i - steps] * error[i - steps], -saturation * 0.6), saturation * 0.6)
        error[i + 1] = error[i] - push / steps
    assert np.abs(error).max() <= 1.0
    assert np.abs(error[-steps:]).max() < 0.1


def test_delays_add_up():
    """Springs in series share the force; a command waits for one and a half periods at least."""
    assert tracking_delay(1e-3, 0.02, 0.004) == pytest.approx(0.0255)
    assert tracking_delay(2e-3, 0.0) == pytest.approx(0.003)
    assert whole_delays(1.5e-3, PERIOD) == 1
    assert series_stiffness(3.0, 6.0) == pytest.approx(2.0)
    assert series_stiffness(7.0) == pytest.approx(7.0)


def closed(law, stiffness):
    """Force over 6 s of a law on a spring, from contact without force."""
    law.start(0.0)
    return delayed_loop(
        lambda time, force, _: law.step(1.0 - force, law.gain.gain),
        stiffness,
        whole_delays(SAMPLED_DELAY, PERIOD),
        6000,
    )


LAWS = {
    "direct": lambda: DirectForce(force_gain(STIFFNESS, SAMPLED_DELAY)),
    "admittance": lambda: Admittance(VirtualBody(10.0, 1.2e3, STIFFNESS, SAMPLED_DELAY), PERIOD),
}


@pytest.mark.parametrize("name", LAWS)
def test_the_gain_margin_is_where_it_begins_to_oscillate(name):
    assert closed(LAWS[name](), STIFFNESS)[-1] == pytest.approx(1.0, abs=1e-9)
    margin = LAWS[name]().margins(PERIOD).gain_margin
    assert margin > 1.5
    for factor, decays in ((0.98, True), (1.02, False)):
        force = closed(LAWS[name](), margin * factor * STIFFNESS)
        assert bool(np.ptp(force[-1000:]) < np.ptp(force[1500:2500])) is decays


def test_the_direct_law_s_sampled_margins_are_those_of_the_gain():
    """At 20 periods of delay, sampling changes little."""
    gain = force_gain(STIFFNESS, SAMPLED_DELAY)
    margins = DirectForce(gain).margins(PERIOD)
    assert margins.gain_margin == pytest.approx(gain.gain_margin, rel=0.002)
    assert margins.phase_margin_deg == pytest.approx(gain.phase_margin_deg, abs=0.3)
    assert 0.5 < margins.modulus_margin < 1.0
    # the sampled body answers within the period: its exact solution leads the continuous one by half of it
    body = VirtualBody(10.0, 1.2e3, STIFFNESS, SAMPLED_DELAY)
    assert Admittance(body, PERIOD).margins(PERIOD).gain_margin == pytest.approx(body.gain_margin, rel=0.05)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.floats(0.01, 100.0), st.floats(1e2, 1e6), st.floats(1e-3, 0.1))
def test_least_damping_separates_stable_bodies_from_others(mass, stiffness, delay):
    least = least_damping(mass, stiffness, delay)
    assert VirtualBody(mass, 1.001 * least, stiffness, delay).gain_margin == pytest.approx(1.0, abs=0.01)
    with pytest.raises(InvalidValueError, match="at least"):
        VirtualBody(mass, 0.99 * least, stiffness, delay)


def test_a_light_body_is_the_direct_law_and_a_heavy_one_asks_for_more_damping():
    """k K T = pi/2 without a mass."""
    dampings = [least_damping(mass, STIFFNESS, SAMPLED_DELAY) for mass in (1e-9, 0.1, 1.0, 10.0, 100.0)]
    assert dampings[0] == pytest.approx(STIFFNESS * SAMPLED_DELAY / (math.pi / 2), rel=1e-3)
    assert np.all(np.diff(dampings) > 0.0)


@settings(max_examples=50, deadline=None, derandomize=True)
@given(st.floats(0.1, 50.0), st.floats(200.0, 5e3), st.floats(-5.0, 5.0))
def test_the_body_s_velocity_is_the_exact_solution_of_its_equation(mass, damping, error):
    body = VirtualBody(mass, damping, 1.0, 1e-3)  # next to no stiffness: always stable
    law = Admittance(body, PERIOD)
    law.start(0.02)
    for i in range(1, 50):
        velocity = law.step(error, law.gain.gain)
        exact = error / damping + (0.02 - error / damping) * math.exp(-i * PERIOD * damping / mass)
        assert velocity == pytest.approx(exact, abs=1e-12)


def test_noise_moves_an_admittance_less():
    noise = np.random.default_rng(1).normal(0.0, 0.01, 5000)
    direct, admittance = LAWS["direct"](), LAWS["admittance"]()
    admittance.start(0.0)
    moved, plain = (
        np.std([law.step(error, law.gain.gain) for error in noise]) / law.gain.gain for law in (admittance, direct)
    )
    assert moved < 0.5 * plain


def test_margins_of_a_loop_with_known_ones():
    """L = a / (z - 1) is stable for a < 2, and the modulus margin is 1 - a/2, at the Nyquist frequency."""
    margins = loop_margins(lambda z: 0.5 / (z - 1.0))
    assert margins.gain_margin == pytest.approx(4.0, rel=0.01)
    assert margins.modulus_margin == pytest.approx(0.75, rel=0.01)
    # |L| = 1 where 2 sin(w/2) = 0.5; the phase there is -90 degrees - w/2
    assert margins.phase_margin_deg == pytest.approx(90.0 - math.degrees(math.asin(0.25)), abs=0.2)


PROFILES = [
    ConstantForce(2.0),
    RampForce(1.0, 4.0, 0.7, 0.5),
    RampForce(4.0, 1.0, 2.0),
    RampForce(2.0, 2.0, 1.0),
    SineForce(3.0, 2.0, 0.8),
]


@pytest.mark.parametrize("profile", PROFILES, ids=repr)
def test_the_rate_is_the_force_s_derivative(profile):
    """By trapezoids, exact but at the two bends of a ramp, which ends at its last force."""
    forces, rates = np.array([profile.at(t) for t in np.linspace(0.0, 6.0, 6001)]).T
    gathered = forces[0] + np.concatenate([[0.0], np.cumsum(0.5e-3 * (rates[1:] + rates[:-1]))])
    assert np.abs(gathered - forces).max() < 3e-3
    assert forces.min() > 0.0
    if isinstance(profile, RampForce):
        assert profile.at(0.0)[0] == profile.first
        assert profile.at(6.0) == profile.at(1e9) == (profile.last, 0.0)
        assert min(profile.first, profile.last) <= forces.min() <= forces.max() <= max(profile.first, profile.last)


@pytest.mark.parametrize("feed_forward", [True, False])
def test_with_the_rate_fed_forward_a_sine_is_followed_without_lag(feed_forward):
    """On a delayed spring: F' = K v(t - T), so v = F_set'(t + T) / K is all that it takes."""
    stiffness, delays = 10e3, 20
    gain, profile = force_gain(stiffness, (delays + 0.5) * PERIOD), SineForce(3.0, 1.0, 1.0)
    control = NormalForce(DirectForce(gain), stiffness, gain.delay, PERIOD)

    def step(time, force, _):
        rate = profile.at(time + gain.delay)[1] if feed_forward else 0.0
        return control.step(profile.at(time)[0], force, gain.gain, 1.0, rate)

    forces = delayed_loop(step, stiffness, delays, 3000, depth=3.0 / stiffness)
    worst = max(abs(profile.at(i * PERIOD)[0] - forces[i]) for i in range(1000, 3000))
    proportional = 2.0 * math.pi / (gain.gain * stiffness)  # F_set' / (k K)
    assert worst < 0.01 if feed_forward else worst == pytest.approx(proportional, rel=0.1)


def response(stiffness, damping_time, delay, servo=0.0):
    """Of a contact K + c s behind a pure delay, and a servo with a lag."""
    w = 2.0 * math.pi * np.geomspace(2.0, 200.0, 14)
    P = stiffness * (1.0 + 1j * w * damping_time) * np.exp(-1j * w * delay) / (1.0 + 1j * w * servo)
    return ForceResponse(w, P, PERIOD)


@settings(max_examples=25, deadline=None, derandomize=True)
@given(st.floats(1e3, 1e5), st.floats(0.015, 0.15), st.floats(0.5e-3, 3e-3))
def test_a_damped_contact_bears_a_larger_gain_with_a_lag_and_keeps_the_margins(stiffness, damping_time, delay):
    felt = response(stiffness, damping_time, delay)
    found = measured_admittance(felt, stiffness)
    gain, lag = found.gain.gain, found.body.lag
    assert gain > 2.0 * felt.gain()
    # margins of the loop itself, computed here
    w = np.geomspace(2.0, 200.0, 20000) * 2.0 * math.pi
    P = stiffness * (1.0 + 1j * w * damping_time) * np.exp(-1j * w * (delay + 0.5 * PERIOD))
    L = gain * P / (1j * w * (1.0 + 1j * w * lag))
    for share, least in ((1.0, 90.0 - math.degrees(0.5)), (STIFFER, MIN_PHASE_MARGIN)):
        over = np.flatnonzero(share * np.abs(L) >= 1.0)
        if len(over) and over[-1] < len(w) - 1:
            # 14 measured frequencies are interpolated: a degree or two
            assert 180.0 + math.degrees(np.unwrap(np.angle(L))[over[-1]]) > least - 3.0
    beyond = np.flatnonzero(np.unwrap(np.angle(L)) <= -math.pi)
    if len(beyond):
        assert 1.0 / np.abs(L[beyond[0]]) >= math.pi - 0.1
    # even if the contact should lose all its damping the loop is stable
    assert found.body.gain_margin > 1.0


@pytest.mark.parametrize("delay", [0.005, 0.02])
def test_where_delay_is_what_limits_there_is_nothing_to_gain(delay):
    assert measured_admittance(response(20e3, 0.0, delay), 20e3) is None


def test_scaling_the_stiffness_scales_the_gain_alone():
    soft, stiff = (measured_admittance(response(K, 0.03, 1e-3), K) for K in (1e3, 1e5))
    assert stiff.gain.gain == pytest.approx(0.01 * soft.gain.gain, rel=1e-9)
    assert stiff.body.lag == pytest.approx(soft.body.lag)
    assert stiff.phase_margin_deg == pytest.approx(soft.phase_margin_deg)


SAMPLED_DELAY = 0.0205
