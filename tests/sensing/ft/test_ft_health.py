"""Readings at rest, tares and drift; health of a sensor; and when it touches."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import lfilter

from palpate.estimation import Assumption
from palpate.sensing.ft.bias import average_bias, estimate_drift
from palpate.sensing.ft.health import HEALTHY, DriftWatch, HealthCheck, HealthLimits, HealthMonitor
from palpate.sensing.ft.touch_detector import ContactDetector

AXIS = (12.0, 12.0, 17.0, 0.12, 0.12, 0.12)
LIMITS = HealthLimits(AXIS, raw=(-5.0, 5.0), frozen_samples=5, stuck_samples=20)
RAW = NOTHING = (0.0,) * 6
NAMES = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")
TIGHT, BOX = HealthLimits(AXIS, combined=0.5), HealthLimits(AXIS, combined=math.sqrt(6.0))


def judge(load=NOTHING, raw=RAW, limits=LIMITS):
    return HealthMonitor(limits).step(raw, load)


def on(channel, value):
    return tuple((value * np.eye(6)[channel]).tolist())


@given(st.lists(st.floats(-1.0, 1.0), min_size=6, max_size=6))
def test_a_load_is_an_overload_exactly_when_it_leaves_the_ellipsoid(direction):
    length = math.hypot(*direction)
    if length < 1e-3:
        return
    edge = [x / length * limit for x, limit in zip(direction, AXIS, strict=True)]
    assert judge(tuple(0.999999 * x for x in edge)) is HEALTHY
    assert not judge(tuple(1.000001 * x for x in edge)).ok


@pytest.mark.parametrize("axis", range(6))
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_an_overloaded_axis_is_named_with_value_and_limit(axis, sign):
    load, name = on(axis, 1.01 * sign * AXIS[axis]), NAMES[axis]
    verdict = judge(load)
    found = (verdict.measure, verdict.where, verdict.value, verdict.limit)
    assert found == (HealthCheck.OVERLOAD_AXIS, name, load[axis], AXIS[axis])
    assert f"({name}): {load[axis]:.6g}, limit {AXIS[axis]:.6g}" in str(verdict)


@pytest.mark.parametrize(
    ("load", "raw", "limits", "expected"),
    [
        (
            (9.0, 9.0, 9.0, 0.0, 0.0, 0.0),
            RAW,
            LIMITS,
            {"measure": HealthCheck.OVERLOAD_COMBINED, "value": pytest.approx(math.hypot(0.75, 0.75, 9 / 17))},
        ),
        (on(0, 7.0), RAW, TIGHT, {"measure": HealthCheck.OVERLOAD_COMBINED}),
        (on(0, 12.1), RAW, BOX, {"measure": HealthCheck.OVERLOAD_AXIS}),
        (tuple(0.999 * x for x in AXIS), RAW, BOX, {"measure": HealthCheck.HEALTHY}),
        *(
            # a value that is no number is reported first
            (
                on(0, 99.0),
                (0.0, 0.0, x, 0.0, 0.0, 9.0),
                LIMITS,
                {"measure": HealthCheck.NON_FINITE, "where": "channel 3"},
            )
            for x in (math.nan, math.inf, -math.inf)
        ),
        *(
            (
                NOTHING,
                on(1, x),
                LIMITS,
                {"measure": HealthCheck.SATURATED, "where": "channel 2", "value": x, "limit": limit},
            )
            for x, limit in ((5.0, 5.0), (-5.1, -5.0))
        ),
        *((NOTHING, on(1, x), LIMITS, {"measure": HealthCheck.HEALTHY}) for x in (0.999 * 5.0, -0.999 * 5.0)),
    ],
)
def test_a_fault_has_a_measure_a_place_a_value_and_a_limit(load, raw, limits, expected):
    verdict = judge(load, raw, limits)
    assert {name: getattr(verdict, name) for name in expected} == expected
    assert verdict.ok == (expected["measure"] is HealthCheck.HEALTHY)


def test_a_device_that_repeats_itself_is_frozen_until_it_moves():
    monitor = HealthMonitor(LIMITS)
    measures = [monitor.step(RAW, NOTHING).measure for _ in range(7)]
    assert measures == [HealthCheck.HEALTHY] * 4 + [HealthCheck.FROZEN] * 3
    moved = (0.0, 0.0, 1e-9, 0.0, 0.0, 0.0)
    measures = [monitor.step(moved, NOTHING).measure for _ in range(6)]
    # One channel moved: it alone counts anew, and the others are not stuck before 20.
    assert measures == [HealthCheck.HEALTHY] * 4 + [HealthCheck.FROZEN] * 2
    monitor.restart()
    assert all(monitor.step(RAW, NOTHING) is HEALTHY for _ in range(4))


def test_one_stuck_channel_is_found_and_noise_is_not():
    noise, monitor, healthy = (
        np.random.default_rng(0).normal(size=(30, 6)),
        HealthMonitor(LIMITS),
        HealthMonitor(LIMITS),
    )
    assert all(healthy.step(tuple(raw), NOTHING) is HEALTHY for raw in noise)
    noise[:, 4] = 0.7
    stuck = [monitor.step(tuple(raw), NOTHING) for raw in noise]
    assert all(v is HEALTHY for v in stuck[:19])
    assert all(v.measure is HealthCheck.STUCK and v.where == "channel 5" for v in stuck[19:])


def test_drift_is_seen_through_noise_and_noise_is_no_drift():
    watch = DriftWatch((0.02,) * 3 + (1e-4,) * 3, 1.0, 0.001)
    noise = np.repeat([0.05, 2e-4], 3) * np.random.default_rng(1).normal(size=(6000, 6))
    assert all(watch.step(tuple(row)) is HEALTHY for row in noise)
    noise[:, 3] += np.linspace(0.0, 5e-4, 6000)
    first, drift = next((i, v) for i, v in enumerate(watch.step(tuple(row)) for row in noise) if not v.ok)
    assert (drift.measure, drift.where) == (HealthCheck.DRIFT, "Mx")
    # The limit is reached after 1200 samples; the mean lags by its memory of 1000.
    assert 1200 < first < 3200
    watch.restart()
    assert watch.step(tuple(noise[-1])) is HEALTHY


def detector(**changes):
    given = {"touch_force": 0.2, "release_force": 0.1, "noise": 0.01, "period": 0.001}
    return ContactDetector(**{**given, **changes})


def test_touch_and_release_have_their_own_thresholds_and_nan_changes_nothing():
    found = detector()
    forces = [0.0, 0.15, math.nan, 0.21, 0.15, math.nan, 0.11, 0.09, 0.15, 0.2, 0.3]
    assert [int(found.step(x)) for x in forces] == [0, 0, 0, 1, 1, 1, 1, 0, 0, 0, 1]
    found.restart()
    assert not found.touching


@given(st.lists(st.floats(0.0, 0.4), max_size=60), st.integers(0, 5), st.integers(0, 5))
def test_a_touch_lasts_as_long_as_asked_and_changes_only_for_a_reason(forces, touch, release):
    """Stated over the whole history, without the detector's counters."""
    found = detector(touch_time=0.001 * touch, release_time=0.001 * release)
    states = [False]
    for i, force in enumerate(forces):
        states.append(found.step(force))
        if states[-1] != states[-2]:
            needed = touch + 1 if states[-1] else release + 1
            recent = forces[max(0, i - needed + 1) : i + 1]
            assert len(recent) == needed
            assert all(x > 0.2 for x in recent) if states[-1] else all(x < 0.1 for x in recent)
    if len(forces) > touch and all(x > 0.2 for x in forces):
        assert states[-1]


