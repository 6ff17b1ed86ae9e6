"""The pipeline of a force/torque sensor: calibration, payload, filters, health, and what a step costs."""

import math
import sys

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.sensing.compensation import contact_wrench
from palpate.sensing.ft import (
    HEALTHY,
    Butterworth,
    ContactEntry,
    FTPipeline,
    HealthCheck,
    PayloadEntry,
    average_bias,
    bias_covariance,
    read_sensor,
    sensor_text,
    touch_uncertainty,
)
from palpate.sensing.ft.compiled import filtered, sample
from sensing.ft.sensor_examples import fingertip

UP = (0.0, 0.0, 9.81)


def reading(sensor, contact, acceleration, rng):
    """What the channels show: the pipeline backwards, written with arrays, with a grain of noise."""
    payload = sensor.payload.payload
    weight = -payload.mass * np.asarray(acceleration)
    load = contact + np.hstack([weight, np.cross(payload.center_of_mass, weight)]) + sensor.bias
    if sensor.calibration is None:
        return tuple((load + 1e-12 * rng.normal(size=6)).tolist())
    raw = np.linalg.pinv(np.array(sensor.calibration.matrix)) @ load + sensor.calibration.offset
    return tuple((raw + 1e-12 * rng.normal(size=len(raw))).tolist())


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10_000), channels=st.sampled_from([0, 6, 8]))
def test_a_steady_contact_is_felt_whatever_hangs_on_the_sensor(seed, channels):
    rng = np.random.default_rng(seed)
    sensor = fingertip(channels) if channels else msgspec.structs.replace(fingertip(), calibration=None)
    pipeline, contact = FTPipeline(sensor), rng.uniform(-0.3, 0.3, 6) * sensor.axis_limits
    acceleration = tuple(rng.normal(size=3) * 10.0)
    for _ in range(10):
        felt = pipeline.step(reading(sensor, contact, acceleration, rng), acceleration)
    np.testing.assert_allclose(felt.wrench, contact, atol=1e-8)
    assert felt.touching == (np.linalg.norm(contact[:3]) > sensor.contact.touch_force)
    assert felt.health is HEALTHY


def test_shaking_the_sensor_is_no_contact():
    """Load and acceleration are delayed alike, so that the filter leaves no remainder of inertia."""
    sensor, rng = fingertip(), np.random.default_rng(0)
    pipeline = FTPipeline(sensor)
    for k in range(500):
        shake = (20.0 * math.sin(0.3 * k), 0.0, 9.81 + 20.0 * math.cos(0.7 * k))
        felt = pipeline.step(reading(sensor, (0.0,) * 6, shake, rng), shake)
        np.testing.assert_allclose(felt.wrench, 0.0, atol=1e-8)
        assert not felt.touching


def test_the_delay_is_the_lag_behind_a_growing_force():
    sensor, rng, slope = fingertip(), np.random.default_rng(0), 4.0
    pipeline = FTPipeline(sensor)
    for k in range(1000):
        felt = pipeline.step(reading(sensor, (0.0, 0.0, -slope * 1e-3 * k, 0.0, 0.0, 0.0), UP, rng), UP)
    lag = 1e-3 * 999 + felt.wrench[2] / slope
    assert pipeline.delay - sensor.device_delay == pytest.approx(lag, rel=1e-6)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_bad_number_is_reported_and_leaves_no_trace(bad):
    sensor, rng = fingertip(), np.random.default_rng(0)
    clean, hit = FTPipeline(sensor), FTPipeline(sensor)
    readings = [reading(sensor, 0.01 * rng.normal(size=6), UP, rng) for _ in range(50)]
    before = [(clean.step(raw, UP), hit.step(raw, UP)) for raw in readings[:25]][-1][0]
    spoiled = hit.step((0.0, bad, 0.0, 0.0, 0.0, 0.0), UP)
    beyond = hit.step((0.0, 1e300, 0.0, 0.0, 0.0, 0.0), UP)
    shaken = hit.step(readings[0], (0.0, bad, 0.0))
    assert spoiled.health.measure is HealthCheck.NON_FINITE
    assert (shaken.health.measure, shaken.health.where) == (HealthCheck.IMPOSSIBLE, "acceleration")
    assert spoiled.wrench == beyond.wrench == shaken.wrench == before.wrench
    assert [hit.step(raw, UP) for raw in readings[25:]] == [clean.step(raw, UP) for raw in readings[25:]]


@settings(max_examples=200, deadline=None)
@given(st.lists(st.floats(), min_size=6, max_size=6), st.lists(st.floats(), min_size=3, max_size=3))
def test_no_reading_makes_a_wrench_that_is_not_finite(raw, acceleration):
    pipeline = FTPipeline(fingertip())
    for given_raw in (raw, [0.0] * 6, raw):
        felt = pipeline.step(given_raw, tuple(acceleration))
        assert all(map(math.isfinite, felt.wrench))
        assert felt.health is HEALTHY or not felt.health.ok
        if not all(map(math.isfinite, given_raw)):
            assert felt.health.measure is HealthCheck.NON_FINITE


