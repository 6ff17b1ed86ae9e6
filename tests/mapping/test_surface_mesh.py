"""Meshes of maps: closed surface nets that end only where values end, their files, layers of nearby contacts."""

import dataclasses

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.raster import cloud_of, mapped, plane_cloud, raster
from palpate.mapping import Knowledge, MapSettings, SurfaceMap, surface_mesh, write_mesh
from palpate.mapping.layers import vertex_layer
from palpate.mapping.surface_map.surface_nets import surface_nets

RADIUS = 0.008
VOLUME = 4.0 / 3.0 * np.pi * RADIUS**3


def ball(low=-1.0):
    """A sphere felt along circles of latitude from z = low R to the top."""
    parts = []
    for latitude in np.linspace(np.arcsin(low), 0.5 * np.pi - 0.02, 17 if low < 0.0 else 9):
        z, r = np.sin(latitude), np.cos(latitude)
        angle = np.arange(0.0, 2.0 * np.pi, 1e-4 / (RADIUS * max(r, 0.05)))
        parts.append(np.column_stack([r * np.cos(angle), r * np.sin(angle), np.full_like(angle, z)]))
    normal = np.concatenate(parts)
    return cloud_of(RADIUS * normal, normal)


def flat(hole=0.0):
    xy = raster(0.01, 1e-3)
    return plane_cloud(xy[np.hypot(*xy.T) >= hole])


@pytest.fixture(scope="module")
def whole():
    return surface_mesh(mapped(ball()), 0.5e-3)


@pytest.fixture(scope="module")
def half():
    """Half a ball in a map, as far as it is observed and as far as it is extrapolated."""
    made = mapped(ball(low=0.0))
    return surface_mesh(made, 0.5e-3), surface_mesh(made, 0.5e-3, worst=Knowledge.EXTRAPOLATED)


def loops(mesh):
    """Number of closed lines of open edges."""
    edges = mesh.open_edges
    return len(np.unique(trimesh.graph.connected_component_labels(edges)[np.unique(edges)]))


def test_a_whole_sphere_is_one_watertight_surface(whole):
    solid = trimesh.Trimesh(whole.vertices, whole.triangles, process=False)
    assert whole.watertight
    assert is_closed(solid, euler=2)
    assert solid.volume == pytest.approx(VOLUME, rel=0.003)
    assert np.abs(np.linalg.norm(whole.vertices, axis=1) - RADIUS).max() < 5e-6
    assert ((solid.face_normals * solid.triangles_center).sum(axis=1) > 0.0).all()  # outward
    assert (whole.knowledge == Knowledge.OBSERVED).all()
    assert (whole.sd > 0.0).all()


def test_half_a_sphere_is_open_and_ends_where_it_was_felt(half):
    mesh, wide = half
    assert not mesh.watertight
    assert mesh.vertices[:, 2].min() > -0.4e-3
    assert loops(mesh) == 1
    assert wide.vertices[:, 2].min() < -1.0e-3
    assert (wide.knowledge[wide.vertices[:, 2] < -0.5e-3] == Knowledge.EXTRAPOLATED).all()


def test_a_hole_in_the_contacts_is_a_hole_in_the_mesh():
    rows = MapSettings.for_rows(1e-3)
    full, holed = (surface_mesh(mapped(flat(hole), rows), 0.5e-3) for hole in (0.0, 4e-3))
    assert (loops(full), loops(holed)) == (1, 2)
    assert np.hypot(*holed.vertices[:, :2].T).min() > 3.4e-3
    assert np.abs(holed.vertices[:, 2]).max() < 1e-8


def test_two_sheets_of_a_thin_plate_do_not_grow_together():
    top = flat()
    below = {"position": top.position - [0.0, 0.0, 2e-3], "normal": -top.normal, "time": top.time + 1e3}
    made = mapped(top)
    made.add(dataclasses.replace(top, **below))
    mesh = surface_mesh(made)
    sheets = trimesh.graph.connected_components(mesh.triangles[:, [0, 1, 1, 2]].reshape(-1, 2), engine="scipy")
    assert len(sheets) == 2
    off = np.minimum(np.abs(mesh.vertices[:, 2]), np.abs(mesh.vertices[:, 2] + 2e-3))
    assert off.max() < 1e-8  # no third sheet between them


def test_without_contacts_the_mesh_is_empty():
    empty = surface_mesh(SurfaceMap())
    assert (len(empty.triangles), empty.watertight) == (0, False)
    assert not surface_mesh(mapped(plane_cloud(np.zeros((1, 2)))), 0.5e-3).watertight


@pytest.mark.parametrize("suffix", [".ply", ".obj", ".stl", ".PLY"])
def test_a_file_holds_the_surface(whole, tmp_path, suffix):
    path = tmp_path / f"map{suffix}"
    write_mesh(whole, path)
    read = trimesh.load_mesh(path, process=True)
    assert read.is_watertight
    assert read.volume == pytest.approx(VOLUME, rel=0.003)


def test_a_ply_holds_deviation_band_and_knowledge_of_each_vertex(half, tmp_path):
    mesh = half[1]
    write_mesh(mesh, tmp_path / "map.ply")
    raw = trimesh.load(tmp_path / "map.ply", process=False).metadata["_ply_raw"]["vertex"]["data"]
    for name, values in (("quality", mesh.sd), ("band", mesh.band()), ("knowledge", mesh.knowledge)):
        np.testing.assert_allclose(raw[name].ravel(), values, rtol=1e-6)


# --- surface nets ---

