import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.errors import InvalidValueError
from palpate.estimation import Assumption
from palpate.sensing.ft.calibration import fit_calibration
from palpate.sensing.ft.calibration_checks import contradicted_axes

RANGES = np.array([12.0, 12.0, 17.0, 0.12, 0.12, 0.12])


def sensor(channels, rng, condition=3.0):
    """Sensitivity of a sensor, with the given condition number in units of its ranges; and an offset."""
    left = np.linalg.qr(rng.normal(size=(channels, 6)))[0]
    right = np.linalg.qr(rng.normal(size=(6, 6)))[0]
    return (left * np.geomspace(1.0, 1.0 / condition, 6)) @ right / RANGES, rng.normal(size=channels)


def loads(count, rng):
    """Loads of up to half of the ranges, in all directions."""
    return RANGES * rng.uniform(-0.5, 0.5, (count, 6))


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 10_000), channels=st.integers(6, 12), count=st.integers(10, 60))
def test_an_exact_linear_sensor_is_recovered(seed, channels, count):
    rng = np.random.default_rng(seed)
    S, offset = sensor(channels, rng)
    known = loads(count, rng)
    fit = fit_calibration(known @ S.T + offset, known, ranges=RANGES)
    np.testing.assert_allclose(np.array(fit.map.matrix) @ S, np.eye(6), atol=1e-9 * RANGES.max() / RANGES.min())
    np.testing.assert_allclose(fit.map.offset, offset, atol=1e-11)
    np.testing.assert_allclose(fit.sensitivity * RANGES, S * RANGES, atol=1e-11)
    assert fit.condition == pytest.approx(3.0, rel=1e-8)
    np.testing.assert_allclose(fit.r_squared, 1.0, rtol=1e-12)
    assert fit.verdict.ok
    other = loads(5, rng)
    np.testing.assert_allclose(fit.apply(other @ S.T + offset), other, atol=1e-9)
    np.testing.assert_allclose(fit.map.step(tuple((S @ other[0] + offset).tolist())), other[0], atol=1e-9)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_the_fit_does_not_depend_on_units(seed):
    """Millivolts for volts, and newtons in another unit: the same wrench, the same condition number."""
    rng = np.random.default_rng(seed)
    S, offset = sensor(8, rng)
    known = loads(30, rng)
    raw = known @ S.T + offset + 1e-3 * rng.normal(size=(30, 8))
    fit = fit_calibration(raw, known, ranges=RANGES)
    unit = 10.0 ** rng.uniform(-3, 3, 6)
    other = fit_calibration(1e3 * raw, unit * known, ranges=unit * RANGES)
    np.testing.assert_allclose(other.apply(1e3 * raw) / unit, fit.apply(raw), atol=1e-7)
    assert other.condition == pytest.approx(fit.condition)
    np.testing.assert_allclose(other.left_out_rms / unit, fit.left_out_rms, rtol=1e-6)
    np.testing.assert_allclose(other.matrix_sd / (unit[:, None] / 1e3), fit.matrix_sd, rtol=1e-6)


def test_residuals_of_the_sensor_are_orthogonal_to_the_loads():
    """The optimality condition of least squares, with weights: no combination of loads explains what is left."""
    rng = np.random.default_rng(5)
    S, offset = sensor(7, rng)
    known = loads(40, rng)
    raw = known @ S.T + offset + 0.05 * rng.normal(size=(40, 7))
    weights = rng.uniform(0.1, 10.0, 40)
    fit = fit_calibration(raw, known, ranges=RANGES, weights=weights)
    predicted_offset = np.array(fit.map.offset)
    left = raw - known @ fit.sensitivity.T - predicted_offset
    np.testing.assert_allclose((known / RANGES).T @ (weights[:, None] * left), 0.0, atol=1e-11)
    np.testing.assert_allclose(weights @ left, 0.0, atol=1e-11)


def test_leave_one_out_errors_are_those_of_fits_that_never_saw_the_load():
    rng = np.random.default_rng(2)
    S, offset = sensor(6, rng)
    known = loads(14, rng)
    raw = known @ S.T + offset + 0.01 * rng.normal(size=(14, 6))
    fit = fit_calibration(raw, known, ranges=RANGES)
    errors = []
    for i in range(14):
        others = np.arange(14) != i
        blind = fit_calibration(raw[others], known[others], ranges=RANGES)
        errors.append(blind.apply(raw[i : i + 1])[0] - known[i])
    np.testing.assert_allclose(fit.left_out_rms, np.sqrt((np.array(errors) ** 2).mean(axis=0)), rtol=1e-9)
    assert (fit.left_out_rms > fit.residual_rms).all()


