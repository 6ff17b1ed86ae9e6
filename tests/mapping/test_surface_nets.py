"""Surface nets are closed, oriented, of the right topology, and end only where values end."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.mapping.surface_map.surface_nets import surface_nets

AXIS = np.linspace(-1.2, 1.2, 33)
STEP = AXIS[1] - AXIS[0]
POINTS = np.stack(np.meshgrid(AXIS, AXIS, AXIS, indexing="ij"), axis=-1)
EVERYWHERE = np.ones(POINTS.shape[:3], np.bool_)


def sphere(radius=0.9, center=(0.0, 0.0, 0.0)):
    return np.linalg.norm(POINTS - center, axis=-1) - radius


def torus(radius=0.7, tube=0.3):
    return np.hypot(np.hypot(POINTS[..., 0], POINTS[..., 1]) - radius, POINTS[..., 2]) - tube


def edges(triangles):
    """Every edge in the direction of its triangle, shape (3 t, 2)."""
    return np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])


def solid(vertices, triangles):
    return trimesh.Trimesh(AXIS[0] + STEP * vertices, triangles, process=False)


def is_closed(made):
    """Whether every edge is passed once in each direction: closed, manifold along edges, and oriented alike."""
    return made.is_watertight and made.is_winding_consistent


@pytest.mark.parametrize(
    ("values", "euler", "holds"),
    [(sphere(), 2, 4.0 / 3.0 * np.pi * 0.9**3), (torus(), 0, 2.0 * np.pi**2 * 0.7 * 0.3**2)],
    ids=["sphere", "torus"],
)
def test_topology_and_volume(values, euler, holds):
    made = solid(*surface_nets(values, EVERYWHERE))
    assert is_closed(made)
    assert made.euler_number == euler
    assert made.volume == pytest.approx(holds, rel=0.03)


@settings(max_examples=25, deadline=None)
@given(
    st.floats(0.3, 0.8),
    st.tuples(*[st.floats(-0.3, 0.3)] * 3),
)
def test_wherever_a_sphere_lies(radius, center):
    made = solid(*surface_nets(sphere(radius, center), EVERYWHERE))
    assert is_closed(made)
    assert made.euler_number == 2
    off = np.linalg.norm(made.vertices - center, axis=1) - radius
    # sqrt(3) of a step across, sagitta 3 / 8 at most, and linear cuts
    assert np.abs(off).max() < 0.6 * STEP**2 / radius


def test_triangles_on_a_sphere_miss_it_by_little():
    vertices, triangles = surface_nets(sphere(), EVERYWHERE)
    on = AXIS[0] + STEP * vertices
    on *= 0.9 / np.linalg.norm(on, axis=1, keepdims=True)
    share = np.random.default_rng(0).dirichlet([1.0, 1.0, 1.0], (len(triangles), 20))
    inside = np.einsum("tkc,tcx->tkx", share, on[triangles])
    miss = 0.9 - np.linalg.norm(inside, axis=-1)
    assert 0.2 < miss.max() * 0.9 / STEP**2 < 0.32


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_it_ends_only_where_values_end(seed):
    """An open edge has a cube beside it that lacks a corner, whatever is missing."""
    known = EVERYWHERE.copy()
    rng = np.random.default_rng(seed)
    for middle in rng.uniform(-0.9, 0.9, (3, 3)):
        known &= np.linalg.norm(POINTS - middle, axis=-1) > 0.35
    values = np.where(known, sphere(), np.nan)
    vertices, triangles = surface_nets(np.where(known, values, 1.0), known)
    assert np.isfinite(vertices).all()
    both = np.sort(edges(triangles), axis=1)
    unique, counts = np.unique(both, axis=0, return_counts=True)
    assert counts.max() <= 2
    open_ends = vertices[np.unique(unique[counts == 1])]
    unknown = np.argwhere(~known)
    for end in open_ends:
        assert np.abs(unknown - end).max(axis=1).min() <= 2.0 + 1e-12  # in the cube, or in the next


def test_of_nothing_comes_nothing():
    for values, known in ((sphere() + 10.0, EVERYWHERE), (sphere(), np.zeros_like(EVERYWHERE))):
        vertices, triangles = surface_nets(values, known)
        assert vertices.shape == (0, 3)
        assert triangles.shape == (0, 3)


def test_a_zero_on_a_corner_leaves_no_hole():
    """Corners at exactly zero count as outside: planes through them are whole, and face their way."""
    for axis, sign in ((0, 1.0), (1, -1.0), (2, 1.0)):
        made = solid(*surface_nets(sign * (POINTS[..., axis] - AXIS[16]), EVERYWHERE))
        assert np.ptp(made.vertices[:, axis]) == 0.0
        assert (sign * made.face_normals[:, axis] > 0.0).all()
        assert len(made.faces) == 2 * 31 * 31
