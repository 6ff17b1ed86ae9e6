"""Filters of wrenches: stated delays, frequencies and noise gains are exact, also where devices repeat values."""

import math

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from palpate.sensing.ft import FTPipeline, HealthCheck, read_sensor, sensor_text
from palpate.sensing.ft.filter_specs import Butterworth, CriticallyDamped, FirstOrder, Notch
from palpate.sensing.ft.filters import WrenchFilter
from palpate.sensing.ft.sensor_file import repeats
from sensing.ft.sensor_examples import fingertip

RATE, UP = 1000.0, (0.0, 0.0, 9.81)
LOW_PASSES = (Butterworth, CriticallyDamped, FirstOrder)
SPECS = [
    *(kind(cutoff) for kind in LOW_PASSES for cutoff in (5.0, 60.0, 400.0)),
    Notch(50.0, 3.0),
    Notch(120.0, 30.0),
]


def run(specs, rows, at_rest=False):
    """Output for inputs of shape (n, 6), from the first input or from zero."""
    filtered = WrenchFilter(specs, RATE)
    if at_rest:
        filtered.start((0.0,) * 6)
    return filtered, np.array([filtered.step(tuple(row)) for row in rows.tolist()])


def impulse(count):
    return np.eye(count, 6)[:, :1] * np.ones(6)


def settling(spec):
    """Samples after which the start has no influence any more."""
    section = spec.section(RATE)
    slowest = max(abs(np.roots([1.0, section.a1, section.a2])))
    return int(60.0 / -math.log(slowest)) + 10


@pytest.mark.parametrize("spec", SPECS, ids=repr)
def test_the_delay_is_the_lag_behind_a_ramp_and_stated_frequencies_are_exact(spec):
    slope, time = np.array([1.0, -2.0, 0.5, 3.0, 0.1, -7.0]), np.arange(settling(spec)) / RATE
    filtered, out = run((spec,), time[:, None] * slope)
    np.testing.assert_allclose(time[-1] - out[-1] / slope, filtered.delay, rtol=1e-6, atol=1e-12)
    section = spec.section(RATE)
    named, gain = (spec.center, 0.0) if isinstance(spec, Notch) else (spec.cutoff, math.sqrt(0.5))
    response = np.abs(signal.freqz(section[:3], [1.0, *section[3:]], [0.0, named], fs=RATE)[1])
    np.testing.assert_allclose(response, [1.0, gain], rtol=0.0, atol=7e-13)


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


@pytest.mark.parametrize("relative", [1e-5, 0.01, 0.3])
def test_the_butterworth_is_scipys(relative):
    b, a = signal.butter(2, relative * RATE, fs=RATE)
    np.testing.assert_allclose(Butterworth(relative * RATE).section(RATE), [*b, *a[1:]], rtol=1e-9)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 1000), which=st.lists(st.sampled_from(SPECS), min_size=1, max_size=3))
def test_steps_are_the_difference_equation_and_channels_do_not_mix(seed, which):
    rows = np.random.default_rng(seed).normal(size=(200, 6))
    x = rows - rows[0]  # a filter at rest at the first sample
    for s in (spec.section(RATE) for spec in which):
        x = signal.lfilter(s[:3], [1.0, *s[3:]], x, axis=0)
    np.testing.assert_allclose(run(which, rows)[1], x + rows[0], atol=1e-9)


@pytest.mark.parametrize("spec", [*SPECS, Butterworth(0.01)], ids=repr)
def test_a_constant_force_passes_unchanged_from_the_first_sample(spec):
    constant = np.tile([1.0, -2.0, 1e3, 1e-6, 0.0, 7.0], (500, 1))
    filtered, out = run((spec,), constant)
    np.testing.assert_allclose(out, constant, rtol=1e-9)
    filtered.restart()
    again = [filtered.step(tuple(row)) for row in (5.0 * constant).tolist()]
    np.testing.assert_allclose(again, 5.0 * constant, rtol=1e-9)


