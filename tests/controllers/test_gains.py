"""Force gains against the delayed integrator dF/dt = K v(t - T) they are made for."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.controllers import ForceGain, force_gain, series_stiffness, tracking_delay
from palpate.controllers.gains import MAX_LIVE_LOOP_GAIN, MIN_LIVE_LOOP_GAIN
from palpate.errors import InvalidValueError

STIFFNESS, DELAY = 15e3, 0.02
STEPS = 1000
"""Of the simulation per delay."""


def step_response(loop_gain, delays=60):
    """Force error of v = k (1 - F), dF/dt = K v(t - T), from F = 0; time in units of T."""
    dt = 1.0 / STEPS
    force = np.zeros((delays + 1) * STEPS)
    for i in range(STEPS, len(force) - 1):
        force[i + 1] = force[i] + dt * loop_gain * (1.0 - force[i - STEPS])
    return force[STEPS:]


def swing(force, start, stop):
    return np.ptp(force[start * STEPS : stop * STEPS])


def test_the_default_settles_with_next_to_no_overshoot():
    gain = force_gain(STIFFNESS, DELAY)
    force = step_response(gain.loop_gain)
    assert gain.loop_gain == pytest.approx(0.5)
    assert force.max() < 1.05
    assert abs(force[-1] - 1.0) < 1e-6
    assert gain.phase_margin_deg == pytest.approx(61.4, abs=0.1)
    assert gain.gain_margin == pytest.approx(math.pi)


@pytest.mark.parametrize("loop_gain", [0.2, 0.5, 1.0])
def test_the_gain_margin_is_where_the_loop_begins_to_oscillate(loop_gain):
    margin = force_gain(STIFFNESS, DELAY, loop_gain).gain_margin
    below, above = (step_response(loop_gain * margin * factor) for factor in (0.97, 1.03))
    assert swing(below, 50, 60) < 0.8 * swing(below, 30, 40)
    assert swing(above, 50, 60) > 1.2 * swing(above, 30, 40)


def test_at_the_margin_it_swings_with_a_period_of_four_delays():
    force = step_response(math.pi / 2) - 1.0
    crossings = np.flatnonzero((force[:-1] < 0.0) & (force[1:] >= 0.0)) / STEPS
    assert np.diff(crossings)[-5:] == pytest.approx([4.0] * 5, abs=0.02)


@settings(max_examples=100, deadline=None, derandomize=True)
@given(st.floats(1e2, 1e6), st.floats(1e-4, 1.0), st.floats(1e-3, 1.57))
def test_every_gain_below_the_limit_is_accepted_and_none_above(stiffness, delay, loop_gain):
    gain = force_gain(stiffness, delay, loop_gain)
    assert gain.loop_gain == pytest.approx(loop_gain)
    assert gain.gain_margin > 1.0
    assert gain.phase_margin_deg > 0.0
    with pytest.raises(InvalidValueError):
        ForceGain(gain.gain * gain.gain_margin * 1.001, stiffness, delay)


def test_an_unstable_gain_is_refused_with_one_that_is_stable():
    with pytest.raises(InvalidValueError, match="unstable") as refusal:
        ForceGain(0.01, STIFFNESS, DELAY)
    advised = float(str(refusal.value).rsplit("at most ", 1)[1].split()[0])
    assert ForceGain(advised, STIFFNESS, DELAY).gain_margin > 2.5


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan, math.inf])
def test_what_makes_no_gain_is_refused_by_name(bad):
    with pytest.raises(InvalidValueError, match="stiffness"):
        force_gain(bad, DELAY)
    with pytest.raises(InvalidValueError, match="delay"):
        force_gain(STIFFNESS, bad)
    with pytest.raises(InvalidValueError, match="gain"):
        force_gain(STIFFNESS, DELAY, bad)


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


@settings(max_examples=100, deadline=None, derandomize=True)
@given(st.floats(1e2, 1e6), st.floats(1e-4, 1.0), st.floats(1e-3, 1.57))
def test_every_gain_in_the_live_range_is_a_stable_one_and_the_first_is_in_it(stiffness, delay, loop_gain):
    gain = force_gain(stiffness, delay, loop_gain)
    least, most = gain.live_range
    assert least <= gain.gain <= most
    assert most * stiffness * delay <= max(MAX_LIVE_LOOP_GAIN, loop_gain) * (1 + 1e-12)
    if loop_gain <= MAX_LIVE_LOOP_GAIN:
        assert ForceGain(most, stiffness, delay).gain_margin > 2.6
        assert ForceGain(most, stiffness, delay).phase_margin_deg > 55.0


def test_springs_in_series_share_the_force():
    assert series_stiffness(3.0, 6.0) == pytest.approx(2.0)
    assert series_stiffness(7.0) == pytest.approx(7.0)
    assert series_stiffness(2e4, 1e9) == pytest.approx(2e4, rel=1e-4)
    with pytest.raises(InvalidValueError, match="stiffness"):
        series_stiffness(1.0, 0.0)


def test_delays_add_up():
    assert tracking_delay(1e-3, 0.02, 0.004) == pytest.approx(0.0255)
    assert tracking_delay(2e-3, 0.0) == pytest.approx(0.003)
    with pytest.raises(InvalidValueError, match="servo_lag"):
        tracking_delay(1e-3, -0.02)
    with pytest.raises(InvalidValueError, match="period"):
        tracking_delay(0.0, 0.02)
