"""Edges, corners and rims of surfaces that are traced: the plane under the tip turns round them steadily."""

import math

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.controllers import Raster
from palpate.controllers.paths import Follow, Waypoints
from palpate.sim import Box, HeightField
from palpate.sim.objects.mesh import TracedMesh
from palpate.sim.objects.mesh_file import Triangles
from palpate.sim.objects.nearest import each
from support.explored_stage import RADIUS, explored
from support.meshes import joined

STIFFNESS = 10e3
GRID = 1.0 / 1024.0
"""Numbers on it are exact: points lie on edges and in the planes of sides to the last bit."""


def mesh(*bounds):
    return TracedMesh(joined(*(trimesh.creation.box(bounds=each) for each in bounds)))


def rotated(target, turn):
    return TracedMesh(Triangles(target.triangles.vertices @ turn.T, target.triangles.faces))


SIDES = (30 * GRID, 20 * GRID, 20 * GRID)
BOX = mesh((tuple(-0.5 * s for s in SIDES), tuple(0.5 * s for s in SIDES)))
STAIR = mesh(
    ((-16 * GRID, -16 * GRID, -16 * GRID), (0.0, 16 * GRID, 0.0)),
    ((0.0, -16 * GRID, -16 * GRID), (16 * GRID, 16 * GRID, 8 * GRID)),
)
FLAT = HeightField(np.zeros((7, 9)), SIDES[0], SIDES[1])
PYRAMID = TracedMesh(  # a spike, more pointed than any box: facets of very unlike angles meet at its top
    Triangles(
        np.array([(0.0, 0.0, 16.0), (-8.0, -2.0, 0.0), (8.0, -2.0, 0.0), (0.0, 1.0, 0.0)]) * GRID,
        np.array([(0, 1, 2), (0, 2, 3), (0, 3, 1), (1, 3, 2)]),
    )
)
on_grid = st.tuples(*[st.integers(-24, 24).map(lambda k: k * GRID)] * 3)


def nearest(target, points):
    return each(target.nearest, target.parameters, np.atleast_2d(points))


@settings(max_examples=300, deadline=None, derandomize=True)
@given(on_grid)
def test_exactly_above_edges_corners_and_sides_the_normal_points_to_the_tip(point):
    found, normal = nearest(BOX, point)
    exact = Box(SIDES).signed_distance(np.array([point]))[0]
    assert np.linalg.norm(normal) == pytest.approx(1.0)
    # along the normal it is as far as the box is, with the sign of its side
    assert np.sum((np.array([point]) - found) * normal) == pytest.approx(exact, abs=1e-15)


@settings(max_examples=100, deadline=None, derandomize=True)
@given(on_grid)
def test_a_level_field_is_the_box_below_it(point):
    x, y, z = point
    depth = 1.0  # the walls of a field have no end
    box = Box((SIDES[0], SIDES[1], depth))
    exact = box.signed_distance(np.array([(x, y, z + 0.5 * depth)]))[0]
    assert FLAT.signed_distance(np.array([point]))[0] == pytest.approx(exact, abs=1e-12)
    if exact > 1e-9:
        found, normal = nearest(FLAT, point)
        assert np.sum((np.array([point]) - found) * normal) == pytest.approx(exact, abs=1e-12)
        assert np.allclose(found + exact * normal, [point], rtol=0, atol=1e-12)


TURNS = [np.eye(3), trimesh.transformations.random_rotation_matrix(np.array([0.1, 0.7, 0.3]))[:3, :3]]


@settings(max_examples=100, deadline=None, derandomize=True)
@given(on_grid, on_grid, st.sampled_from([BOX, STAIR, PYRAMID]), st.sampled_from([0, 1]))
def test_along_any_line_force_and_normal_go_on_steadily(begin, end, target, turned):
    """A tip that comes 2 mm deep at most: with a step of s its force changes by K s, its normal by no more than
    the nearest point's jump and the step explain."""
    if begin == end:
        return
    turn = TURNS[turned]
    target = rotated(target, turn) if turned else target
    points = np.linspace(turn @ np.array(begin), turn @ np.array(end), 301)
    step = np.linalg.norm(points[1] - points[0])
    found, normal = nearest(target, points)
    gap = np.sum((points - found) * normal, axis=1)
    assert np.abs(gap) == pytest.approx(np.linalg.norm(points - found, axis=1), abs=1e-12)
    inside = target.signed_distance(points) < 0.0
    free = ~inside & (gap > RADIUS - 2e-3)
    force = STIFFNESS * np.maximum(RADIUS - gap, 0.0)
    both = free[1:] & free[:-1]
    assert np.abs(np.diff(force))[both].max(initial=0.0) <= STIFFNESS * step * (1 + 1e-9) + 1e-9
    turned_by = np.linalg.norm(np.diff(normal, axis=0), axis=1)
    jump = np.linalg.norm(np.diff(found, axis=0), axis=1)
    allowed = (jump + step) / np.minimum(gap[1:], gap[:-1]).clip(1e-9)
    assert np.all(turned_by[both] <= allowed[both] * (1 + 1e-9) + 1e-9)


@pytest.mark.parametrize("target", [BOX, STAIR, PYRAMID], ids=["box", "stair", "pyramid"])
def test_pseudonormals_tell_inside_from_outside_as_windings_do(target):
    """Baerentzen and Aanaes's theorem, against counting how often the mesh winds around the point."""
    points = np.random.default_rng(1).uniform(-0.02, 0.02, (400, 3))
    found, normal = nearest(target, points)
    side = np.sum((points - found) * normal, axis=1)
    exact = target.signed_distance(points)
    # the two blocks of the stair have a wall in common: within it, either says that it is inside
    clear = np.abs(exact) > 1e-9
    assert np.array_equal(side[clear] < 0.0, exact[clear] < 0.0)


def test_a_tip_that_sweeps_over_the_rim_of_a_field_feels_nothing_beside_it():
    x, y = np.meshgrid(np.linspace(-0.008, 0.008, 17), np.linspace(-0.006, 0.006, 13))
    field = HeightField(1e-3 * np.sin(x / 4e-3) * np.cos(y / 4e-3), 0.016, 0.012)
    path = Waypoints(((0.0, 1e-3), (0.016, 1e-3)))
    e = explored(field, Follow(path), (0.0, 1e-3, field.top + RADIUS + 1e-3), approach_distance=0.015)
    e.check_ended()
    assert np.abs(field.signed_distance(e.points)).max() < 20e-6
    assert e.tip[:, 0].max() > 0.008 + 0.9 * RADIUS * math.sin(math.radians(70.0))
    assert e.most_force < 4.0


def test_rows_that_end_exactly_on_the_edges_of_a_mesh_are_swept_as_gently_as_others():
    """There the tip is to the last bit in the plane of a side; once the normal turned over for a period: 311 N."""
    raster = Raster(SIDES[0], 6 * GRID, 6 * GRID)
    start = (*raster.corners()[0], BOX.top + RADIUS + 1e-3)
    e = explored(BOX, Follow(raster), start, speed=0.04)
    e.check_ended()
    assert e.most_force < 4.0
    assert np.abs(BOX.signed_distance(e.points)).max() < 2e-5
