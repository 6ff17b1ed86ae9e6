"""What a simulated sensor makes of a load before it samples: cross-talk, bandwidth, latency, acceleration."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from palpate.sensing.compensation import SensorPayload, contact_wrench
from palpate.sim.sensor.model import SensorModel
from palpate.sim.sensor.simulation import ImperfectSensor, PerfectSensor, simulated_sensor
from palpate.sim.sensor.stages import (
    FirstOrderLag,
    SampleClock,
    SecondOrderLag,
    alike,
    drawn_cross_talk,
)

REST = (0.0, 0.0, 9.81)
RATED = (12.0, 12.0, 17.0, 0.12, 0.12, 0.12)
LAGS = st.one_of(
    st.builds(FirstOrderLag, st.floats(0.5, 5000.0)),
    st.builds(SecondOrderLag, st.floats(0.5, 5000.0), st.floats(0.02, 1.0)),
)


def same_on_all(x):
    return (x,) * 6


def stepped(model, times, load, period=None):
    """Samples of a load (of time, wrench) at the times, acceleration (load, 0, 9.81)."""
    sensor = simulated_sensor(model, period or min(np.diff(times)))
    return [sensor.step(t, load(t), (load(t)[0], 0.0, 9.81)) for t in times]


def followed(lag, times, values, asked):
    """A lag's answer to straight pieces of load, by the matrix exponential of (y, y', u, slope)."""
    if isinstance(lag, FirstOrderLag):
        w = 2 * math.pi * lag.cutoff
        A = np.array([[-w, 0.0, w, 0.0], [0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 0.0]])
    else:
        w, z = 2 * math.pi * lag.natural_frequency, lag.damping
        A = np.array([[0, 1, 0, 0], [-w * w, -2 * z * w, w * w, 0], [0, 0, 0, 1], [0, 0, 0, 0]], dtype=float)
    state = np.array([values[0], 0.0, values[0], 0.0])
    for t, u, t_next, u_next in zip(times, values, times[1:], values[1:], strict=False):
        state[2:] = u, (u_next - u) / (t_next - t)
        if asked <= t_next:
            return (expm(A * (asked - t)) @ state)[0]
        state = expm(A * (t_next - t)) @ state
    return state[0]


def test_a_sensor_without_imperfections_shows_the_load_itself():
    assert isinstance(simulated_sensor(SensorModel(), 1e-3), PerfectSensor)
    w = (1.0, -2.0, 3.0, 0.1, -0.2, 0.3)
    for sensor in (PerfectSensor(), ImperfectSensor(SensorModel(), 1e-3)):
        samples = [sensor.step(1e-3 * k, w, REST) for k in range(5)]
        shown = [(sample.time, sample.wrench, sample.acceleration) for sample in samples]
        assert shown == [(1e-3 * k, w, REST) for k in range(5)]


@given(st.integers(0, 10_000), st.lists(st.floats(-10, 10), min_size=6, max_size=6))
def test_cross_talk_shows_m_times_the_load_and_leaves_the_acceleration(specimen, load):
    talk = drawn_cross_talk(RATED, alike(0.02, 0.03), specimen)
    sample = ImperfectSensor(SensorModel(cross_talk=talk), 1e-3).step(0.0, tuple(load), REST)
    assert np.allclose(sample.wrench, np.array(talk.matrix) @ load, rtol=1e-14, atol=1e-14)
    assert sample.acceleration == REST


@given(st.integers(0, 10_000), st.integers(0, 5))
def test_a_full_load_on_one_axis_shifts_each_axis_by_no_more_than_its_share(specimen, axis):
    share = np.array([0.01, 0.02, 0.03, 0.04, 0.05, 0.06])
    error = np.array(drawn_cross_talk(RATED, tuple(share), specimen).matrix) - np.eye(6)
    assert np.all(np.abs(error[:, axis]) * RATED[axis] <= share * RATED * (1 + 1e-12))


@settings(deadline=None, max_examples=60)
@given(
    LAGS,
    st.floats(0.0, 0.004),
    st.lists(st.tuples(st.floats(1e-4, 3e-3), st.floats(-10.0, 10.0)), min_size=2, max_size=12),
)
def test_a_load_of_straight_pieces_is_followed_and_delayed_exactly(lag, latency, pieces):
    times = [0.0, *np.cumsum([h for h, _ in pieces]).tolist()]
    values = [0.5, *[v for _, v in pieces]]
    model = SensorModel(bandwidth=lag, latency=latency)
    sensor = ImperfectSensor(model, 1e-4)
    for t, v in zip(times, values, strict=True):
        sample = sensor.step(t, same_on_all(v), (v, 0.0, 9.81))
        assert sample.time == t - latency
        expected = 0.5 if sample.time <= 0.0 else followed(lag, times, values, sample.time)
        # the ramp that is followed at a distance slope/w is a large number where the pieces are short
        assert sample.wrench == pytest.approx(same_on_all(expected), abs=1e-9)
        assert sample.acceleration == pytest.approx((expected, 0.0, 9.81), abs=1e-9)


@settings(deadline=None, max_examples=30)
@given(
    st.one_of(
        st.builds(FirstOrderLag, st.floats(5.0, 5000.0)),
        st.builds(SecondOrderLag, st.floats(5.0, 5000.0), st.floats(0.3, 1.0)),
    )
)
def test_a_steadily_growing_load_is_shown_late_by_the_lag_that_the_model_states(lag):
    period = lag.lag
    model = SensorModel(bandwidth=lag, latency=0.7 * period)
    sensor = ImperfectSensor(model, period)
    for k in range(201):
        sample = sensor.step(k * period, same_on_all(k * period), REST)
    assert sample.time - sample.wrench[0] == pytest.approx(model.lag, rel=1e-9)
    assert 200 * period - sample.wrench[0] == pytest.approx(model.delay, rel=1e-9)


@settings(deadline=None, max_examples=40)
@given(LAGS, st.floats(0.0, 5e-3), st.floats(50.0, 8000.0), st.floats(0.0, 1e-3))
def test_weight_and_inertia_come_off_exactly_whatever_the_sensor_delays(lag, latency, rate, offset):
    """The acceleration of a sample belongs to its wrench: without contact, nothing is left of the payload."""
    payload = SensorPayload(0.2, (0.01, -0.02, 0.03))
    model = SensorModel(bandwidth=lag, latency=latency, clock=SampleClock(rate, offset))
    sensor = ImperfectSensor(model, 1e-3)
    for k in range(60):
        a = (math.sin(300e-3 * k), 5.0 * math.cos(170e-3 * k), 9.81 + math.sin(11e-3 * k))
        x, y, z, u, v, w = contact_wrench((0.0,) * 6, a, payload)  # what takes it off
        sample = sensor.step(1e-3 * k, (-x, -y, -z, -u, -v, -w), a)
        assert contact_wrench(sample.wrench, sample.acceleration, payload) == pytest.approx((0.0,) * 6, abs=1e-9)


@settings(deadline=None, max_examples=30)
@given(LAGS, st.floats(20.0, 3000.0), st.floats(0.0, 3e-3), st.integers(0, 1000))
def test_reading_more_often_tells_the_same(lag, rate, latency, seed):
    """The load is the same straight pieces, given at more points of them: so is what the device's clock picks."""
    course = np.random.default_rng(seed).normal(size=30)
    model = SensorModel(bandwidth=lag, latency=latency, clock=SampleClock(rate))
    coarse = stepped(
        model, 1e-3 * np.arange(30), lambda t: same_on_all(np.interp(t, 1e-3 * np.arange(30), course))
    )
    fine_times = np.arange(30 * 4 - 3) * 0.25e-3
    fine = stepped(model, fine_times, lambda t: same_on_all(np.interp(t, 1e-3 * np.arange(30), course)))
    by_stamp = {round(s.time, 12): s for s in fine}
    for sample in coarse:
        assert sample.wrench == pytest.approx(by_stamp[round(sample.time, 12)].wrench, abs=1e-8)