def test_overload_saturation_and_drift_reach_the_caller():
    sensor, rng, pull = fingertip(), np.random.default_rng(0), (0.0, 0.0, -20.0, 0.0, 0.0, 0.0)
    pipeline = FTPipeline(sensor)
    assert pipeline.step(reading(sensor, pull, UP, rng), UP).health.measure is HealthCheck.SATURATED
    wrenches = msgspec.structs.replace(sensor, calibration=None)
    health = FTPipeline(wrenches).step(reading(wrenches, pull, UP, rng), UP).health
    assert (health.measure, health.where) == (HealthCheck.OVERLOAD_AXIS, "Fz")
    pipeline.restart()
    light = reading(sensor, (0.07, 0.0, 0.0, 0.0, 0.0, 0.0), UP, rng) + 1e-12 * rng.normal(size=(5001, 6))
    found = [pipeline.step(tuple(raw), UP).health.measure for raw in light.tolist()]
    assert found[:4999] == [HealthCheck.HEALTHY] * 4999
    assert found[-1] is HealthCheck.DRIFT


def test_the_noise_gain_of_the_filters_counts_for_a_touch_force():
    """Behind 20 Hz a threshold is far above the noise that is refused without."""
    deaf = ContactEntry(touch_force=0.012, release_force=0.01)
    FTPipeline(msgspec.structs.replace(fingertip(), contact=deaf, filters=(Butterworth(20.0),)))


def test_a_step_makes_less_than_a_hundred_calls_and_none_of_numpy():
    """That takes some 15 us (benchmarks/costs), where a call of numpy alone takes one or more."""
    sensor, rng, calls = fingertip(8), np.random.default_rng(0), []
    pipeline = FTPipeline(sensor)

    def note(frame, event, called):
        if event in ("call", "c_call"):
            calls.append(getattr(called, "__module__", None) or frame.f_code.co_filename)

    for _ in range(200):
        raw = reading(sensor, 0.01 * rng.normal(size=6), UP, rng)
        calls.clear()
        sys.setprofile(note)
        pipeline.step(raw, UP)
        sys.setprofile(None)
        assert 0 < len(calls) < 100
        assert not any("numpy" in name for name in calls)


def test_a_tare_counts_the_uncertainty_of_the_payload():
    """The bias hides the error of the weight in that pose; turned over, the tip feels twice as much."""
    payload = PayloadEntry(mass=0.5, center_of_mass=(0.0, 0.0, 0.03), mass_sd=0.002, center_of_mass_sd=(1e-3,) * 3)
    sensor = msgspec.structs.replace(fingertip(), payload=payload)
    rng = np.random.default_rng(0)
    found = average_bias(rng.normal(size=(1000, 6)) * 1e-3, noise=np.full(6, 1e-3))
    sd = np.sqrt(np.diag(bias_covariance(sensor, found, (0.0, 0.0, 9.8))))
    assert sd[:2] == pytest.approx(found.standard_error[:2])
    assert sd[2] == pytest.approx(9.8 * 0.002, rel=0.01)
    assert sd[3:5] == pytest.approx(9.8 * 0.5 * 1e-3, rel=0.01)
    assert touch_uncertainty(sensor, found, (0.0, 0.0, 9.8)) == pytest.approx(2.0 * 9.8 * 0.002, rel=0.01)
    assert read_sensor(sensor_text(sensor)) == sensor


# --- the compiled sample is bit for bit that of plain Python ---


def in_python(sections, states, wrench):
    """Transposed direct form II, section after section."""
    for (b0, b1, b2, a1, a2), (first, second) in zip(sections, states, strict=True):
        out = []
        for i, x in enumerate(wrench):
            y = b0 * x + first[i]
            first[i], second[i] = b1 * x - a1 * y + second[i], b2 * x - a2 * y
            out.append(y)
        wrench = tuple(out)
    return wrench


@pytest.mark.parametrize("channels", [6, 8])
def test_the_compiled_sample_is_that_of_python_bit_for_bit(channels):
    sensor, rng = fingertip(channels), np.random.default_rng(1)
    pipeline = FTPipeline(sensor)
    sections = pipeline._filter.sections
    for k in range(200):
        raw, acceleration = (tuple(rng.normal(scale=s, size=n).tolist()) for s, n in ((1.0, channels), (9.81, 3)))
        load = np.subtract(sensor.calibration.map.step(raw), sensor.bias).tolist()
        wrench = contact_wrench(load, acceleration, sensor.payload.payload)
        if k == 0:
            states = [([(1.0 - s.b0) * x for x in wrench], [(s.b2 - s.a2) * x for x in wrench]) for s in sections]
        assert pipeline.step(raw, acceleration).wrench == in_python(sections, states, wrench)


def test_a_step_compiles_nothing():
    pipeline = FTPipeline(fingertip())
    before = [list(kernel.signatures) for kernel in (filtered, sample)]
    for raw in ((0.1,) * 6, [0.1] * 6, np.full(6, 0.1), (0, 0, 0, 0, 0, 1), (np.nan,) * 6, (1e200,) * 6):
        pipeline.step(raw, (0, 0, 9.81))
    assert [list(kernel.signatures) for kernel in (filtered, sample)] == before


@pytest.mark.parametrize("channel", range(6))
def test_a_load_about_a_limit_is_judged_as_in_words(channel):
    """The compiled comparison stays clear of the limit, and leaves what is near to the words."""
    sensor = msgspec.structs.replace(fingertip(), calibration=None, bias_force=(0.0,) * 3, bias_moment=(0.0,) * 3)
    for factor, ok in ((1.0 - 1e-15, True), (1.0 - 1e-8, True), (1.0, True), (1.0 + 1e-15, False), (1.1, False)):
        load = factor * np.array(sensor.axis_limits) * np.eye(6)[channel]
        assert FTPipeline(sensor).step(tuple(load.tolist()), UP).health.ok is ok
