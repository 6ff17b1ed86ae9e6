import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.mapping import SphereFitStatus, fit_sphere


def cap_points(count, half_angle_deg, rng):
    """Points evenly spread over a cap of the unit sphere around z."""
    z = 1.0 - rng.random(count) * (1.0 - np.cos(np.radians(half_angle_deg)))
    azimuth = 2.0 * np.pi * rng.random(count)
    s = np.sqrt(1.0 - z**2)
    return np.column_stack([s * np.cos(azimuth), s * np.sin(azimuth), z])


@settings(max_examples=60, deadline=None)
@given(
    exponent=st.floats(-6, 6),
    offset=st.lists(st.floats(-100, 100), min_size=3, max_size=3),
    half_angle=st.floats(20, 180),
    seed=st.integers(0, 1000),
)
def test_exact_spheres_are_recovered_at_any_scale_and_place(exponent, offset, half_angle, seed):
    radius = 10.0**exponent
    center = radius * np.array(offset)
    points = center + radius * cap_points(50, half_angle, np.random.default_rng(seed))
    fit = fit_sphere(points)
    # Rounding of the coordinates, as far as the points determine the sphere.
    error = 30.0 * fit.condition * np.finfo(float).eps * (1.0 + np.abs(offset).max())
    assert fit.radius == pytest.approx(radius, rel=error)
    np.testing.assert_allclose(fit.center, center, atol=error * radius)
    assert fit.status == SphereFitStatus.OK


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10_000), scale=st.floats(1e-3, 1e3))
def test_the_fit_moves_with_the_points(seed, scale):
    rng = np.random.default_rng(seed)
    points = cap_points(40, 70.0, rng) + 0.01 * rng.normal(size=(40, 3))
    rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    shift = rng.normal(size=3)
    fit, moved = fit_sphere(points), fit_sphere(scale * (points @ rotation.T + shift))
    assert moved.radius == pytest.approx(scale * fit.radius, rel=1e-6)
    np.testing.assert_allclose(moved.center, scale * (rotation @ fit.center + shift), atol=1e-6 * scale)
    assert moved.rms_residual == pytest.approx(scale * fit.rms_residual, rel=1e-6)
    assert moved.radius_sd == pytest.approx(scale * fit.radius_sd, rel=1e-5)
    turned = scale**2 * rotation @ fit.covariance[:3, :3] @ rotation.T
    np.testing.assert_allclose(moved.covariance[:3, :3], turned, atol=1e-4 * np.abs(turned).max())


@pytest.mark.parametrize(("noise", "half_angle"), [(1e-3, 90.0), (1e-2, 45.0)])
def test_claimed_standard_deviations_hold_for_independent_noise(noise, half_angle):
    rng = np.random.default_rng(7)
    directions = cap_points(60, half_angle, rng)
    fits = [fit_sphere(directions * (1.0 + noise * rng.normal(size=(60, 1)))) for _ in range(150)]
    z = np.array([np.append(f.center, f.radius - 1.0) / np.append(f.center_sd, f.radius_sd) for f in fits])
    # Of 150 draws of each of 4 unknowns, 95 % should be within 1.96; binomial sd is 1.8 %.
    assert ((np.abs(z) < 1.96).mean(axis=0) > 0.88).all()
    assert z.std(axis=0) == pytest.approx(1.0, abs=0.2)


def test_no_small_change_lowers_the_sum_of_squares():
    rng = np.random.default_rng(2)
    points = cap_points(80, 60.0, rng) + 0.02 * rng.normal(size=(80, 3))
    fit = fit_sphere(points)
    offset = points - fit.center
    distance = np.linalg.norm(offset, axis=1)
    residual = distance - fit.radius
    gradient = np.append(-(residual[:, None] * offset / distance[:, None]).sum(axis=0), -residual.sum())
    assert np.abs(gradient).max() < 1e-8


def test_correlated_points_count_as_fewer():
    rng = np.random.default_rng(2)
    points = cap_points(1000, 90.0, rng) + 0.01 * rng.normal(size=(1000, 3))
    ratio = fit_sphere(points, correlation_points=25.0).radius_sd / fit_sphere(points).radius_sd
    assert ratio == pytest.approx(5.0, rel=0.1)
    assert fit_sphere(points, correlation_points=500.0).radius_sd == np.inf


def test_four_points_leave_nothing_to_judge_the_noise_by():
    fit = fit_sphere([[1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0]])
    assert fit.radius == pytest.approx(1.0)
    assert fit.radius_sd == np.inf
    assert fit.status == SphereFitStatus.WEAK


def test_a_noisy_plane_is_no_sphere():
    rng = np.random.default_rng(0)
    flat = np.column_stack([rng.random((300, 2)), 1e-3 * rng.normal(size=300)])
    assert fit_sphere(flat).status != SphereFitStatus.OK


def test_errors_common_to_a_row_are_covered_when_points_per_row_are_given():
    """Rows pushed out together: with the points of a row the sd holds, without it is far too small."""
    rng = np.random.default_rng(11)
    x, y = np.meshgrid(np.linspace(-0.5, 0.5, 40), np.linspace(-0.5, 0.5, 11))
    directions = np.column_stack([x.ravel(), y.ravel(), np.sqrt(1.0 - x.ravel() ** 2 - y.ravel() ** 2)])
    told, untold = [], []
    for _ in range(150):
        points = directions * (1.0 + 1e-4 * np.repeat(rng.normal(size=11), 40)[:, np.newaxis])
        for z, count in ((told, 40.0), (untold, 1.0)):
            fit = fit_sphere(points, correlation_points=count)
            z.append((fit.radius - 1.0) / fit.radius_sd)
    assert np.std(told) < 1.3
    assert np.std(untold) > 3.0
