"""Moving points onto a surface: rigid, by least squares of distances to it."""

from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray
from palpate.mapping.compare_surface import TriangleSurface

STEPS = 60
"""Steps at most."""

SETTLED = 1e-7
"""Shift per step over the size of the points at which it has settled."""

MIN_EIGENVALUE_RATIO = 1e-3
"""Motions that change the squared distances by less than this share of the mean motion are left alone: a sphere
turned about itself, of which only its facets and the noise would say anything."""


@dataclass(frozen=True, slots=True, eq=False)
class Alignment:
    """The rigid motion that brought points closest.

    Attributes:
        rotation: Shape (3, 3).
        shift: Shape (3,) [m]: an aligned point is rotation @ x + shift.
        angle: Of the rotation [rad].
        distance: How far the points' middle was moved [m].
        converged: Whether it settled.
    """

    rotation: FloatArray
    shift: FloatArray
    angle: float
    distance: float
    converged: bool


def align(points: FloatArray, surface: TriangleSurface) -> Alignment:
    """Return the rigid motion that brings `points` (n, 3) closest to `surface`, near where they are.

    Point-to-plane steps (Chen and Medioni, "Object modelling by registration of multiple range images", 1992): a
    local search, which does not converge from far off, or round half a turn.
    """
    middle = points.mean(axis=0)
    size = float(np.sqrt(((points - middle) ** 2).sum(axis=1).mean())) or 1.0
    rotation, shift, converged = np.eye(3), np.zeros(3), False
    for _ in range(STEPS):
        moved = points @ rotation.T + shift
        near = surface.nearest(moved)
        # along the line to the nearest point; on the surface itself, along its normal
        offset = moved - near.point
        length = np.linalg.norm(offset, axis=1, keepdims=True)
        clear = length > 1e-9 * size
        direction = np.where(clear, offset / np.where(clear, length, 1.0), near.normal)
        arm = (moved - moved.mean(axis=0)) / size
        J = np.hstack([direction, np.cross(arm, direction)])
        A = J.T @ J
        values, motions = np.linalg.eigh(A)
        determined = motions[:, values > MIN_EIGENVALUE_RATIO * np.trace(A) / 6.0]
        values = values[values > MIN_EIGENVALUE_RATIO * np.trace(A) / 6.0]
        step = -determined @ ((determined.T @ (J.T @ (length[:, 0] * clear[:, 0]))) / values)
        turn = _rotation(step[3:] / size)
        center = moved.mean(axis=0)
        rotation = turn @ rotation
        shift = turn @ (shift - center) + center + step[:3]
        if np.linalg.norm(step) < SETTLED * size:
            converged = True
            break
    angle = float(np.arctan2(_axial(rotation), np.trace(rotation) - 1.0))
    moved_by = float(np.linalg.norm(rotation @ middle + shift - middle))
    return Alignment(rotation, shift, angle, moved_by, converged)


def _axial(R: FloatArray) -> float:
    return float(np.linalg.norm([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]))


def _rotation(rotvec: FloatArray) -> FloatArray:
    angle = float(np.linalg.norm(rotvec))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = (rotvec / angle).tolist()
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * K @ K)
