"""Vertical lines through meshes tell inside from outside, also through edges and corners; pieces may overlap."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.errors import InvalidValueError
from palpate.sim import Box, ConvexMesh, TracedMesh
from palpate.sim.objects.vertical import windings
from support.meshes import joined as triangles

SIDES = (0.08, 0.06, 0.04)


def box(middle=(0.0, 0.0, 0.0), sides=SIDES):
    mesh = trimesh.creation.box(sides)
    mesh.apply_translation(middle)
    return mesh


BALL, RING = trimesh.creation.icosphere(subdivisions=3, radius=0.04), trimesh.creation.torus(0.03, 0.012)
BOX_MESH, BALL_MESH, RING_MESH = (TracedMesh(triangles(mesh)) for mesh in (box(), BALL, RING))


def solid_angles(corners, points):
    """Winding numbers by Van Oosterom and Strackee (1983), of a mesh seen from points."""
    a, b, c = (corners[None, :, i] - points[:, None] for i in range(3))
    la, lb, lc = (np.linalg.norm(v, axis=2) for v in (a, b, c))
    volume = np.sum(a * np.cross(b, c), axis=2)
    rest = la * lb * lc + np.sum(a * b, axis=2) * lc + np.sum(b * c, axis=2) * la + np.sum(c * a, axis=2) * lb
    return np.sum(np.arctan2(volume, rest), axis=1) / (2.0 * np.pi)


@pytest.mark.parametrize("mesh", [BALL_MESH, RING_MESH], ids=["ball", "ring"])
def test_a_line_winds_as_the_solid_angles_do(mesh):
    points = np.random.default_rng(0).uniform(-0.05, 0.05, (300, 3))
    assert np.array_equal(windings(mesh.parameters, points), np.rint(solid_angles(mesh.triangles.corners, points)))


@pytest.mark.parametrize("mesh", [BALL_MESH, RING_MESH], ids=["ball", "ring"])
def test_lines_through_corners_and_edges_go_in_and_out_equally_often(mesh):
    corners = mesh.triangles.corners.reshape(-1, 3)
    ends = np.concatenate([corners, 0.5 * (corners + np.roll(corners, 1, axis=0))])
    for z, wanted in ((-1.0, 0), (1.0, 0)):
        assert not np.any(
            windings(mesh.parameters, np.column_stack([ends[:, :2], np.full(len(ends), z)])) - wanted
        )
    # along the edges of a box whose top and bottom are split into triangles, through whatever the line passes
    x, y = np.meshgrid(np.linspace(-0.06, 0.06, 13), np.linspace(-0.06, 0.06, 13))
    points = np.column_stack([x.ravel(), y.ravel(), 0.0 * x.ravel()])
    inside = Box(SIDES).signed_distance(points)
    found = windings(BOX_MESH.parameters, points)
    assert np.all(found[inside < -1e-12] == 1)
    assert np.all(found[inside > 1e-12] == 0)


@settings(max_examples=60, deadline=None)
@given(st.floats(-0.05, 0.05), st.floats(-0.05, 0.05))
def test_the_upper_surface_is_on_the_mesh_and_nothing_is_above_it(x, y):
    for mesh in (BALL_MESH, RING_MESH):
        z = float(mesh.height(np.array([x]), np.array([y]))[0])
        if np.isnan(z):
            assert not windings(mesh.parameters, np.array([[x, y, -1.0]]))[0]
            continue
        assert abs(mesh.signed_distance(np.array([[x, y, z]]))[0]) < 1e-12
        above = np.array([[x, y, z + h] for h in (1e-6, 1e-3, 0.1)])
        assert np.all(mesh.signed_distance(above) > 0.0)


def test_pieces_that_overlap_are_touched_as_their_union():
    one, other = (0.0, 0.0, 0.0), (0.05, 0.02, 0.01)
    mesh = TracedMesh(triangles(box(one), box(other)))
    points = np.random.default_rng(1).uniform(-0.1, 0.1, (2000, 3))
    parts = np.stack([Box(SIDES).signed_distance(points - middle) for middle in (one, other)])
    exact = parts.min(axis=0)  # outside of the union
    found = mesh.signed_distance(points)
    outside = exact > 0.0
    assert np.allclose(found[outside], exact[outside], rtol=0, atol=1e-12)
    assert np.all(found[~outside] <= 1e-12)
    assert windings(mesh.parameters, np.array([[0.03, 0.01, 0.005]]))[0] == 2


def test_a_hollow_in_a_solid_is_sound_and_a_piece_inside_out_is_not():
    inner = box(sides=(0.02, 0.02, 0.02))
    inner.invert()
    hollow = TracedMesh(triangles(box(), inner))
    assert hollow.signed_distance(np.zeros((1, 3)))[0] == pytest.approx(0.01)
    inner.apply_translation((0.1, 0.0, 0.0))
    for kind in (TracedMesh, ConvexMesh):
        with pytest.raises(InvalidValueError, match=r"12 of its triangles face inwards.*inside out"):
            kind(triangles(box(), inner))