def test_only_the_critically_damped_and_first_order_never_overshoot():
    peaks = [run((kind(20.0),), np.ones((2000, 6)), at_rest=True)[1].max() for kind in LOW_PASSES]
    assert 1.04 < peaks[0] <= 1.05
    assert max(peaks[1:]) <= 1.0 + 1e-9


@pytest.mark.parametrize(
    "which", [(s,) for s in SPECS] + [(Butterworth(80.0), Notch(50.0, 3.0), FirstOrder(20.0))]
)
def test_the_noise_gain_is_the_energy_of_the_impulse_response(which):
    filtered, out = run(which, impulse(max(settling(s) for s in which)), at_rest=True)
    assert filtered.noise_gain == pytest.approx(math.sqrt((out[:, 0] ** 2).sum()), rel=1e-9)


# --- devices slower than their readers: a repeated value is neither dead nor new ---


def slow(device_rate):
    return msgspec.structs.replace(fingertip(), calibration=None, device_rate=device_rate, filters=())


def healths(sensor, times):
    """Health checks of a device at rest whose readings come `times` times each."""
    rng, pipeline = np.random.default_rng(0), FTPipeline(sensor)
    readings = [tuple((np.array(sensor.bias) + rng.normal(size=6) * sensor.noise).tolist()) for _ in range(40)]
    return [pipeline.step(reading, UP).health.measure for reading in readings for _ in range(times)]


@given(rate=st.floats(10.0, 1000.0))
def test_each_sample_is_read_at_most_so_often(rate):
    """Counted: readers and devices on a time line, wherever the device's clock stands."""
    samples = np.floor((np.arange(5000) / 1000.0 + 1e-7) * rate)
    most = int(np.unique(samples, return_counts=True)[1].max())
    assert most <= repeats(1000.0, rate) + (rate > 1000.0 / 1.05)
    assert repeats(1000.0, rate) <= most + 1
    assert repeats(1000.0, None) == repeats(1000.0, 7000.0) == 1


def test_a_slow_device_is_healthy_though_every_other_sample_gets_lost_and_dead_after_its_own_samples():
    for rate in (488.0, 125.0, 100.0, 20.0):
        assert set(healths(slow(rate), 2 * repeats(1000.0, rate))) == {HealthCheck.HEALTHY}
    quick, tenth, half = (healths(slow(rate), 1200).index(HealthCheck.FROZEN) for rate in (None, 100.0, 500.0))
    assert (tenth + 1, half + 1) == (10 * (quick + 1), 2 * (quick + 1))


@settings(max_examples=30, deadline=None)
@given(spec=st.sampled_from(LOW_PASSES), cutoff=st.floats(3.0, 400.0), times=st.integers(1, 50))
def test_a_filter_leaves_no_more_of_held_noise_than_is_stated(spec, cutoff, times):
    """Variance from the impulse response: each value acts through the sum of `times` neighbouring weights."""
    filtered, out = run((spec(cutoff),), impulse(times * (4000 // times)), at_rest=True)
    running = np.convolve(out[:, 0], np.ones(times))
    # whatever the moment between two samples, on the average over them
    variance = np.mean([np.square(running[shift::times]).sum() for shift in range(times)])
    assert np.sqrt(variance) <= filtered.held_noise_gain(times) * (1.0 + 1e-6) + 1e-9
    assert filtered.held_noise_gain(1) == filtered.noise_gain


@pytest.mark.parametrize("rate", [125.0, None])
def test_the_rate_of_the_device_is_in_the_file_and_reads_back(rate):
    text = sensor_text(slow(rate))
    assert ("device_rate_Hz: 125.0" in text) == ("device_rate_Hz" in text) == (rate is not None)
    assert read_sensor(text).device_rate == rate


def test_equal_readings_give_equal_bits():
    """A pipeline remembers counts and filters alone: no clock, no identity of objects."""
    sensor = slow(100.0)
    readings = np.repeat(np.random.default_rng(1).normal(size=(200, 6)) * sensor.noise, 10, axis=0)
    one, other = FTPipeline(sensor), FTPipeline(sensor)
    assert [one.step(tuple(x), UP) for x in readings] == [other.step(tuple(x), UP) for x in readings.tolist()]
