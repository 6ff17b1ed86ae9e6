from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping import felt_shapes
from mapping.felt_shapes import ANSWER, NORMAL_SD, cloud_at, felt, random_case, random_rotation
from palpate.mapping.primitives import (
    BoxShape,
    CylinderShape,
    EllipsoidShape,
    PlaneShape,
    PrimitiveKind,
    SphereShape,
    TorusShape,
    choose_primitive,
    fit_primitive,
)
from palpate.mapping.primitives.solve import linearised, moved

seeds = st.integers(0, 2**32 - 1)


def fit_ball(cloud, **more):
    return fit_primitive(cloud, PrimitiveKind.SPHERE, **more)


FIVE_FACES = np.array([True, True, False, True, True, True])
PATHS = {
    PrimitiveKind.PLANE: lambda rng: felt_shapes.plane(rng, 0.04),
    PrimitiveKind.SPHERE: lambda rng: felt_shapes.sphere(0.02, np.radians(60.0)),
    PrimitiveKind.CYLINDER: lambda rng: felt_shapes.cylinder(0.02, np.radians(70.0), 0.05),
    PrimitiveKind.ELLIPSOID: lambda rng: felt_shapes.ellipsoid([0.03, 0.02, 0.015], np.radians(90.0)),
    PrimitiveKind.BOX: lambda rng: felt_shapes.box([0.03, 0.02, 0.015], 0.003),
    PrimitiveKind.TORUS: lambda rng: felt_shapes.torus(0.03, 0.012, 0.6),
}
SIZES = {
    PrimitiveKind.PLANE: [],
    PrimitiveKind.SPHERE: [0.02],
    PrimitiveKind.CYLINDER: [0.02],
    PrimitiveKind.ELLIPSOID: [0.03, 0.02, 0.015],
    PrimitiveKind.TORUS: [0.03, 0.012],
}


def shapes(rng):
    c, R = rng.normal(size=3), random_rotation(rng)
    axes = np.array([1.5, 1.0, 0.6])
    yield PlaneShape(c, R)
    for hollow in (False, True):
        yield SphereShape(c, R, 1.3, hollow)
        yield CylinderShape(c, R, 0.8, hollow)
        yield EllipsoidShape(c, R, axes, hollow)
        yield TorusShape(c, R, 1.3, 0.4, hollow)
    yield BoxShape(c, R, np.array([1.0, 0.8, 0.6]), 0.2, FIVE_FACES)


@pytest.mark.slow
@settings(max_examples=15, deadline=None)
@given(seed=seeds)
def test_slopes_are_those_of_the_residuals(seed):
    """Central differences; the few points whose nearest face changes within the step are left out."""
    rng = np.random.default_rng(seed)
    for shape in shapes(rng):
        direction = rng.normal(size=(60, 3))
        points = shape.center + 1.5 * direction / np.linalg.norm(direction, axis=1, keepdims=True)
        normals = np.zeros((60, 3))
        at = linearised(shape, points, normals)
        for k in range(at.distance_slope.shape[1]):
            step = np.zeros(at.distance_slope.shape[1])
            step[k] = 1e-6
            ahead, behind = moved(shape, step), moved(shape, -step)
            a, b = linearised(ahead, points, normals), linearised(behind, points, normals)
            by_distance = (a.distance - b.distance) / 2e-6
            by_normal = (a.normal @ ahead.rotation.T - b.normal @ behind.rotation.T) / 2e-6
            off = np.abs(np.column_stack([by_distance, by_normal])).max()
            error = np.abs(by_distance - at.distance_slope[:, k])
            error = np.maximum(error, np.abs(by_normal - at.normal_slope[:, :, k] @ shape.rotation.T).max(axis=1))
            assert np.sort(error)[-3] < 1e-5 * max(off, 1.0), (type(shape), k)