@pytest.mark.slow
def test_claimed_standard_errors_and_covariances_are_those_of_many_trials():
    rng = np.random.default_rng(3)
    S, offset = sensor(6, rng)
    # Weights only pull: the offset is as uncertain as the rest.
    known, unseen = loads(25, rng) + 0.4 * RANGES, 0.3 * RANGES[None]
    fits, matrices, errors = [], [], []
    for _ in range(400):
        raw = known @ S.T + offset + 2e-3 * rng.normal(size=(25, 6))
        fit = fit_calibration(raw, known, ranges=RANGES)
        fits.append(fit)
        matrices.append(fit.map.matrix)
        errors.append(fit.apply(unseen @ S.T + offset)[0] - unseen[0])
    claimed = np.sqrt(np.mean([f.matrix_sd**2 for f in fits], axis=0))
    assert np.std(matrices, axis=0) / claimed == pytest.approx(np.ones((6, 6)), abs=0.15)
    claimed = np.sqrt(np.mean([np.diag(f.calibration_covariance(unseen[0])) for f in fits], axis=0))
    assert np.std(errors, axis=0) / claimed == pytest.approx(np.ones(6), abs=0.15)
    true_noise = 4e-6 * np.linalg.inv(S) @ np.linalg.inv(S).T
    found = np.mean([f.noise for f in fits], axis=0)
    np.testing.assert_allclose(np.diag(found), np.diag(true_noise), rtol=0.1)


def test_noise_of_the_channels_does_not_shrink_the_wrench():
    """Fitting wrench = C raw directly does: by 1/(1 + noise/signal). That is why the sensor is fitted instead."""
    rng = np.random.default_rng(4)
    S, offset = sensor(6, rng, condition=2.0)
    known = loads(4000, rng)
    raw = known @ S.T + offset + 0.05 * rng.normal(size=(4000, 6))
    gain = np.diag(np.array(fit_calibration(raw, known, ranges=RANGES).map.matrix) @ S)
    np.testing.assert_allclose(gain, 1.0, atol=0.015)
    direct = np.linalg.lstsq(raw - raw.mean(axis=0), known - known.mean(axis=0))[0].T
    assert np.diag(direct @ S).mean() < 0.96


def test_noisier_channels_count_less():
    rng = np.random.default_rng(6)
    S, offset = sensor(9, rng)
    known = loads(60, rng)
    noise = np.where(np.arange(9) == 4, 0.2, 1e-3)
    fit = fit_calibration(known @ S.T + offset + noise * rng.normal(size=(60, 9)), known, ranges=RANGES)
    matrix = np.abs(np.array(fit.map.matrix)) / RANGES[:, None]
    assert matrix[:, 4].max() < 1e-2 * matrix.max()


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda w: w * [1, 1, 1, 1, 1, 0], "do not vary in Mz "),
        (lambda w: np.where(np.arange(6) == 2, -9.0, w), "do not vary in Fz "),
        (lambda w: w * [1, 0, 1, 1, 1, 0], "do not vary in (Mz; Fy|Fy; Mz) "),
        # All forces in x act at one height, so that each comes with the same moment about y.
        (lambda w: np.column_stack([w[:, :4], 0.01 * w[:, 0], w[:, 5]]), r"do not vary in \+0\... (My|Fx) -0\..."),
        (lambda w: w * [1, 1, 1, 1, 1, 1e-6], "do not vary in Mz "),
        (lambda w: np.where((np.arange(20) > 0)[:, None] & (np.arange(6) == 5), 0.0, w), "load 0, .* only one of"),
        (lambda w: w[:7], "7 loads: give 8"),
        (lambda w: w[:, :5], r"must be \(n, 6\)"),
        (lambda w: np.where(w == w[3, 2], np.inf, w), r"wrench\[3, 2\] = inf"),
    ],
    ids=["no Mz", "constant Fz", "two missing", "coupled", "tiny", "lonely", "few", "shape", "inf"],
)
def test_sets_of_loads_that_do_not_span_are_refused_with_the_missing_direction(change, reason):
    rng = np.random.default_rng(0)
    S, offset = sensor(6, rng)
    full = loads(20, rng)
    known = change(full)
    raw = (full @ S.T + offset)[: len(known)]
    with pytest.raises(InvalidValueError, match=reason):
        fit_calibration(raw, known, ranges=RANGES)