AXIS = np.linspace(-1.2, 1.2, 33)
STEP = AXIS[1] - AXIS[0]
POINTS = np.stack(np.meshgrid(AXIS, AXIS, AXIS, indexing="ij"), axis=-1)
EVERYWHERE = np.ones(POINTS.shape[:3], np.bool_)
TORUS = np.hypot(np.hypot(POINTS[..., 0], POINTS[..., 1]) - 0.7, POINTS[..., 2]) - 0.3


def sphere(radius=0.9, center=(0.0, 0.0, 0.0)):
    return np.linalg.norm(POINTS - center, axis=-1) - radius


def net(values):
    vertices, triangles = surface_nets(values, EVERYWHERE)
    return trimesh.Trimesh(AXIS[0] + STEP * vertices, triangles, process=False)


def is_closed(made, euler):
    """Whether every edge is passed once in each direction: closed, manifold along edges, and oriented alike."""
    return made.is_watertight and made.is_winding_consistent and made.euler_number == euler


@settings(max_examples=25, deadline=None)
@given(st.floats(0.3, 0.9), st.tuples(*[st.floats(-0.3, 0.3)] * 3))
def test_the_net_of_a_sphere_is_closed_wherever_it_lies(radius, center):
    made = net(sphere(radius, center))
    assert is_closed(made, euler=2)
    off = np.linalg.norm(made.vertices - center, axis=1) - radius
    # sqrt(3) of a step across, sagitta 3 / 8 at most, and linear cuts
    assert np.abs(off).max() < 0.6 * STEP**2 / radius


@pytest.mark.parametrize(
    ("values", "euler", "volume"),
    [(sphere(), 2, 4.0 / 3.0 * np.pi * 0.9**3), (TORUS, 0, 2.0 * np.pi**2 * 0.7 * 0.3**2)],
    ids=["sphere", "torus"],
)
def test_topology_and_volume(values, euler, volume):
    made = net(values)
    assert is_closed(made, euler)
    assert made.volume == pytest.approx(volume, rel=0.03)


def test_triangles_on_a_sphere_miss_it_by_little():
    made = net(sphere())
    on = 0.9 * made.vertices / np.linalg.norm(made.vertices, axis=1, keepdims=True)
    share = np.random.default_rng(0).dirichlet([1.0, 1.0, 1.0], (len(made.faces), 20))
    miss = 0.9 - np.linalg.norm(np.einsum("tkc,tcx->tkx", share, on[made.faces]), axis=-1)
    assert 0.2 < miss.max() * 0.9 / STEP**2 < 0.32


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_it_ends_only_where_values_end(seed):
    """An open edge has a cube beside it that lacks a corner, whatever is missing."""
    known = EVERYWHERE.copy()
    for middle in np.random.default_rng(seed).uniform(-0.9, 0.9, (3, 3)):
        known &= np.linalg.norm(POINTS - middle, axis=-1) > 0.35
    vertices, triangles = surface_nets(np.where(known, sphere(), 1.0), known)
    assert np.isfinite(vertices).all()
    both = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    unique, counts = np.unique(both, axis=0, return_counts=True)
    assert counts.max() <= 2
    for end in vertices[np.unique(unique[counts == 1])]:
        # in the cube, or in the next
        assert np.abs(np.argwhere(~known) - end).max(axis=1).min() <= 2.0 + 1e-12


@pytest.mark.parametrize("known", [EVERYWHERE, ~EVERYWHERE], ids=["all outside", "all unknown"])
def test_without_a_crossing_there_is_no_net(known):
    vertices, triangles = surface_nets(sphere() + 10.0 * known, known)
    assert vertices.shape == triangles.shape == (0, 3)


@pytest.mark.parametrize(("axis", "sign"), [(0, 1.0), (1, -1.0), (2, 1.0)])
def test_a_zero_on_a_corner_leaves_no_hole(axis, sign):
    """Corners at exactly zero count as outside: planes through them are whole, and face their way."""
    made = net(sign * (POINTS[..., axis] - AXIS[16]))
    assert np.ptp(made.vertices[:, axis]) == 0.0
    assert (sign * made.face_normals[:, axis] > 0.0).all()
    assert len(made.faces) == 2 * 31 * 31


# --- layers: means of the nearest contacts ---

CONTACTS, VERTICES = np.split(np.random.default_rng(0).uniform(0.0, 0.01, (100, 3)), [60])


@given(slope=st.floats(-10.0, 10.0), shift=st.floats(-10.0, 10.0))
def test_mean_and_deviation_follow_the_unit_of_the_value(slope, shift):
    value = np.sin(300.0 * CONTACTS[:, 0])
    plain, other = (vertex_layer("v", VERTICES, CONTACTS, each, 0.005) for each in (value, slope * value + shift))
    np.testing.assert_allclose(other.mean, slope * plain.mean + shift, atol=1e-9)
    np.testing.assert_allclose(other.sd, abs(slope) * plain.sd, atol=1e-7)


def test_a_constant_stays_constant_and_a_far_contact_does_not_count():
    even = vertex_layer("v", VERTICES, CONTACTS, np.full(60, 0.3), 0.1)
    np.testing.assert_allclose([even.mean, even.sd], [np.full(40, 0.3), np.zeros(40)], rtol=1e-7, atol=1e-12)
    layer = vertex_layer("v", np.outer([0.0, 1.0], np.ones(3)), np.zeros((1, 3)), np.ones(1), 0.1)
    np.testing.assert_array_equal(layer.mean, [1.0, np.nan])
    assert np.isnan(layer.sd).all()  # one contact does not scatter
    assert np.isnan(vertex_layer("v", VERTICES, np.zeros((0, 3)), np.zeros(0), 1.0).mean).all()
