"""A device slower than its reader: what it repeats is neither dead nor new."""

import msgspec
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.sensing.ft import (
    Butterworth,
    CriticallyDamped,
    FirstOrder,
    FTPipeline,
    HealthCheck,
    WrenchFilter,
    read_sensor,
    sensor_text,
)
from palpate.sensing.ft.sensor_file import repeats
from sensing.ft.sensor_examples import fingertip

UP = (0.0, 0.0, 9.81)


def slow(device_rate, **changes):
    return msgspec.structs.replace(fingertip(), calibration=None, device_rate=device_rate, filters=(), **changes)


def healths(sensor, times, seed=0):
    """What is said of a device at rest whose readings come `times` times each."""
    rng, pipeline = np.random.default_rng(seed), FTPipeline(sensor)
    said = []
    for _ in range(40):
        reading = tuple((np.array(sensor.bias) + rng.normal(size=6) * sensor.noise).tolist())
        said += [pipeline.step(reading, UP).health.measure for _ in range(times)]
    return said


@given(rate=st.floats(10.0, 1000.0))
def test_each_sample_is_read_at_most_so_often(rate):
    """Counted: readers and devices on a time line, wherever the device's clock stands."""
    samples = np.floor((np.arange(5000) / 1000.0 + 1e-7) * rate)
    most = int(np.unique(samples, return_counts=True)[1].max())
    assert most <= repeats(1000.0, rate) + (rate > 1000.0 / 1.05)
    assert repeats(1000.0, rate) <= most + 1
    assert repeats(1000.0, None) == repeats(1000.0, 7000.0) == 1


def test_a_healthy_slow_device_is_not_dead_even_if_every_other_sample_gets_lost():
    for rate in (488.0, 125.0, 100.0, 20.0):
        assert set(healths(slow(rate), 2 * repeats(1000.0, rate))) == {HealthCheck.HEALTHY}


def test_a_dead_one_is_found_after_as_many_of_its_own_samples_as_a_quick_one():
    found = {rate: healths(slow(rate), 1200).index(HealthCheck.FROZEN) for rate in (None, 100.0, 500.0)}
    assert found[100.0] + 1 == 10 * (found[None] + 1)
    assert found[500.0] + 1 == 2 * (found[None] + 1)


@settings(max_examples=30, deadline=None)
@given(
    spec=st.sampled_from([Butterworth, CriticallyDamped, FirstOrder]),
    cutoff=st.floats(3.0, 400.0),
    times=st.integers(1, 50),
)
def test_a_filter_leaves_no_more_of_held_noise_than_is_stated(spec, cutoff, times):
    """Variance from the impulse response: each value acts through the sum of `times` neighbouring weights."""
    filters = WrenchFilter((spec(cutoff),), 1000.0)
    filters.start((0.0,) * 6)
    count = times * (4000 // times)
    response = [filters.step((float(k == 0), 0.0, 0.0, 0.0, 0.0, 0.0))[0] for k in range(count)]
    running = np.convolve(response, np.ones(times))
    # whatever the moment between two samples, on the average over them
    variance = np.mean([np.square(running[shift::times]).sum() for shift in range(times)])
    assert np.sqrt(variance) <= filters.held_noise_gain(times) * (1.0 + 1e-6) + 1e-9
    assert filters.held_noise_gain(1) == filters.noise_gain


def test_its_rate_is_in_the_file_and_reads_back():
    for rate in (125.0, None):
        text = sensor_text(slow(rate))
        assert ("device_rate_Hz: 125.0" in text) == ("device_rate_Hz" in text) == (rate is not None)
        assert read_sensor(text).device_rate == rate


def test_the_same_readings_give_the_same_bits_again():
    """What is remembered is only counts and filters: no clock, no identity of objects."""
    rng, sensor = np.random.default_rng(1), slow(100.0)
    readings = np.repeat(rng.normal(size=(200, 6)) * sensor.noise, 10, axis=0)
    one, other = FTPipeline(sensor), FTPipeline(sensor)
    assert [one.step(tuple(x), UP) for x in readings] == [other.step(tuple(x), UP) for x in readings.tolist()]
