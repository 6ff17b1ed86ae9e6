"""Curvature of the map and of rolling: that of known surfaces, whatever moves or scales; and how sure it is."""

import dataclasses

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from surface_shapes import SHAPES, Noise, felt

from mapping.covariances import surface_covariance
from mapping.raster import CENTER, RADIUS, cloud_of, mapped, raster, sphere_cap
from palpate.mapping import MapSettings, SurfaceMap, SurfaceModel, surface_mesh
from palpate.mapping.curvature_layers import curvature_layers
from palpate.mapping.layers import write_layered_mesh
from palpate.mapping.rolling import rolled_curvature
from palpate.mapping.surface_map import surface_curvature
from palpate.mapping.surface_map.covariance import bend_covariance, bend_variance

QUIET = MapSettings(model=SurfaceModel(noise=1e-6, tilt=1e-4))


def saddle(half=6e-3, row=1e-3, a=-40.0, b=60.0):
    """z = (a x^2 + b y^2) / 2 from above: principal curvatures -a and -b in the middle."""
    x, y = raster(half, row).T
    normal = np.column_stack([-a * x, -b * y, np.ones_like(x)])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return cloud_of(np.column_stack([x, y, 0.5 * (a * x * x + b * y * y)]), normal)


def quiet(cloud):
    return mapped(cloud, QUIET)


ORIGIN, UP = np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]])
TOP = CENTER[None] + RADIUS * UP


def rolled_at(made, x):
    return rolled_curvature(made.stretches, x, UP, made.model, 2e-3)


def test_covariances_of_second_derivatives_are_derivatives_of_those_of_slopes():
    model, h = SurfaceModel(), 1e-6
    xy, at = np.random.default_rng(0).uniform(-4e-3, 4e-3, (2, 5, 2))
    K = bend_covariance(xy, at, model).reshape(15, 3, 5)
    for axis, entries in enumerate(((0, 1), (1, 2))):
        step = h * np.eye(2)[axis]
        ahead, behind = (
            surface_covariance(np.vstack([xy, at + s * step]), model)[:, :5, 1:, 5:] for s in (1.0, -1.0)
        )
        change = ((ahead - behind) / (2.0 * h)).reshape(15, 2, 5)
        np.testing.assert_allclose(K[:, entries], change, atol=1e-5 * np.abs(K).max())


def test_before_anything_is_felt_curvature_is_as_uncertain_as_the_model_says():
    model = SurfaceModel(curvature=70.0)
    assert bend_variance(model)[0, 0] == pytest.approx(70.0**2)
    # no direction is special: the variance of t'Ht is the same for every unit t
    angle = np.linspace(0.0, np.pi, 7)
    row = np.stack([np.cos(angle) ** 2, 2 * np.sin(angle) * np.cos(angle), np.sin(angle) ** 2], axis=1)
    np.testing.assert_allclose(np.einsum("ni,ij,nj->n", row, bend_variance(model), row), 70.0**2)


def test_a_saddle_is_curved_in_both_directions_and_far_from_contacts_nothing_is_claimed():
    found = surface_curvature(quiet(saddle()), np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]]))
    np.testing.assert_allclose(found.principal[0], [40.0, -60.0], atol=0.5)
    np.testing.assert_allclose(np.abs(found.directions[0, [0, 1], [0, 1]]), 1.0, atol=1e-3)
    assert found.direction_sd[0] < 0.1
    assert found.observed.tolist() == [True, False]
    assert np.isnan(found.principal[1]).all()
    assert np.isnan(surface_curvature(SurfaceMap(), ORIGIN).mean).all()


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=3, deadline=None)
def test_curvature_turns_with_the_object_and_falls_with_its_size(seed):
    rng = np.random.default_rng(seed)
    R, p = Rotation.random(rng=rng).as_matrix(), rng.normal(size=3)
    cloud, x = saddle(half=3e-3), np.array([[1e-3, 0.5e-3, 0.0]])
    here = surface_curvature(quiet(cloud), x)
    moved = dataclasses.replace(cloud, position=cloud.position @ R.T + p, normal=cloud.normal @ R.T)
    there = surface_curvature(quiet(moved), x @ R.T + p)
    np.testing.assert_allclose(there.principal, here.principal, rtol=1e-5)
    np.testing.assert_allclose(there.sd, here.sd, rtol=1e-5)
    assert abs(there.directions[0, 0] @ R @ here.directions[0, 0]) == pytest.approx(1.0, abs=1e-6)


def test_a_sphere_has_no_direction():
    found = surface_curvature(quiet(sphere_cap(half=6e-3, row=1e-3)), TOP)
    np.testing.assert_allclose(found.principal, 1.0 / RADIUS, atol=0.05)
    assert found.direction_sd[0] > 0.5


