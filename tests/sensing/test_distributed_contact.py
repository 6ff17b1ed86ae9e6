"""Section 2 of the paper: of a contact that is spread over a patch, the centroid lies among the points that press.

Points p_i of a small patch press with forces h_i, h_i.n_i < 0, any friction; only the sum of forces and moments is
felt. On a plane the centroid lies in the convex hull of the points, exactly: the tangential forces all act in the
plane, and their moment is spin. Where the patch is curved it rises by up to d^2/2R over its radius d; friction
there has a moment that is not spin and moves the centroid by about friction times that.
"""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from palpate import Cylinder, Ellipsoid, Plane, Sphere, contact_from_wrench

SIZE = 0.01


def pressing(rng, points, normals, most_friction):
    """The wrench of random pressing forces, and the largest friction of them over the smallest normal force."""
    n = len(points)
    along = np.cross(normals, rng.normal(size=(n, 3)))
    along *= (rng.uniform(0, most_friction, n) / np.linalg.norm(along, axis=1))[:, None]
    h = 10 ** rng.uniform(-1, 1, (n, 1)) * (along - normals)
    return np.concatenate([h.sum(axis=0), np.cross(points, h).sum(axis=0)])


def outside(points, point):
    """How far a point of the plane lies outside the convex hull of others, shape (n, 2); negative inside."""
    rows = ConvexHull(points).equations
    return float((rows[:, :2] @ point + rows[:, 2]).max())


def patch(rng, surface, d, n=6):
    """n points within d of each other on a quadric, their normals, and a tangent basis in their middle."""
    a = np.array(surface.half_lengths)
    A2 = 1 / a**2
    finite = np.isfinite(a)
    u = np.where(finite, rng.normal(size=3), 0.0)
    middle = np.where(finite, np.where(finite, a, 0.0) * u / np.linalg.norm(u), rng.normal(size=3) * SIZE)
    normal = A2 * middle / np.linalg.norm(A2 * middle)
    basis = np.linalg.svd(normal[None, :])[2][1:]
    x = middle + d * rng.uniform(-1, 1, (n, 2)) @ basis
    for _ in range(30):  # back to the surface, along the normal in the middle
        x -= ((x * A2 * x).sum(axis=1) - 1)[:, None] / (2 * (A2 * x) @ normal)[:, None] * normal
    normals = A2 * x
    return x, normals / np.linalg.norm(normals, axis=1)[:, None], basis


@pytest.mark.parametrize("count", [3, 5, 12])
def test_on_a_plane_the_centroid_lies_in_the_hull_exactly(count):
    """However large the patch and the friction."""
    rng = np.random.default_rng(count)
    for friction in (0.0, 0.5, 2.0, 20.0):
        for _ in range(60):
            points = np.column_stack([SIZE * rng.uniform(-1, 1, (count, 2)), np.full(count, SIZE)])
            wrench = pressing(rng, points, np.tile([0.0, 0.0, 1.0], (count, 1)), friction)
            found = contact_from_wrench(Plane(SIZE), wrench)
            assert found.status == 0
            assert outside(points[:, :2], found.centroid[:2]) <= 1e-12 * SIZE * max(1.0, friction)
            assert found.centroid[2] == pytest.approx(SIZE)


TIPS = {
    "sphere": (Sphere(SIZE), SIZE),
    "ellipsoid": (Ellipsoid((SIZE, 1.5 * SIZE, 2 * SIZE)), SIZE / 4),  # least radius of curvature: a^2/c at least
    "cylinder": (Cylinder(SIZE), SIZE),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", TIPS)
@pytest.mark.parametrize("friction", [0.0, 0.5, 2.0])
def test_on_a_curved_patch_it_lies_in_the_hull_within_the_warp(name, friction):
    """Within (1 + friction) d^2/2R: of second order, a hundredth for a patch a tenth as wide.

    The spin torque is at most that of the friction at the reach of the patch: normals differ by d/R at most,
    and the lever is the width of the patch.
    """
    surface, R = TIPS[name]
    rng = np.random.default_rng(7)
    for d in (0.1 * R, 0.01 * R, 0.001 * R):
        worst = -np.inf
        for _ in range(150):
            points, normals, basis = patch(rng, surface, d, n=3)
            found = contact_from_wrench(surface, pressing(rng, points, normals, friction))
            assert found.status == 0
            assert found.normal_force > 0
            assert abs(found.spin_torque) <= (friction + d / R) * found.normal_force * 4 * d
            worst = max(worst, outside(points @ basis.T, basis @ found.centroid))
        assert worst <= 0.5 * (1.0 + friction) * d**2 / R


def test_the_wrench_axis_point_need_not_lie_there():
    """It is off by |q| |f_t| / |f|^2 (the paper's eq. 10), however small the patch."""
    rng, outsiders = np.random.default_rng(9), 0
    for _ in range(100):
        points = np.column_stack([SIZE * rng.uniform(-1, 1, (4, 2)), np.full(4, SIZE)])
        wrench = pressing(rng, points, np.tile([0.0, 0.0, 1.0], (4, 1)), 2.0)
        soft, hard = (contact_from_wrench(Plane(SIZE), wrench, model=model) for model in ("soft", "hard"))
        outsiders += outside(points[:, :2], hard.centroid[:2]) > 0
        tangential, force = np.linalg.norm(soft.tangential_force), np.linalg.norm(soft.force)
        expected = abs(soft.spin_torque) * tangential / force**2
        assert np.linalg.norm(hard.centroid - soft.centroid) == pytest.approx(expected, rel=1e-9)
    assert outsiders > 3