def test_a_sensor_that_does_not_feel_a_direction_is_refused():
    rng = np.random.default_rng(1)
    S, offset = sensor(6, rng)
    S[:, 4] = 0.0
    known = loads(30, rng)
    with pytest.raises(InvalidValueError, match="hardly respond to My "):
        fit_calibration(known @ S.T + offset + 1e-4 * rng.normal(size=(30, 6)), known, ranges=RANGES)
    with pytest.raises(InvalidValueError, match="hardly respond to My "):
        fit_calibration(known @ S.T + offset, known, ranges=RANGES)
    with pytest.raises(InvalidValueError, match="5 channels"):
        fit_calibration(known @ S.T[:, :5], known, ranges=RANGES)


def test_what_is_doubtful_says_so():
    rng = np.random.default_rng(1)
    known = loads(30, rng)
    S, offset = sensor(6, rng, condition=300.0)
    fit = fit_calibration(known @ S.T + offset + 1e-6 * rng.normal(size=(30, 6)), known, ranges=RANGES)
    assert fit.verdict.breaks(Assumption.CONDITIONED)
    S, offset = sensor(6, rng)
    raw = known @ S.T + offset
    raw[3] = known[3] @ (0.7 * S.T) + offset  # a wrong weight
    assert fit_calibration(raw, known, ranges=RANGES).verdict.breaks(Assumption.NOISE_LEVEL)


def broken(fit):
    return {each.assumption: each for each in fit.verdict.broken}


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10_000), factor=st.sampled_from([-1.0, 0.5, 0.9, 1.1, 2.0]))
def test_a_load_that_is_known_wrongly_is_named_with_its_factor(seed, factor):
    rng = np.random.default_rng(seed)
    S, offset = sensor(8, rng)
    known = loads(40, rng)
    known[7] = RANGES * rng.choice([-0.2, 0.2], 6)
    raw = known @ S.T + offset + 1e-4 * rng.normal(size=(40, 8))
    assert Assumption.NO_OUTLIERS not in broken(fit_calibration(raw, known, ranges=RANGES))
    known[7] /= factor
    found = broken(fit_calibration(raw, known, ranges=RANGES))[Assumption.NO_OUTLIERS]
    assert "load 7 " in found.finding
    assert float(found.remedy.split()[4]) == pytest.approx(factor, rel=0.02)


def test_a_saturated_channel_is_named():
    rng = np.random.default_rng(2)
    S, offset = sensor(6, rng)
    known = loads(40, rng)
    raw = known @ S.T + offset + 1e-3 * rng.normal(size=(40, 6))
    raw[:, 4] = np.minimum(raw[:, 4], np.quantile(raw[:, 4], 0.9))
    assert "channel 4 " in broken(fit_calibration(raw, known, ranges=RANGES))[Assumption.WITHIN_BOUNDS].finding


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_other_axes_than_by_the_matrix_before_are_named_and_other_gains_are_none(seed):
    rng = np.random.default_rng(seed)
    S, offset = sensor(8, rng)
    known = loads(40, rng)
    raw = known @ S.T + offset + 1e-3 * rng.normal(size=(40, 8))
    before = fit_calibration(raw, known, ranges=RANGES).map
    worn = raw * rng.uniform(0.5, 2.0) + 0.02 * rng.normal(size=8)
    assert not list(contradicted_axes(before, worn, known, RANGES))
    order, signs = np.array([1, 2, 0, 4, 5, 3]), rng.choice([-1.0, 1.0], 6)
    (found,) = contradicted_axes(before, worn, signs * known[:, order], RANGES)
    assert found.assumption is Assumption.CONSISTENT
    (found,) = contradicted_axes(before, worn, known * np.repeat([1.0, 1e3], 3), RANGES)
    assert found.assumption is Assumption.PLAUSIBLE
