import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from palpate.sensing.ft.filter_specs import Butterworth, CriticallyDamped, FirstOrder, Notch
from palpate.sensing.ft.filters import WrenchFilter

RATE = 1000.0
LOW_PASSES = (Butterworth, CriticallyDamped, FirstOrder)
SPECS = [
    *(kind(cutoff) for kind in LOW_PASSES for cutoff in (5.0, 60.0, 400.0)),
    Notch(50.0, 3.0),
    Notch(120.0, 30.0),
]


def run(filtered, rows):
    """Output for inputs of shape (n, 6)."""
    return np.array([filtered.step(tuple(row)) for row in rows.tolist()])


def settling(spec):
    """Samples after which nothing of the start is left."""
    section = spec.section(RATE)
    slowest = max(abs(np.roots([1.0, section.a1, section.a2])))
    return int(60.0 / -math.log(slowest)) + 10


def response(section, frequency):
    return abs(signal.freqz(section[:3], [1.0, *section[3:]], [frequency], fs=RATE)[1][0])


@pytest.mark.parametrize("spec", SPECS, ids=repr)
def test_the_delay_is_the_lag_behind_a_ramp(spec):
    filtered = WrenchFilter((spec,), RATE)
    slope = np.array([1.0, -2.0, 0.5, 3.0, 0.1, -7.0])
    time = np.arange(settling(spec)) / RATE
    out = run(filtered, time[:, None] * slope)
    lag = time[-1] - out[-1] / slope
    np.testing.assert_allclose(lag, filtered.delay, rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize("relative", [1e-5, 1e-3, 0.1, 0.4])
def test_delay_and_noise_gain_are_the_stated_formulas(relative):
    """At equal delay d all low-passes leave equal noise, T/(2 d) of its variance."""
    K, T, f = math.tan(math.pi * relative), 1.0 / RATE, relative * RATE
    for spec, delay in (
        (Butterworth(f), T / (math.sqrt(2.0) * K)),
        (CriticallyDamped(f), T * math.sqrt(math.sqrt(2.0) - 1.0) / K),
        (FirstOrder(f), T / (2.0 * K)),
        (Notch(f, 4.0), T / (8.0 * K)),
    ):
        filtered = WrenchFilter((spec,), RATE)
        assert filtered.delay == pytest.approx(delay, rel=1e-5)
        if relative < 0.01 and not isinstance(spec, Notch):
            assert filtered.noise_gain**2 == pytest.approx(T / (2.0 * delay), rel=5e-3)


def test_filters_in_series_add_their_delays():
    whole, none = WrenchFilter(SPECS, RATE), WrenchFilter((), RATE)
    assert whole.delay == pytest.approx(sum(WrenchFilter((s,), RATE).delay for s in SPECS))
    assert (none.delay, none.noise_gain) == (0.0, 1.0)
    assert none.step((1.0, 2.0, 3.0, 4.0, 5.0, 6.0)) == (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)


@pytest.mark.parametrize("spec", SPECS, ids=repr)
def test_stated_frequencies_are_exact(spec):
    section = spec.section(RATE)
    if isinstance(spec, Notch):
        assert response(section, spec.center) < 1e-12
    else:
        assert response(section, spec.cutoff) == pytest.approx(math.sqrt(0.5), rel=1e-12)
    assert response(section, 0.0) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("relative", [1e-5, 0.01, 0.3])
def test_the_butterworth_is_scipys(relative):
    b, a = signal.butter(2, relative * RATE, fs=RATE)
    np.testing.assert_allclose(Butterworth(relative * RATE).section(RATE), [*b, *a[1:]], rtol=1e-9)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 1000), which=st.lists(st.sampled_from(SPECS), min_size=1, max_size=3))
def test_steps_are_the_difference_equation_and_channels_do_not_mix(seed, which):
    rows = np.random.default_rng(seed).normal(size=(200, 6))
    out = run(WrenchFilter(which, RATE), rows)
    for channel in range(6):
        x = rows[:, channel] - rows[0, channel]  # a filter at rest at the first sample
        for s in (spec.section(RATE) for spec in which):
            x = signal.lfilter(s[:3], [1.0, *s[3:]], x)
        np.testing.assert_allclose(out[:, channel], x + rows[0, channel], atol=1e-9)


@pytest.mark.parametrize("spec", [*SPECS, Butterworth(0.01)], ids=repr)
def test_a_constant_force_passes_unchanged_from_the_first_sample(spec):
    constant = np.tile([1.0, -2.0, 1e3, 1e-6, 0.0, 7.0], (500, 1))
    filtered = WrenchFilter((spec,), RATE)
    np.testing.assert_allclose(run(filtered, constant), constant, rtol=1e-9)
    filtered.restart()
    np.testing.assert_allclose(run(filtered, 5.0 * constant), 5.0 * constant, rtol=1e-9)


def test_only_the_critically_damped_and_first_order_never_overshoot():
    step = np.ones((2000, 6))
    for spec, most in ((CriticallyDamped(20.0), 1.0), (FirstOrder(20.0), 1.0), (Butterworth(20.0), 1.05)):
        filtered = WrenchFilter((spec,), RATE)
        filtered.start((0.0,) * 6)
        peak = run(filtered, step).max()
        assert peak <= most + 1e-9
    assert peak > 1.04


@pytest.mark.parametrize(
    "which", [(s,) for s in SPECS] + [(Butterworth(80.0), Notch(50.0, 3.0), FirstOrder(20.0))]
)
def test_the_noise_gain_is_the_energy_of_the_impulse_response(which):
    filtered = WrenchFilter(which, RATE)
    filtered.start((0.0,) * 6)
    impulse = np.zeros((max(settling(s) for s in which), 6))
    impulse[0] = 1.0
    energy = (run(filtered, impulse)[:, 0] ** 2).sum()
    assert filtered.noise_gain == pytest.approx(math.sqrt(energy), rel=1e-9)
