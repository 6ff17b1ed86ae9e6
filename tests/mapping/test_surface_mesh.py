import dataclasses
import functools

import numpy as np
import pytest
import trimesh

from mapping.raster import cloud_of, raster
from palpate.mapping import Knowledge, MapSettings, SurfaceMap, surface_mesh, write_mesh
from palpate.mapping.surface_map import SurfaceMesh

RADIUS = 0.008


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
    xy = xy[np.hypot(*xy.T) >= hole]
    return cloud_of(np.column_stack([xy, np.zeros(len(xy))]), np.tile([0.0, 0.0, 1.0], (len(xy), 1)))


def mesh_of(cloud, voxel=0.5e-3, settings=None, **kwargs):
    made = SurfaceMap(settings)
    made.add(cloud)
    return surface_mesh(made, voxel, **kwargs)


@functools.cache
def whole_ball():
    return mesh_of(ball())


def loops(mesh):
    edges = mesh.open_edges
    return trimesh.graph.connected_component_labels(edges)[np.unique(edges)]


def test_a_whole_sphere_is_one_watertight_surface():
    mesh = whole_ball()
    assert mesh.watertight
    solid = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
    assert solid.is_watertight
    assert solid.is_winding_consistent
    assert solid.euler_number == 2
    assert solid.volume == pytest.approx(4.0 / 3.0 * np.pi * RADIUS**3, rel=0.003)
    assert np.abs(np.linalg.norm(mesh.vertices, axis=1) - RADIUS).max() < 5e-6
    outward = (solid.face_normals * solid.triangles_center).sum(axis=1)
    assert (outward > 0.0).all()
    assert (mesh.knowledge == Knowledge.OBSERVED).all()
    assert (mesh.sd > 0.0).all()


def test_half_a_sphere_is_open_and_ends_where_it_was_felt():
    mesh = mesh_of(ball(low=0.0))
    assert not mesh.watertight
    assert mesh.vertices[:, 2].min() > -0.4e-3
    assert len(np.unique(loops(mesh))) == 1
    wide = mesh_of(ball(low=0.0), worst=Knowledge.EXTRAPOLATED)
    assert wide.vertices[:, 2].min() < -1.0e-3
    assert (wide.knowledge[wide.vertices[:, 2] < -0.5e-3] == Knowledge.EXTRAPOLATED).all()


def test_a_hole_in_what_was_felt_is_a_hole_in_the_mesh():
    whole, holed = (mesh_of(flat(hole), settings=MapSettings.for_rows(1e-3)) for hole in (0.0, 4e-3))
    assert len(np.unique(loops(whole))) == 1
    assert len(np.unique(loops(holed))) == 2
    assert np.hypot(*holed.vertices[:, :2].T).min() > 3.4e-3
    assert np.abs(holed.vertices[:, 2]).max() < 1e-8


def test_two_sheets_of_a_thin_plate_do_not_grow_together():
    top = flat()
    bottom = dataclasses.replace(
        top, position=top.position - [0.0, 0.0, 2e-3], normal=-top.normal, time=top.time + 1e3
    )
    made = SurfaceMap()
    made.add(top)
    made.add(bottom)
    mesh = surface_mesh(made)
    sheets = trimesh.graph.connected_components(mesh.triangles[:, [0, 1, 1, 2]].reshape(-1, 2), engine="scipy")
    assert len(sheets) == 2
    off = np.minimum(np.abs(mesh.vertices[:, 2]), np.abs(mesh.vertices[:, 2] + 2e-3))
    assert off.max() < 1e-8  # no third sheet between them


def test_nothing_felt_is_an_empty_mesh():
    mesh = surface_mesh(SurfaceMap())
    assert len(mesh.triangles) == 0
    assert not mesh.watertight
    assert isinstance(mesh_of(cloud_of(np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]))), SurfaceMesh)


@pytest.mark.parametrize("suffix", [".ply", ".obj", ".stl", ".PLY"])
def test_a_file_holds_the_surface(tmp_path, suffix):
    path = tmp_path / f"map{suffix}"
    write_mesh(whole_ball(), path)
    read = trimesh.load_mesh(path, process=True)
    assert read.is_watertight
    assert read.volume == pytest.approx(4.0 / 3.0 * np.pi * RADIUS**3, rel=0.003)


def test_a_ply_says_how_well_each_vertex_is_known(tmp_path):
    mesh = mesh_of(ball(low=0.0), worst=Knowledge.EXTRAPOLATED)
    write_mesh(mesh, tmp_path / "map.ply")
    raw = trimesh.load(tmp_path / "map.ply", process=False).metadata["_ply_raw"]["vertex"]["data"]
    np.testing.assert_allclose(raw["quality"].ravel(), mesh.sd, rtol=1e-6)
    np.testing.assert_allclose(raw["band"].ravel(), mesh.band(), rtol=1e-6)
    np.testing.assert_array_equal(raw["knowledge"].ravel(), mesh.knowledge)
