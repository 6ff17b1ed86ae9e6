"""Tares: means of readings at rest, their standard errors and drifts, filtered or not."""

import numpy as np
import pytest
from scipy.signal import lfilter

from palpate.estimation import Assumption
from palpate.sensing.ft.bias import average_bias, estimate_drift

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
