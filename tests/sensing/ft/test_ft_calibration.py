"""Calibrations of raw channels: exact sensors, units, errors of unseen loads, and what is wrong with the data."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.estimation import Assumption
from palpate.sensing.ft.calibration import fit_calibration
from palpate.sensing.ft.calibration_checks import contradicted_axes
from sensing.ft.sensor_examples import RANGES, known_loads, linear_sensor

seeds = st.integers(0, 10_000)


def shown(seed, count, noise=0.0, channels=6, condition=3.0):
    """A sensor's sensitivity and offset, known loads, and what it shows of them."""
    rng = np.random.default_rng(seed)
    S, offset = linear_sensor(channels, rng, condition)
    known = known_loads(count, rng)
    return S, offset, known, known @ S.T + offset + noise * rng.normal(size=(count, channels))


def fitted(raw, known, **more):
    return fit_calibration(raw, known, ranges=RANGES, **more)


def broken(fit):
    return {each.assumption: each for each in fit.verdict.broken}


@settings(max_examples=50, deadline=None)
@given(seed=seeds, channels=st.integers(6, 12), count=st.integers(10, 60))
def test_an_exact_linear_sensor_is_recovered(seed, channels, count):
    S, offset, known, raw = shown(seed, count, channels=channels)
    fit = fitted(raw, known)
    np.testing.assert_allclose(np.array(fit.map.matrix) @ S, np.eye(6), atol=1e-9 * RANGES.max() / RANGES.min())
    np.testing.assert_allclose(fit.map.offset, offset, atol=1e-11)
    np.testing.assert_allclose(fit.sensitivity * RANGES, S * RANGES, atol=1e-11)
    assert fit.condition == pytest.approx(3.0, rel=1e-8)
    np.testing.assert_allclose(fit.r_squared, 1.0, rtol=1e-12)
    assert fit.verdict.ok
    other = known_loads(5, np.random.default_rng(seed + 1))
    np.testing.assert_allclose(fit.apply(other @ S.T + offset), other, atol=1e-9)
    np.testing.assert_allclose(fit.map.step(tuple((S @ other[0] + offset).tolist())), other[0], atol=1e-9)


@settings(max_examples=30, deadline=None)
@given(seed=seeds)
def test_the_fit_does_not_depend_on_units(seed):
    """Millivolts for volts, and newtons in another unit: the same wrench, the same condition number."""
    _, _, known, raw = shown(seed, 30, 1e-3, channels=8)
    unit = 10.0 ** np.random.default_rng(seed).uniform(-3, 3, 6)
    fit, other = fitted(raw, known), fit_calibration(1e3 * raw, unit * known, ranges=unit * RANGES)
    np.testing.assert_allclose(other.apply(1e3 * raw) / unit, fit.apply(raw), atol=1e-7)
    assert other.condition == pytest.approx(fit.condition)
    np.testing.assert_allclose(other.left_out_rms / unit, fit.left_out_rms, rtol=1e-6)
    np.testing.assert_allclose(other.matrix_sd / (unit[:, None] / 1e3), fit.matrix_sd, rtol=1e-6)


def test_residuals_of_the_sensor_are_orthogonal_to_the_loads():
    """The optimality condition of least squares, with weights: no combination of loads explains what is left."""
    _, _, known, raw = shown(5, 40, 0.05, channels=7)
    weights = np.random.default_rng(5).uniform(0.1, 10.0, 40)
    fit = fitted(raw, known, weights=weights)
    left = raw - known @ fit.sensitivity.T - np.array(fit.map.offset)
    np.testing.assert_allclose(
        np.column_stack([known / RANGES, np.ones(40)]).T @ (weights[:, None] * left), 0, atol=1e-11
    )


def test_leave_one_out_errors_are_those_of_fits_that_never_saw_the_load():
    _, _, known, raw = shown(2, 14, 0.01)
    fit, others = fitted(raw, known), [np.delete(np.arange(14), i) for i in range(14)]
    errors = [fitted(raw[o], known[o]).apply(raw[i : i + 1])[0] - known[i] for i, o in enumerate(others)]
    np.testing.assert_allclose(fit.left_out_rms, np.sqrt((np.array(errors) ** 2).mean(axis=0)), rtol=1e-9)
    assert (fit.left_out_rms > fit.residual_rms).all()


