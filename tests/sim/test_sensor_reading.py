"""What a simulated sensor makes of a load when it samples: bias, drift, noise, steps, limits, clock, losses."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from palpate.sim.sensor.model import SensorModel, noisy_sensor
from palpate.sim.sensor.simulation import ImperfectSensor, simulated_sensor
from palpate.sim.sensor.stages import (
    CrossTalk,
    Dropouts,
    FirstOrderLag,
    Quantisation,
    RandomWalk,
    SampleClock,
    Saturation,
    WhiteNoise,
    alike,
    drawn_cross_talk,
)
from palpate.sim.sensor.temperature import TemperatureProfile, ThermalDrift, WarmUp
from support.sensor_readings import DT, NOTHING, REST, readings, sampled

RARE = 1e-6
"""Chance that a right sensor fails a statistical check; seeds are fixed, so it fails always or never."""


def unlike(model, count):
    """Samples without the repeated ones."""
    samples = sampled(simulated_sensor(model, DT, 5), count)
    return [samples[0], *[b for a, b in pairwise(samples) if b is not a]]


def check_independent(values):
    """Check deviations of one that are independent in time: the chi-squared sum and the lagged correlation."""
    n = len(values)
    low, high = np.asarray(stats.chi2.ppf([RARE / 2, 1 - RARE / 2], n))
    assert np.all((low < (values**2).sum(axis=0)) & ((values**2).sum(axis=0) < high))
    lagged = max(abs(np.corrcoef(values[1:, i], values[:-1, i])[0, 1]) for i in range(6))
    assert lagged < stats.norm.isf(RARE / 2) / math.sqrt(n)


@pytest.mark.slow
def test_white_noise_is_gaussian_of_its_deviation_and_independent():
    n, sd = 20_000, (0.01, 0.02, 0.03, 1e-4, 2e-4, 3e-4)
    noise = readings(SensorModel(noise=WhiteNoise(sd)), n) / sd
    check_independent(noise)
    worst = stats.norm.isf(RARE / 2) / math.sqrt(n)
    assert np.abs(noise.mean(axis=0)).max() < worst
    assert np.abs(np.corrcoef(noise.T) - np.eye(6)).max() < worst
    assert min(stats.kstest(noise[:, i], "norm").pvalue for i in range(6)) > RARE


def test_a_random_walk_has_independent_steps_that_grow_with_the_root_of_time():
    rate = (0.1, 0.2, 0.3, 1e-3, 2e-3, 3e-3)
    for period in (1e-3, 4e-3):
        walk = readings(SensorModel(random_walk=RandomWalk(rate)), 20_001, period=period)
        assert np.all(walk[0] == 0.0)
        check_independent(np.diff(walk, axis=0) / (np.array(rate) * math.sqrt(period)))


def test_a_random_walk_goes_on_between_samples_of_a_slow_clock():
    model = SensorModel(random_walk=RandomWalk(alike(1.0, 1.0)), clock=SampleClock(50.0))
    walk = np.array([s.wrench for s in unlike(model, 100_000)])
    steps = np.diff(walk, axis=0) / math.sqrt(1 / 50.0)
    assert np.allclose(steps.std(axis=0), 1.0, atol=5 / math.sqrt(2 * len(steps)))


@given(st.lists(st.floats(-20, 20), min_size=6, max_size=6), st.floats(1e-4, 0.5))
def test_quantised_readings_are_whole_steps_at_most_half_a_step_off(load, step):
    shown = readings(SensorModel(quantisation=Quantisation(alike(step, 0.0))), 1, tuple(load))[0]
    assert np.allclose(shown[:3] / step, np.round(shown[:3] / step), atol=1e-9)
    assert np.abs(shown[:3] - load[:3]).max() <= step / 2 * (1 + 1e-9)
    assert tuple(shown[3:]) == tuple(load[3:])


@pytest.mark.parametrize("step_over_sd", [0.3, 1.0, 2.0])
def test_a_model_states_the_noise_that_its_readings_have(step_over_sd):
    n, sd = 20_000, 0.01
    model = replace(noisy_sensor(sd, sd), quantisation=Quantisation(alike(step_over_sd * sd, step_over_sd * sd)))
    shown = readings(model, n, (0.0037,) * 6)
    assert np.allclose(shown.std(axis=0) / model.noise_sd, 1.0, atol=5 / math.sqrt(2 * n))


@given(st.lists(st.floats(-100, 100), min_size=6, max_size=6), st.integers(0, 1000))
def test_no_reading_is_beyond_the_limit_and_what_is_well_within_is_kept(load, seed):
    limit = (12.6, 12.6, 17.85, 0.126, 0.126, 0.126)
    model = SensorModel(
        noise=WhiteNoise(alike(0.01, 1e-4)),
        quantisation=Quantisation(alike(0.5, 0.005)),  # so coarse that rounding alone would exceed the limit
        saturation=Saturation(limit),
    )
    shown = readings(model, 1, tuple(load), seed)[0]
    assert np.all(np.abs(shown) <= limit)
    beyond = np.abs(load) > np.array(limit) + alike(0.6, 0.006)
    assert np.all(shown[beyond] == (np.sign(load) * limit)[beyond])


def test_a_bias_is_added_whatever_the_load_and_not_mixed_nor_slowed_down():
    bias = (0.1, -0.2, 0.3, 0.01, -0.02, 0.03)
    talk = drawn_cross_talk((10.0,) * 6, alike(0.1, 0.1), 3)
    model = SensorModel(bias=bias, cross_talk=talk, bandwidth=FirstOrderLag(1.0))
    assert np.allclose(readings(model, 50), bias, rtol=0, atol=0)


@given(st.floats(-20, 20), st.floats(0.01, 1000), st.floats(0, 2000))
def test_a_warm_up_ends_at_its_rise_with_its_time_constant(rise, constant, time):
    model = SensorModel(thermal_drift=ThermalDrift((0.1, 0.0, -0.2, 0.0, 0.0, 1e-3), WarmUp(rise, constant)))
    shown = ImperfectSensor(model, DT).step(time, NOTHING, REST).wrench
    warmth = rise * (1 - math.exp(-time / constant))
    assert shown == pytest.approx((0.1 * warmth, 0.0, -0.2 * warmth, 0.0, 0.0, 1e-3 * warmth), rel=1e-9, abs=1e-14)


@given(st.lists(st.tuples(st.floats(0.01, 100), st.floats(-30, 30)), min_size=1, max_size=9))
def test_a_temperature_profile_is_followed_as_it_is_given(points):
    times, rises = tuple(np.cumsum([t for t, _ in points]).tolist()), tuple(r for _, r in points)
    between = [0.3 * a + 0.7 * b for a, b in pairwise(times)]
    model = SensorModel(thermal_drift=ThermalDrift(alike(1.0, 0.5), TemperatureProfile(times, rises)))
    sensor = ImperfectSensor(model, DT)
    for time in sorted([-1.0, 0.0, *times, *between, times[-1] + 50.0]):
        expected = np.interp(time, times, rises)
        shown = sensor.step(time, NOTHING, REST).wrench
        assert shown == pytest.approx(alike(expected, 0.5 * expected), rel=1e-9, abs=1e-9)


def test_drift_is_that_of_the_time_of_the_stamp():
    drift = ThermalDrift(alike(1.0, 1.0), TemperatureProfile((0.0, 10.0), (0.0, 10.0)))
    sensor = ImperfectSensor(SensorModel(thermal_drift=drift, latency=0.3e-3, clock=SampleClock(300.0)), DT)
    for k in range(100):
        sample = sensor.step(1.0 + DT * k, NOTHING, REST)
        assert sample.wrench == pytest.approx((sample.time,) * 6, rel=1e-12)


@settings(max_examples=50, deadline=None)
@given(st.floats(20.0, 20_000.0), st.floats(0.0, 0.01), st.floats(0.0, 5e-3))
def test_the_newest_sample_of_the_devices_clock_that_has_arrived_is_shown(rate, offset, latency):
    sensor = ImperfectSensor(SensorModel(clock=SampleClock(rate, offset), latency=latency), DT)
    for k in range(80):
        t = DT * k
        sample = sensor.step(t, (t, 0.0, 0.0, 0.0, 0.0, 0.0), REST)
        tick = (sample.time - offset) * rate
        assert tick == pytest.approx(round(tick), abs=1e-5)  # it is one of the clock's
        age = t - latency - sample.time
        assert -1e-12 <= age <= (1 + 1e-5) / rate  # it has arrived, and no later one has
        assert sample.wrench[0] == pytest.approx(max(sample.time, 0.0), abs=1e-12)


def test_a_slow_device_repeats_the_same_sample_until_the_next():
    sensor = ImperfectSensor(replace(noisy_sensor(0.1, 1e-3), clock=SampleClock(100.0)), DT)
    samples = sampled(sensor, 200)
    assert [s.time for s in samples] == pytest.approx([0.01 * (k // 10) for k in range(200)])
    assert all(samples[k] is samples[k - k % 10] for k in range(200))
    assert len({s.wrench for s in samples}) == 20


@pytest.mark.parametrize("every", [1, 2, 3, 4, 5, 7, 8, 10])
def test_a_clock_in_step_with_its_reader_misses_no_beat_by_rounding(every):
    sensor = ImperfectSensor(SensorModel(clock=SampleClock(1000.0 / every)), DT)
    stamps = np.array([sample.time for sample in sampled(sensor, 5000)])
    assert np.allclose(stamps, DT * (np.arange(5000) // every * every), rtol=0.0, atol=1e-9)


@pytest.mark.parametrize(
    ("probability", "clock"),
    [
        (0.01, SampleClock(1000.0)),
        (0.9, None),
        (0.3, None),
        (0.3, SampleClock(7000.0, 0.2e-4)),
        (0.9, SampleClock(7000.0, 0.2e-4)),
        (0.01, SampleClock(130.0)),
        (0.3, SampleClock(130.0)),
    ],
)
def test_samples_are_lost_as_often_as_stated_each_by_itself(probability, clock):
    n = 20_000
    model = SensorModel(dropouts=Dropouts(probability), clock=clock, latency=0.4e-3)
    stamps = np.array([sample.time for sample in sampled(simulated_sensor(model, DT, 7), n)])
    assert np.all(np.diff(stamps) >= 0.0)
    rate, offset = (clock.rate, clock.offset) if clock else (1000.0, 0.0)
    # how many ticks old the newest sample is: k with the probability (1 - p) p^k
    newest = np.floor((DT * np.arange(n) - (0.4e-3 if clock else 0.0) - offset) * rate + 1e-6)
    behind = np.rint(newest - (stamps - offset + (0.0 if clock else 0.4e-3)) * rate)[100:]
    sd = math.sqrt(probability * (1 - probability) * max(1.0, 1000.0 / rate) / len(behind))
    correlated = math.sqrt((1 + probability) / (1 - probability))  # a loss lasts
    assert (behind > 0).mean() == pytest.approx(probability, abs=5 * sd * correlated)
    assert (behind > 1).mean() == pytest.approx(probability**2, abs=5 * sd * correlated)


def test_what_is_noise_at_a_moment_does_not_depend_on_what_is_lost():
    noisy = noisy_sensor(0.1, 1e-3)
    models = noisy, replace(noisy, dropouts=Dropouts(0.4))
    whole, broken = (sampled(ImperfectSensor(model, DT, 3), 1000) for model in models)
    assert all(b.time < a.time or a == b for a, b in zip(whole, broken, strict=True))


def test_stages_come_in_the_order_that_is_written_down():
    """3 N on x, mixed to y, biased by 0.4: rounded to 3 and 1 after that, and y cut at 0.9 at the very end."""
    matrix = np.eye(6)
    matrix[1, 0] = 0.2
    model = SensorModel(
        cross_talk=CrossTalk(tuple(map(tuple, matrix))),
        bias=alike(0.4, 0.0),
        quantisation=Quantisation(alike(1.0, 0.0)),
        saturation=Saturation((9.0, 0.9, 9.0, 1.0, 1.0, 1.0)),
    )
    assert tuple(readings(model, 1, (3.0, 0.0, 0.0, 0.0, 0.0, 0.0))[0]) == (3.0, 0.9, 0.0, 0.0, 0.0, 0.0)


def test_a_load_that_is_no_number_is_shown_as_it_is():
    sensor = ImperfectSensor(replace(noisy_sensor(0.1, 1e-3), saturation=Saturation(alike(10.0, 1.0))), DT)
    shown = sensor.step(0.0, (math.nan, 0.0, 0.0, 0.0, 0.0, 0.0), REST).wrench
    assert math.isnan(shown[0])
    assert math.isfinite(shown[1])