@settings(max_examples=30, deadline=None)
@given(seed=seeds)
def test_the_nearest_point_is_on_the_ellipsoid_and_the_line_to_it_is_its_normal(seed):
    rng = np.random.default_rng(seed)
    axes = 10.0 ** rng.uniform(-1.0, 1.0, 3)
    shape = EllipsoidShape(rng.normal(size=3), random_rotation(rng), axes)
    points = shape.center + (rng.normal(size=(50, 3)) * axes) @ shape.rotation.T
    foot = points - shape.distance(points)[:, None] * shape.normal(points)
    local = (foot - shape.center) @ shape.rotation
    np.testing.assert_allclose(((local / axes) ** 2).sum(axis=1), 1.0, atol=1e-7)
    gradient = local / axes**2
    gradient /= np.linalg.norm(gradient, axis=1, keepdims=True)
    np.testing.assert_allclose(gradient @ shape.rotation.T, shape.normal(points), atol=1e-6)


@pytest.mark.parametrize("kind", list(PrimitiveKind))
def test_exact_contacts_give_the_exact_shape(kind):
    rng = np.random.default_rng(5)
    cloud, _ = felt(*PATHS[kind](rng), rng)
    fit = fit_primitive(cloud, kind)
    assert fit.verdict.ok
    assert np.abs(fit.shape.distance(cloud.position)).max() < 1e-8
    if isinstance(fit.shape, BoxShape):
        across = np.sort(fit.shape.half_sizes[np.isfinite(fit.sizes_sd[:3])])
        np.testing.assert_allclose(across, [0.02, 0.03], atol=1e-8)
        assert fit.shape.rounding == pytest.approx(0.003, abs=1e-8)
    else:
        np.testing.assert_allclose(fit.shape.sizes, SIZES[kind], atol=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("kind", list(PrimitiveKind))
@settings(max_examples=6, deadline=None)
@given(seed=seeds, exponent=st.floats(-3.0, 3.0))
def test_the_fit_moves_and_scales_with_the_contacts(kind, seed, exponent):
    rng = np.random.default_rng(seed)
    cloud, _ = felt(*PATHS[kind](rng), rng, 3e-5, NORMAL_SD, place=False)
    rotation, scale, shift = random_rotation(rng), 10.0**exponent, rng.normal(size=3)
    other = cloud_at(scale * (cloud.position @ rotation.T + shift), cloud.normal @ rotation.T)
    a, b = (fit_primitive(each, kind, offset_sd=0.0) for each in (cloud, other))
    assert [each.assumption for each in a.verdict.broken] == [each.assumption for each in b.verdict.broken]
    np.testing.assert_allclose(
        np.sort(b.shape.sizes), scale * np.sort(a.shape.sizes), rtol=1e-3, atol=1e-5 * scale
    )
    np.testing.assert_allclose(b.distance, scale * a.distance, atol=2e-6 * scale)
    assert b.position_sd == pytest.approx(scale * a.position_sd, rel=1e-2)
    assert b.normal_sd == pytest.approx(a.normal_sd, rel=1e-2)


@pytest.mark.slow
@pytest.mark.parametrize("kind", [kind for kind, sizes in SIZES.items() if sizes])
def test_claimed_standard_deviations_hold(kind):
    rng = np.random.default_rng(3)
    z = []
    for _ in range(100):
        position, normal = PATHS[kind](rng)
        at = rng.permutation(len(position))[:120]
        noisy = normal[at] + NORMAL_SD * rng.normal(size=(120, 3))
        noisy /= np.linalg.norm(noisy, axis=1, keepdims=True)
        cloud = cloud_at(position[at] + 3e-5 * rng.normal(size=(120, 3)), noisy)
        fit = fit_primitive(cloud, kind, offset_sd=0.0)
        z.append((fit.shape.sizes - SIZES[kind]) / fit.sizes_sd)
    z = np.array(z)
    # binomial sd of 100 draws of 95 % is 2.2 %, the standard deviation is known to 7 %
    assert (np.abs(z) < 1.96).mean() > 0.86
    assert 0.75 < z.std() < 1.3


SPOILED = {  # positions and normals of contacts with a fault
    "a jump": lambda x, n: (x + np.outer(3e-4 * (np.arange(len(x)) > 80), [0.6, 0.0, 0.8]), n),
    "an outlier": lambda x, n: (x + np.outer(1e-3 * (np.arange(len(x)) == 50), [0.6, 0.0, 0.8]), n),
    "leaning normals": lambda x, n: (x, n + np.array([0.03, 0.0, 0.0])),
    "waves": lambda x, n: (x + 1e-4 * np.sin(x[:, :1] / 4e-3) * n, n),
}


@pytest.mark.parametrize("name", SPOILED)
def test_systematic_errors_are_reported_and_noise_is_not(name):
    rng = np.random.default_rng(2)
    good, alike = felt(*PATHS[PrimitiveKind.SPHERE](rng), rng, 3e-5, NORMAL_SD, place=False)
    position, normal = SPOILED[name](good.position, good.normal)
    bad = cloud_at(position, normal / np.linalg.norm(normal, axis=1, keepdims=True))
    assert fit_ball(good, correlation_points=alike).verdict.ok
    assert not fit_ball(bad, correlation_points=alike).verdict.ok


def test_a_tip_of_another_size_stays_inside_the_interval():
    rng = np.random.default_rng(2)
    good, alike = felt(*PATHS[PrimitiveKind.SPHERE](rng), rng, 1e-5, NORMAL_SD)
    larger = fit_ball(cloud_at(good.position + 1e-4 * good.normal, good.normal), correlation_points=alike)
    assert abs(larger.shape.radius - 0.02) < 2.6 * larger.sizes_sd[0]


def test_a_flat_surface_is_no_sphere_no_cylinder_and_no_box():
    rng = np.random.default_rng(0)
    cloud, _ = felt(*felt_shapes.plane(rng, 0.04), rng, 1e-5, NORMAL_SD)
    assert not fit_ball(cloud).verdict.ok
    assert not fit_primitive(cloud, PrimitiveKind.CYLINDER).verdict.ok
    assert not fit_primitive(cloud, PrimitiveKind.BOX).exists
    assert fit_primitive(cloud, PrimitiveKind.PLANE).verdict.ok
    assert choose_primitive(cloud).kind is PrimitiveKind.PLANE


@pytest.mark.parametrize("kind", [PrimitiveKind.SPHERE, PrimitiveKind.CYLINDER])
def test_a_bowl_and_a_bore_are_hollow(kind):
    rng = np.random.default_rng(0)
    position, normal = PATHS[kind](rng)
    found: Any = fit_primitive(felt(position, -normal, rng, 1e-5, NORMAL_SD)[0], kind)
    assert found.shape.hollow
    assert found.shape.radius == pytest.approx(0.02, abs=1e-4)


def test_contacts_along_one_line_leave_no_nonsense():
    line = np.outer(np.linspace(0.0, 0.05, 40), [1.0, 0.0, 0.0])
    cloud = cloud_at(line, np.tile([0.0, 0.0, 1.0], (40, 1)))
    for kind in PrimitiveKind:
        fit = fit_primitive(cloud, kind)
        assert kind is PrimitiveKind.PLANE or not fit.verdict.ok, kind


@pytest.mark.slow
@pytest.mark.parametrize("kind", list(ANSWER))
def test_the_right_shape_is_chosen_or_none_where_none_fits(kind):
    """Many more cases: benchmarks/surface_maps.py."""
    cases = [random_case(kind, np.random.default_rng([seed, sum(map(ord, kind))])) for seed in range(6)]
    found = [choose_primitive(case.cloud, correlation_points=case.correlation_points).kind for case in cases]
    assert sum((None if each is None else each.value) == ANSWER[kind] for each in found) >= 5