def test_normals_alone_give_the_same_curvature_whatever_heights_err():
    cloud = saddle()
    found = rolled_at(quiet(cloud), ORIGIN)
    np.testing.assert_allclose(found.principal[0], [40.0, -60.0], atol=1.0)
    assert found.mean[0] == pytest.approx(-10.0, abs=0.5)
    sunk = cloud.position - 1e-4 * np.sin(500.0 * cloud.position[:, :1]) * UP
    other = rolled_at(quiet(dataclasses.replace(cloud, position=sunk)), ORIGIN)
    assert other.mean[0] == pytest.approx(found.mean[0], rel=1e-2)


def test_one_row_does_not_determine_how_the_surface_bends_across_it():
    cap = sphere_cap(half=6e-3, row=1e-3)
    row = cap.select(np.abs(cap.position[:, 1] - CENTER[1]) < 1e-9)
    assert np.isnan(rolled_at(quiet(row), TOP).mean[0])


@pytest.mark.slow
@pytest.mark.parametrize("shape", [each for each in SHAPES if each.name != "rounded box"], ids=lambda s: s.name)
def test_with_noise_both_are_as_far_off_as_they_say(shape):
    """Normals err as they claim; the map's process is rougher than these surfaces and claims more than it errs."""
    rng = np.random.default_rng(0)
    u, v = (
        low + np.array([0.0, share]) * (high - low) for share, (low, high) in ((0.3, shape.u), (0.35, shape.v))
    )
    part = dataclasses.replace(shape, u=tuple(u), v=tuple(v))
    cloud = felt(*part.surface(*part.rows(1e-3)), Noise(), rng)
    made = mapped(cloud)
    u, v = rng.uniform(*part.u, 400), rng.uniform(*part.v, 400)
    points, normals = part.surface(u, v)
    found = surface_curvature(made, points)
    rolled = rolled_curvature(made.stretches, points, normals, made.model, 2e-3)
    seen, truth = found.observed, mean_curvature(part, u, v)
    for mean, sd, expected in ((found.mean, found.mean_sd, (0.3, 1.0)), (rolled.mean, rolled.mean_sd, (0.8, 1.2))):
        score = ((mean - truth) / sd)[seen]
        # some 100 independent values of 4 mm^2 tell a standard deviation to 7 %: 20 % are three of that
        assert expected[0] <= np.sqrt((score**2).mean()) <= expected[1]
        assert (np.abs(score) <= 1.96).mean() >= 0.90
    # what 0.5 degrees leave in two dozen stretches within 2 mm; heights err less than half of what they claim
    assert np.median(rolled.mean_sd[seen]) == pytest.approx(4.0, rel=0.1)
    assert np.sqrt(((found.mean - truth)[seen] ** 2).mean()) < 0.5 * np.median(found.mean_sd[seen])


def mean_curvature(shape, u, v):
    """Half the divergence of the normal, from differences."""
    step = [1e-5 * (shape.u[1] - shape.u[0]), 1e-5 * (shape.v[1] - shape.v[0])]
    tangent, turn = [], []
    for k in range(2):
        ahead, behind = (
            shape.surface(u + s * step[0] * (k == 0), v + s * step[1] * (k == 1)) for s in (1.0, -1.0)
        )
        tangent.append((ahead[0] - behind[0]) / (2.0 * step[k]))
        turn.append((ahead[1] - behind[1]) / (2.0 * step[k]))
    first = np.stack([[(a * b).sum(axis=1) for b in tangent] for a in tangent]).transpose(2, 0, 1)
    second = np.stack([[(a * b).sum(axis=1) for b in turn] for a in tangent]).transpose(2, 0, 1)
    return 0.5 * np.trace(np.linalg.solve(first, second), axis1=1, axis2=2)


def test_a_mesh_file_keeps_curvature(tmp_path):
    made = quiet(saddle(half=4e-3))
    mesh = surface_mesh(made, 0.8e-3)
    layers = curvature_layers(made, mesh)
    write_layered_mesh(mesh, layers, tmp_path / "map.ply")
    raw = trimesh.load(tmp_path / "map.ply", process=False).metadata["_ply_raw"]["vertex"]["data"]
    for name in ("curvature_max", "curvature_min_sd", "curvature_rolled", "curvature_direction_z"):
        assert len(raw[name]) == len(mesh.vertices)
    middle = np.linalg.norm(mesh.vertices, axis=1).argmin()
    assert float(np.ravel(raw["curvature_max"])[middle]) == pytest.approx(40.0, abs=3.0)
    direction = np.column_stack([np.ravel(raw[f"curvature_direction_{axis}"]) for axis in "xyz"])
    np.testing.assert_allclose(np.linalg.norm(direction, axis=1), 1.0, atol=1e-5)
