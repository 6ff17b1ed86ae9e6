import math

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import dblquad

from mapping.covariances import surface_covariance, without_errors
from palpate.mapping.surface_map import SurfaceModel, half_widths
from palpate.mapping.surface_map.covariance import (
    PLANE_SLOPE,
    height_covariance,
    height_variance,
    patch_covariance,
    path_correlation,
    weighted_sums,
)
from palpate.mapping.surface_map.patch import JITTER, PatchData, PatchFrame, SurfacePatch
from palpate.mapping.surface_map.stretches import Stretches

MODEL = SurfaceModel()
seeds = st.integers(0, 2**32 - 1)


def exact_covariance(p, q, i, j, model):
    """Covariance of derivative i (0: none, 1: x, 2: y) at p with derivative j at q, in 40 digits."""

    def k(px, py, qx, qy):
        r = mpmath.sqrt((px - qx) ** 2 + (py - qy) ** 2) * mpmath.sqrt(5) / mpmath.mpf(model.length)
        s = mpmath.mpf(model.curvature) * mpmath.mpf(model.length) ** 2 / 5
        matern = s**2 * (1 + r + r**2 / 3) * mpmath.exp(-r)
        return matern + mpmath.mpf(model.plane) ** 2 + mpmath.mpf(PLANE_SLOPE) ** 2 * (px * qx + py * qy)

    order = [int(i == 1), int(i == 2), int(j == 1), int(j == 2)]
    at = tuple(mpmath.mpf(float(value)) for value in (*p, *q))
    return mpmath.diff(k, at, tuple(order)) if any(order) else k(*at)


def test_slopes_are_the_derivatives_of_heights():
    xy = np.random.default_rng(0).uniform(-4e-3, 4e-3, (4, 2))
    K = surface_covariance(xy, MODEL).reshape(12, 12)
    with mpmath.workdps(40):
        exact = [
            [float(exact_covariance(p, q, i, j, MODEL)) for j in range(3) for q in xy]
            for i in range(3)
            for p in xy
        ]
    np.testing.assert_allclose(K, exact, rtol=1e-9, atol=1e-16)


@given(seeds)
@settings(max_examples=20, deadline=None)
def test_the_shortcuts_agree_with_the_whole_matrix(seed):
    rng = np.random.default_rng(seed)
    xy, at, weights = rng.normal(0.0, 3e-3, (6, 2)), rng.normal(0.0, 3e-3, (4, 2)), rng.normal(size=18)
    n, both = len(at), surface_covariance(np.vstack([at, xy]), MODEL)
    whole = both[:, :n, :, n:].reshape(3 * n, -1)
    terms = np.abs(whole) @ np.abs(weights)
    found = weighted_sums(at, xy, weights, MODEL).ravel()
    assert (np.abs(found - whole @ weights) <= 1e-13 * terms).all()
    np.testing.assert_allclose(height_covariance(xy, at, MODEL), whole[:4].T, rtol=1e-13, atol=1e-20)
    np.testing.assert_allclose(height_variance(at, MODEL), np.diag(both[0, :n, 0, :n]), rtol=1e-13)


@pytest.mark.parametrize("length", [0.05e-3, 1e-3, 30e-3])
def test_noise_of_a_mean_is_the_mean_of_the_noise(length):
    path, extent = np.array([0.0, 1.0e-3, 2.5e-3]), np.array([1.0e-3, 0.6e-3, 0.0])
    C = path_correlation(path, extent, length)

    def mean(i, j):
        a, b = (path[k] + 0.5 * max(extent[k], 1e-9) * np.array([-1.0, 1.0]) for k in (i, j))
        if i == j:  # twice the half below the diagonal, where the correlation has no kink
            half = dblquad(
                lambda s, t: math.exp((s - t) / length), *b, a[0], lambda t: t, epsabs=1e-18, epsrel=1e-9
            )
            return 2.0 * half[0] / (a[1] - a[0]) ** 2
        whole = dblquad(lambda s, t: math.exp(-abs(s - t) / length), *b, *a, epsabs=1e-16, epsrel=1e-7)
        return whole[0] / ((a[1] - a[0]) * (b[1] - b[0]))

    for i in range(3):
        for j in range(3):
            assert C[i, j] == pytest.approx(mean(i, j), rel=1e-5, abs=1e-12)
    assert np.linalg.eigvalsh(C)[0] > 0.0


def test_one_contact_errs_fully_and_a_long_stretch_as_its_effective_number_says():
    extents = [0.0, *10.0 ** np.arange(-12.0, 2.0, 0.1), 1.0]
    variance = np.array([path_correlation(np.zeros(1), np.array([b]), 1e-3)[0, 0] for b in extents])
    assert variance[0] == 1.0
    assert variance[-1] == pytest.approx(2.0 * 1e-3 / 1.0, rel=2e-3)  # 2 L / b
    assert (np.diff(variance[1:-1]) <= 1e-12).all()


