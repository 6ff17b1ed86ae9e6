import numpy as np
import pytest
from scipy.signal import lfilter

from palpate.errors import InvalidValueError
from palpate.estimation import Assumption
from palpate.sensing.ft.bias import average_bias, estimate_drift

NOISE = np.repeat([0.003, 16e-6], 3)
BIAS = np.array([1.0, -2.0, 0.5, 0.01, 0.0, -0.02])


def still(rng, count=1000, memory=0.0):
    """Readings at rest of a sensor whose filter remembers exp(-1/memory) of the last one."""
    pole = np.exp(-1.0 / memory) if memory else 0.0
    noise = lfilter([np.sqrt(1.0 - pole**2)], [1.0, -pole], rng.normal(size=(count + 200, 6)), axis=0)[200:]
    return BIAS + NOISE * noise


@pytest.mark.parametrize("memory", [0.0, 5.0])
def test_the_mean_is_as_near_as_its_standard_error_says_filtered_or_not(memory):
    errors = []
    for seed in range(200):
        found = average_bias(still(np.random.default_rng(seed), memory=memory), noise=NOISE)
        errors.append((np.array(found.mean) - BIAS) / found.standard_error)
    # Student's t with 19 degrees of freedom has a standard deviation of 1.06.
    assert np.std(errors) == pytest.approx(1.06, abs=0.15)


def test_the_standard_error_of_white_noise_falls_as_the_root_of_the_count():
    rng = np.random.default_rng(0)
    short, long = (average_bias(still(rng, count), noise=NOISE).standard_error for count in (1000, 100_000))
    assert np.mean(np.array(short) / long) == pytest.approx(10.0, rel=0.3)


@pytest.mark.parametrize("seed", range(50))
def test_a_sensor_at_rest_is_not_refused(seed):
    average_bias(still(np.random.default_rng(seed), memory=3.0), noise=NOISE)


TIME = np.linspace(0.0, 1.0, 1000)[:, None]


@pytest.mark.parametrize(
    ("motion", "reason"),
    [
        (0.02 * np.sin(20.0 * TIME) * [0, 1, 0, 0, 0, 0], "Fy has a standard deviation"),
        (1e-4 * (TIME > 0.5) * [0, 0, 0, 0, 0, 1], "Mz has a standard deviation"),
        (0.0105 * TIME * [0, 0, 1, 0, 0, 0], "Fz changed by 0.01"),
    ],
    ids=["swinging", "pushed", "creeping"],
)
def test_readings_that_moved_are_refused_with_the_axis(motion, reason):
    with pytest.raises(InvalidValueError, match=reason):
        average_bias(still(np.random.default_rng(1)) + motion, noise=NOISE)


@pytest.mark.parametrize("bad", [np.zeros((50, 6)), np.zeros((200, 5)), np.full((200, 6), np.nan), "x"])
def test_bad_readings_are_refused(bad):
    with pytest.raises(InvalidValueError):
        average_bias(bad, noise=NOISE)


@pytest.mark.parametrize("memory", [0.0, 5.0])
def test_a_drift_lies_in_its_interval_as_often_as_claimed(memory):
    true = 3.0 * NOISE
    inside = []
    for seed in range(200):
        readings = still(np.random.default_rng(seed), memory=memory) + true * TIME
        found = estimate_drift(readings, period=1 / 999, limit=NOISE)
        inside.append((np.abs(found.slope - true) <= found.half_width).all())
    assert 0.905 <= np.mean(inside) <= 0.99


def test_drift_is_judged_against_its_limit():
    readings = still(np.random.default_rng(2))
    drift = np.zeros(6)
    drift[4] = 1e-4
    assert estimate_drift(readings, period=1 / 999, limit=10 * NOISE).verdict.ok
    drifting = estimate_drift(readings + drift * TIME, period=1 / 999, limit=NOISE).verdict
    assert drifting.breaks(Assumption.WHITE_IN_TIME)
    undecided = estimate_drift(readings, period=1 / 999, limit=1e-3 * NOISE).verdict
    assert undecided.breaks(Assumption.ENOUGH_DATA)
