import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.sensing.ft.health import HEALTHY, DriftWatch, HealthCheck, HealthLimits, HealthMonitor
from palpate.sensing.ft.touch_detector import ContactDetector

AXIS = (12.0, 12.0, 17.0, 0.12, 0.12, 0.12)
LIMITS = HealthLimits(AXIS, raw=(-5.0, 5.0), frozen_samples=5, stuck_samples=20)
RAW = (0.0,) * 6
NOTHING = (0.0,) * 6


def judge(load=NOTHING, raw=RAW, limits=LIMITS):
    return HealthMonitor(limits).step(raw, load)


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
    load, name = 1.01 * sign * AXIS[axis] * np.eye(6)[axis], ("Fx", "Fy", "Fz", "Mx", "My", "Mz")[axis]
    verdict = judge(tuple(load.tolist()))
    found = (verdict.measure, verdict.where, verdict.value, verdict.limit)
    assert found == (HealthCheck.OVERLOAD_AXIS, name, load[axis], AXIS[axis])
    assert f"({name}): {load[axis]:.6g}, limit {AXIS[axis]:.6g}" in str(verdict)


def test_loads_add_up():
    verdict = judge((9.0, 9.0, 9.0, 0.0, 0.0, 0.0))
    assert verdict.measure is HealthCheck.OVERLOAD_COMBINED
    assert verdict.value == pytest.approx(math.hypot(0.75, 0.75, 9 / 17))
    box = HealthLimits(AXIS, combined=math.sqrt(6.0))
    assert judge(tuple(0.999 * x for x in AXIS), limits=box) is HEALTHY
    assert judge((12.1, 0.0, 0.0, 0.0, 0.0, 0.0), limits=box).measure is HealthCheck.OVERLOAD_AXIS
    tight = HealthLimits(AXIS, combined=0.5)
    assert judge((7.0, 0.0, 0.0, 0.0, 0.0, 0.0), limits=tight).measure is HealthCheck.OVERLOAD_COMBINED


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_what_is_no_number_is_reported_first(value):
    verdict = judge((99.0, 0.0, 0.0, 0.0, 0.0, 0.0), raw=(0.0, 0.0, value, 0.0, 0.0, 9.0))
    assert verdict.measure is HealthCheck.NON_FINITE
    assert verdict.where == "channel 3"


@pytest.mark.parametrize(("value", "limit"), [(5.0, 5.0), (-5.1, -5.0)])
def test_saturation_is_named(value, limit):
    verdict = judge(raw=(0.0, value, 0.0, 0.0, 0.0, 0.0))
    assert (verdict.measure, verdict.where) == (HealthCheck.SATURATED, "channel 2")
    assert (verdict.value, verdict.limit) == (value, limit)
    assert judge(raw=(0.0, 0.999 * limit, 0.0, 0.0, 0.0, 0.0)) is HEALTHY


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
    rng = np.random.default_rng(0)
    monitor, healthy = HealthMonitor(LIMITS), HealthMonitor(LIMITS)
    stuck = []
    for _ in range(30):
        raw = rng.normal(size=6)
        assert healthy.step(tuple(raw), NOTHING) is HEALTHY
        raw[4] = 0.7
        stuck.append(monitor.step(tuple(raw), NOTHING))
    assert all(v is HEALTHY for v in stuck[:19])
    assert all(v.measure is HealthCheck.STUCK and v.where == "channel 5" for v in stuck[19:])


def test_drift_is_seen_through_noise_and_noise_is_no_drift():
    rng = np.random.default_rng(1)
    limit = (0.02,) * 3 + (1e-4,) * 3
    watch = DriftWatch(limit, 1.0, 0.001)
    noise = np.repeat([0.05, 2e-4], 3) * rng.normal(size=(6000, 6))
    assert all(watch.step(tuple(row)) is HEALTHY for row in noise)
    noise[:, 3] += np.linspace(0.0, 5e-4, 6000)
    verdicts = [watch.step(tuple(row)) for row in noise]
    first = next(i for i, v in enumerate(verdicts) if not v.ok)
    assert verdicts[first].measure is HealthCheck.DRIFT
    assert verdicts[first].where == "Mx"
    # The limit is reached after 1200 samples; the mean lags by its memory of 1000.
    assert 1200 < first < 3200
    watch.restart()
    assert watch.step(tuple(noise[-1])) is HEALTHY


def detector(**changes):
    given = {"touch_force": 0.2, "release_force": 0.1, "noise": 0.01, "period": 0.001}
    return ContactDetector(**{**given, **changes})


def test_touch_and_release_have_their_own_thresholds_and_what_is_no_number_changes_nothing():
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


def test_the_detector_knows_its_delay():
    found = detector(touch_time=0.003)
    assert [found.step(1.0) for _ in range(5)] == [False, False, False, True, True]
    assert found.delay == pytest.approx(0.003)