def few_stretches(seed=3, count=5):
    rng = np.random.default_rng(seed)
    xy = rng.uniform(-3e-3, 3e-3, (count, 2))
    slope = 0.1 * rng.normal(size=(count, 2))
    normal = np.column_stack([-slope, np.ones(count)])
    return Stretches(
        position=np.column_stack([xy, 2e-4 * rng.normal(size=count)]),
        normal=normal / np.linalg.norm(normal, axis=1, keepdims=True),
        path=np.cumsum(rng.uniform(1e-3, 3e-3, count)),
        extent=rng.uniform(0.2e-3, 1e-3, count),
        noise=rng.uniform(0.5, 2.0, count),
        tilt=rng.uniform(0.5, 2.0, count),
    )


def test_the_posterior_is_that_of_a_dense_process_in_forty_digits():
    stretches = few_stretches()
    frame = PatchFrame(np.zeros(3), np.eye(3))
    patch = SurfacePatch.fitted(frame, stretches, MODEL, MODEL, 1.5e-3)
    model, n = patch.model, len(stretches)
    data = PatchData.over(frame, stretches)
    at = np.array([[1e-3, -0.5e-3], [4e-3, 3e-3]])
    with mpmath.workdps(40):
        K = mpmath.matrix(3 * n, 3 * n)
        noise = np.triu(patch_covariance(data.xy, MODEL, data.noise(MODEL), 0.0)[0])
        noise -= np.triu(patch_covariance(data.xy, MODEL, without_errors(n), 0.0)[0])
        noise += np.triu(noise, 1).T
        for a in range(3 * n):
            for b in range(3 * n):
                K[a, b] = exact_covariance(data.xy[a % n], data.xy[b % n], a // n, b // n, model)
                K[a, b] += mpmath.mpf(float(noise[a, b]))
            K[a, a] *= 1 + mpmath.mpf(JITTER)
        y = mpmath.matrix(data.values.tolist())
        for point, mean, sd in zip(at, patch.heights(at)[0], patch.height_sd(at), strict=True):
            k = mpmath.matrix([exact_covariance(data.xy[b % n], point, b // n, 0, model) for b in range(3 * n)])
            solved = mpmath.lu_solve(K, k)
            assert mean == pytest.approx(float((solved.T * y)[0]), rel=1e-9)
            variance = exact_covariance(point, point, 0, 0, model) - (solved.T * k)[0]
            surprise = max(1.0, float((y.T * mpmath.lu_solve(K, y))[0]) / (3 * n))
            assert sd == pytest.approx(math.sqrt(float(variance) * surprise), rel=1e-6)


def test_slopes_of_the_mean_are_its_derivatives():
    patch = SurfacePatch.fitted(PatchFrame(np.zeros(3), np.eye(3)), few_stretches(), MODEL, MODEL, 1.5e-3)
    at, h = np.array([1e-3, 2e-3]), 1e-6
    heights = patch.heights(np.vstack([at, at + h * np.eye(2), at - h * np.eye(2)]))
    differences = (heights[0, 1:3] - heights[0, 3:]) / (2.0 * h)
    np.testing.assert_allclose(heights[1:, 0], differences, rtol=1e-6)


def test_noise_of_heights_and_slopes_follows_the_steepness():
    """Errors of position and normal pushed through h = z - p.xy and p = -n_xy / n_z, by Monte Carlo."""
    rng = np.random.default_rng(0)
    normal = np.array([0.5, 0.3, 0.0])
    normal[2] = math.sqrt(1.0 - normal @ normal)
    n = 200_000
    turned = normal + 1e-3 * np.cross(rng.normal(size=(n, 3)), normal)
    slopes = -turned[:, :2] / turned[:, 2:]
    one = Stretches(np.zeros((1, 3)), normal[None], np.zeros(1), np.zeros(1), np.ones(1), np.ones(1))
    root = PatchData.over(PatchFrame(np.zeros(3), np.eye(3)), one)
    np.testing.assert_allclose(1e-6 * root.tilt_root[0] @ root.tilt_root[0].T, np.cov(slopes.T), rtol=0.02)
    heights = rng.normal(size=(n, 3)) @ normal / normal[2]
    assert root.noise_root[0] == pytest.approx(heights.std(), rel=0.01)


@given(st.floats(1e-6, 1e-4), st.floats(0.0, 1e-3), st.floats(0.5, 0.999))
def test_a_band_holds_what_it_promises_for_the_worst_bias(sd, bias, probability):
    t = half_widths(np.array([sd]), bias, probability)[0]
    held = [mpmath.ncdf((t - b) / sd) - mpmath.ncdf((-t - b) / sd) for b in (bias, 0.5 * bias, 0.0)]
    assert float(held[0]) == pytest.approx(probability, abs=1e-9)
    assert min(held) == held[0] or float(held[0]) == pytest.approx(float(min(held)), abs=1e-12)


def test_bands_without_bias_without_noise_and_without_anything():
    sd, bias = np.array([1e-5, 0.0, 0.0, np.nan, 1e-6]), np.array([0.0, 0.0, 3e-5, 3e-5, 3e-5])
    bands = [half_widths(np.array([s]), b)[0] for s, b in zip(sd, bias, strict=True)]
    np.testing.assert_allclose(bands, [1.959964e-5, 0.0, 3e-5, np.nan, 3e-5 + 1.644854e-6], rtol=1e-6)