def test_claimed_standard_errors_and_covariances_are_those_of_many_trials():
    """Weights only pull: the offset is as uncertain as the rest."""
    rng = np.random.default_rng(3)
    S, offset = linear_sensor(6, rng)
    known, unseen = known_loads(25, rng) + 0.4 * RANGES, 0.3 * RANGES
    fits = [fitted(known @ S.T + offset + 2e-3 * rng.normal(size=(25, 6)), known) for _ in range(200)]
    true_noise = 4e-6 * np.linalg.inv(S) @ np.linalg.inv(S).T
    noise = np.mean([fit.noise for fit in fits], axis=0)
    np.testing.assert_allclose(np.diag(noise), np.diag(true_noise), rtol=0.1)
    errors = [fit.apply([S @ unseen + offset])[0] - unseen for fit in fits]
    claimed = np.mean([np.diag(fit.calibration_covariance(unseen)) for fit in fits], axis=0)
    assert np.std(errors, axis=0) / np.sqrt(claimed) == pytest.approx(np.ones(6), abs=0.2)
    claimed = np.mean([fit.matrix_sd**2 for fit in fits], axis=0)
    found = np.std([fit.map.matrix for fit in fits], axis=0) / np.sqrt(claimed)
    assert found == pytest.approx(np.ones((6, 6)), abs=0.2)


def test_noise_of_the_channels_does_not_shrink_the_wrench():
    """Fitting wrench = C raw directly does: by 1/(1 + noise/signal). That is why the sensor is fitted instead."""
    S, _, known, raw = shown(4, 1000, 0.05, condition=2.0)
    gain = np.diag(np.array(fitted(raw, known).map.matrix) @ S)
    np.testing.assert_allclose(gain, 1.0, atol=0.02)
    direct = np.linalg.lstsq(raw - raw.mean(axis=0), known - known.mean(axis=0))[0].T
    assert np.diag(direct @ S).mean() < 0.96


def test_noisier_channels_count_less():
    matrix = np.abs(fitted(*shown(6, 60, np.where(np.arange(9) == 4, 0.2, 1e-3), channels=9)[:1:-1]).map.matrix)
    shares = matrix / RANGES[:, None]
    assert shares[:, 4].max() < 1e-2 * shares.max()


def test_doubtful_fits_are_reported():
    _, _, known, raw = shown(1, 30, 1e-6, condition=300.0)
    assert fitted(raw, known).verdict.breaks(Assumption.CONDITIONED)
    S, offset, known, raw = shown(1, 40, 1e-3)
    raw[:, 4] = np.minimum(raw[:, 4], np.quantile(raw[:, 4], 0.9))
    assert "channel 4 " in broken(fitted(raw, known))[Assumption.WITHIN_BOUNDS].finding  # saturated
    raw = known @ S.T + offset
    raw[3] = known[3] @ (0.7 * S.T) + offset  # a wrong weight
    assert fitted(raw[:20], known[:20]).verdict.breaks(Assumption.NOISE_LEVEL)


def test_loads_far_beyond_the_range_are_taken_for_another_unit():
    _, _, known, raw = shown(1, 40, 1e-3)
    assert Assumption.PLAUSIBLE not in broken(fitted(raw, known))
    found = broken(fitted(raw, known * np.repeat([1.0, 1e3], 3)))[Assumption.PLAUSIBLE]
    assert "times the range" in found.finding
    assert "mx_mNm" in found.remedy


@settings(max_examples=20, deadline=None)
@given(seed=seeds, factor=st.sampled_from([-1.0, 0.5, 0.9, 1.1, 2.0]))
def test_a_load_that_is_known_wrongly_is_named_with_its_factor(seed, factor):
    S, _, known, raw = shown(seed, 40, 1e-4, channels=8)
    load = RANGES * np.random.default_rng(seed).choice([-0.2, 0.2], 6)
    raw[7] += (load - known[7]) @ S.T
    known[7] = load
    assert Assumption.NO_OUTLIERS not in broken(fitted(raw, known))
    known[7] /= factor
    found = broken(fitted(raw, known))[Assumption.NO_OUTLIERS]
    assert "load 7 " in found.finding
    assert float(found.remedy.split()[4]) == pytest.approx(factor, rel=0.02)


@settings(max_examples=30, deadline=None)
@given(seed=seeds)
def test_other_axes_than_by_the_matrix_before_are_named_and_other_gains_are_none(seed):
    rng = np.random.default_rng(seed)
    _, _, known, raw = shown(seed, 40, 1e-3, channels=8)
    before, worn = fitted(raw, known).map, raw * rng.uniform(0.5, 2.0) + 0.02 * rng.normal(size=8)
    assert not list(contradicted_axes(before, worn, known, RANGES))
    turned = rng.choice([-1.0, 1.0], 6) * known[:, [1, 2, 0, 4, 5, 3]]
    (found,) = contradicted_axes(before, worn, turned, RANGES)
    assert found.assumption is Assumption.CONSISTENT
    (found,) = contradicted_axes(before, worn, known * np.repeat([1.0, 1e3], 3), RANGES)
    assert found.assumption is Assumption.PLAUSIBLE
