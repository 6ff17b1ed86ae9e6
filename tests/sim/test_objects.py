"""Distances to the simulated objects: exact on points whose distance is known by construction."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from palpate.sim import Box, CylinderObject, EllipsoidObject

FLAT, NEEDLE, ROUND = (0.05, 0.04, 0.0005), (0.001, 0.001, 0.1), (0.03, 0.03, 0.03)
DEFAULT = (0.05, 0.04, 0.03)


def ellipsoid_point(axes, direction):
    """A point of the surface and the outward unit normal there."""
    axes = np.array(axes)
    point = axes * direction / np.linalg.norm(direction)
    normal = point / axes**2
    return point, normal / np.linalg.norm(normal)


def nearest_by_sampling(axes, point, n=200):
    """Distance to the surface by search over directions, refined: an upper bound, accurate to ~1e-9.

    Directions are those to three faces of a cube: angles would not tell one another apart at the poles.
    """
    point, least = np.abs(point), np.inf
    for face in range(3):
        s, t = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n))
        step = 1 / (n - 1)
        for _ in range(12):
            to = np.insert(np.stack([s, t], axis=-1), face, 1.0, axis=-1)
            d = np.linalg.norm(to / np.linalg.norm(to, axis=-1, keepdims=True) * axes - point, axis=-1)
            least = min(least, d.min())
            i = np.unravel_index(d.argmin(), d.shape)
            w = np.linspace(-2 * step, 2 * step, 41)
            s, t = np.meshgrid(np.clip(s[i] + w, 0, 1), np.clip(t[i] + w, 0, 1))
            step /= 10
    return least


axes_strategy = st.one_of(st.tuples(*[st.floats(0.005, 0.1)] * 3), st.sampled_from([FLAT, NEEDLE, ROUND, DEFAULT]))
octant = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda d: np.linalg.norm(d) > 0.1)


@settings(max_examples=200, deadline=None, derandomize=True)
@given(axes_strategy, octant, st.floats(0.0, 0.2), st.floats(0.0, 0.99))
def test_the_distance_to_an_ellipsoid_is_that_along_its_normal(axes, direction, outside, part):
    # no two normals meet nearer to the surface than its smallest radius of curvature, min^2/max
    inside = part * min(axes) ** 2 / max(axes)
    point, normal = ellipsoid_point(axes, direction)
    found = EllipsoidObject(axes).signed_distance(point + np.array([outside, -inside])[:, None] * normal)
    rounding = 1e-15 + 1e-13 * max(axes)
    assert found[0] == pytest.approx(outside, rel=1e-9, abs=rounding)
    assert found[1] == pytest.approx(-inside, rel=1e-7, abs=rounding)


def test_the_center_of_an_ellipsoid_lies_its_least_semi_axis_deep():
    for axes in (DEFAULT, FLAT, NEEDLE, ROUND):
        assert EllipsoidObject(axes).signed_distance(np.zeros((1, 3)))[0] == pytest.approx(-min(axes), rel=1e-9)


@pytest.mark.slow
@settings(max_examples=40, deadline=None, derandomize=True)
@given(
    st.sampled_from([DEFAULT, ROUND, (0.03, 0.05, 0.04), (0.02, 0.05, 0.02)]),
    st.tuples(*[st.floats(-1.2, 1.2)] * 3),
    st.sampled_from([(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (0, 1, 1), (1, 0, 1), (1, 1, 1)]),
)
@example(DEFAULT, (0.2, 0.2, 1e-20), (1, 1, 1))
@example(DEFAULT, (0.1, 0.0, 0.0), (1, 0, 0))
@example((0.03, 0.05, 0.04), (0.0, 0.001, 0.9882), (0, 1, 1))
@example((0.02, 0.05, 0.02), (0.0, 0.001, 2 / 3), (0, 1, 1))
def test_points_anywhere_on_axes_and_planes_of_symmetry_too(axes, part, mask):
    point = np.array(part) * mask * axes
    found = EllipsoidObject(axes).signed_distance(point[None])[0]
    assert abs(found) == pytest.approx(nearest_by_sampling(np.array(axes), point), rel=1e-5, abs=1e-8)
    level = np.sum((point / axes) ** 2)
    if abs(level - 1.0) > 1e-9:
        assert (found > 0.0) == (level > 1.0)


def test_a_box_measures_to_faces_edges_and_corners():
    box = Box((0.08, 0.06, 0.04))
    points = [
        [0.0, 0.0, 0.0],
        [0.0, 0.0, 0.02],
        [0.0, 0.0, 0.03],
        [0.039, 0.0, 0.0],
        [0.043, 0.034, 0.0],  # 3-4-5 over an edge
        [0.041, 0.032, 0.022],  # 1-2-2 over a corner
    ]
    assert np.allclose(box.signed_distance(np.array(points)), [-0.02, 0.0, 0.01, -0.001, 0.005, 0.003])


def test_a_cylinder_lies_along_x():
    cylinder = CylinderObject(0.03, 0.12)
    points = [
        [0.0, 0.0, 0.0],
        [0.05, 0.0, 0.03],
        [0.0, 0.024, 0.032],
        [0.0599, 0.0, 0.0],
        [0.063, 0.0, 0.034],  # 3-4-5 over the rim
    ]
    assert np.allclose(cylinder.signed_distance(np.array(points)), [-0.03, 0.0, 0.01, -0.0001, 0.005])
