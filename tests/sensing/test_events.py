"""Landing and lift-off: found once each, at the right time, whatever the sampling and the noise."""

import math

import hypothesis
import numpy as np
import pytest
from hypothesis import strategies as st

from palpate.errors import InvalidValueError
from palpate.sensing.events import ContactEvents, EventParameters, Landing, LandingPeak, LiftOff


def events_of(force, period=1e-3, **parameters):
    detector = ContactEvents(EventParameters(**parameters))
    return [event for i, f in enumerate(force) for event in detector.step(i * period, f)]


def kinds(events):
    return [type(event) for event in events]


def ramps(t, start, up, end, down, top):
    """Force that rises from `start` at `up` N/s to `top` and falls to zero at `end` with `down` N/s."""
    return np.clip(np.minimum((t - start) * up, (end - t) * down), 0.0, top)


@hypothesis.settings(max_examples=100, deadline=None, derandomize=True)
@hypothesis.given(st.floats(5, 200), st.floats(5, 200), st.floats(2e-4, 3e-3), st.floats(0, 1))
def test_times_are_those_of_the_crossing_between_samples(up, down, period, phase):
    start, end = 0.1 + phase * period, 0.9
    t = np.arange(0, 1.2, period)
    events = events_of(ramps(t, start, up, end, down, 5.0), period)
    assert kinds(events) == [Landing, LandingPeak, LiftOff]
    # a ramp is a line between samples, but for the one where it begins
    landing, lift_off = start + 0.2 / up, end - 0.1 / down
    inexact = 0.2 / up < period or 0.1 / down < period
    assert events[0].time == pytest.approx(landing, abs=period if inexact else 1e-9)
    assert events[2].time == pytest.approx(lift_off, abs=period if inexact else 1e-9)


def test_the_decision_comes_after_the_least_duration_but_names_the_crossing():
    detector = ContactEvents(EventParameters(least_duration=0.005))
    told = {}
    for i in range(40):
        for event in detector.step(i * 1e-3, 1.0 if 10 <= i < 25 else 0.0):
            told[type(event)] = (i * 1e-3, event.time)
        assert detector.touching == (15 <= i < 30)
    assert told[Landing] == pytest.approx((0.015, 0.0092))
    assert told[LiftOff] == pytest.approx((0.030, 0.0249))


def test_short_touches_and_short_gaps_do_not_count():
    force = np.zeros(100)
    force[10:13] = 3.0  # a bump of 3 ms
    assert events_of(force) == []
    force[30:80] = 3.0
    force[50:53] = 0.0  # a gap of 3 ms
    assert kinds(events_of(force, peak_window=0.01)) == [Landing, LandingPeak, LiftOff]


def test_between_the_thresholds_nothing_happens():
    force = np.full(300, 0.15)
    assert events_of(force) == []
    force[:50] = 1.0
    assert kinds(events_of(force, peak_window=0.01)) == [Landing, LandingPeak]


def test_the_peak_is_the_largest_force_of_the_window_after_landing():
    t = np.arange(0, 0.6, 1e-3)
    blow = np.where(t < 0.1, 0.0, 2 + 6 * np.exp(-(((t - 0.13) / 0.01) ** 2)))
    late = np.where(t > 0.4, 20.0, 0.0)
    (landing, peak) = events_of(np.maximum(blow, late), peak_window=0.1)
    assert landing.time == pytest.approx(0.1, abs=1e-3)
    assert peak == LandingPeak(pytest.approx(0.13), pytest.approx(8.0))
    # even where the window ends before the landing is decided
    early = events_of(blow, peak_window=0.02, least_duration=0.05)[1]
    assert isinstance(early, LandingPeak)
    assert early.force == pytest.approx(2 + 6 * math.e**-1.21, 0.1)


def test_a_lift_off_ends_the_window():
    force = np.zeros(100)
    force[10:30] = np.linspace(1, 3, 20)
    events = events_of(force, peak_window=10.0)
    assert kinds(events) == [Landing, LandingPeak, LiftOff]
    assert events[1] == LandingPeak(pytest.approx(0.029), 3.0)


@pytest.mark.parametrize("seed", range(5))
def test_noise_neither_adds_nor_hides_an_event(seed):
    """Seven standard deviations between zero and the threshold; slow ramps that linger around it."""
    rng = np.random.default_rng(seed)
    t = np.arange(0, 20, 1e-3)
    force = ramps(t, 5.0, 0.5, 15.0, 0.5, 2.0)
    noisy = np.linalg.norm(rng.normal(0, 0.2 / 7, (len(t), 3)) + force[:, None] * [0, 0, 1], axis=1)
    events = events_of(noisy)
    assert kinds(events) == [Landing, LandingPeak, LiftOff]
    assert events[0].time == pytest.approx(5.4, abs=0.2)
    assert events[2].time == pytest.approx(14.8, abs=0.2)


def test_contact_from_the_first_sample_on():
    events = events_of(np.ones(20))
    assert events == [Landing(0.0)]


def test_samples_that_are_not_finite_say_nothing():
    force = np.zeros(60)
    force[20:] = 1.0
    force[[5, 19, 20, 40]] = [math.nan, math.inf, math.nan, -math.inf]
    (landing,) = events_of(force)
    assert 0.018 < landing.time < 0.021
    assert math.isfinite(landing.time)


def test_mistakes_are_named():
    detector = ContactEvents()
    detector.step(1.0, 0.0)
    with pytest.raises(InvalidValueError, match="in order, after the one at 1 s"):
        detector.step(1.0, 0.0)
    with pytest.raises(InvalidValueError, match="in order"):
        detector.step(math.nan, 0.0)
    with pytest.raises(InvalidValueError, match="must not exceed touch_force"):
        EventParameters(touch_force=0.1, release_force=0.2)
    with pytest.raises(InvalidValueError, match="least_duration"):
        EventParameters(least_duration=-1.0)