def test_the_detector_states_its_delay():
    found = detector(touch_time=0.003)
    assert [found.step(1.0) for _ in range(5)] == [False, False, False, True, True]
    assert found.delay == pytest.approx(0.003)


NOISE = np.repeat([0.003, 16e-6], 3)
BIAS = np.array([1.0, -2.0, 0.5, 0.01, 0.0, -0.02])
TIME = np.linspace(0.0, 1.0, 1000)[:, None]


def still(rng, count=1000, memory=0.0):
    """Readings at rest of a sensor whose filter remembers exp(-1/memory) of the last one."""
    pole = np.exp(-1.0 / memory) if memory else 0.0
    noise = lfilter([np.sqrt(1.0 - pole**2)], [1.0, -pole], rng.normal(size=(count + 200, 6)), axis=0)[200:]
    return BIAS + NOISE * noise


@pytest.mark.parametrize("memory", [0.0, 5.0])
def test_mean_and_drift_are_as_near_as_they_say_filtered_or_not(memory):
    errors, inside, drift = [], [], 3.0 * NOISE
    for seed in range(200):
        readings = still(np.random.default_rng(seed), memory=memory)
        found = average_bias(readings, noise=NOISE)
        errors.append((np.array(found.mean) - BIAS) / found.standard_error)
        slope = estimate_drift(readings + drift * TIME, period=1 / 999, limit=NOISE)
        inside.append((np.abs(slope.slope - drift) <= slope.half_width).all())
    # Student's t with 19 degrees of freedom has a standard deviation of 1.06.
    assert np.std(errors) == pytest.approx(1.06, abs=0.15)
    assert 0.905 <= np.mean(inside) <= 0.99


def test_the_standard_error_of_white_noise_falls_as_the_root_of_the_count():
    rng = np.random.default_rng(0)
    short, long = (average_bias(still(rng, count), noise=NOISE).standard_error for count in (1000, 100_000))
    assert np.mean(np.array(short) / long) == pytest.approx(10.0, rel=0.3)


@pytest.mark.parametrize(
    ("drift", "limit", "broken"),
    [(0.0, 10.0, None), (1e-4, 1.0, Assumption.WHITE_IN_TIME), (0.0, 1e-3, Assumption.ENOUGH_DATA)],
)
def test_drift_is_judged_against_its_limit(drift, limit, broken):
    readings = still(np.random.default_rng(2)) + drift * TIME * np.eye(6)[4]
    verdict = estimate_drift(readings, period=1 / 999, limit=limit * NOISE).verdict
    assert verdict.ok if broken is None else verdict.breaks(broken)
