"""Where an object is that fingertips hold: it moves as they do, as long as nothing slips."""

import math
from collections.abc import Sequence

import numpy as np

from palpate.kinematics.pose import Pose, rotation_from_rotvec, times
from palpate.spatial import (
    IDENTITY,
    ZERO,
    Matrix,
    Vector,
    add,
    as_vector,
    cross,
    rotate,
    rotate_back,
    scale,
    subtract,
)

_ITERATIONS = 20
"""Of Gauss and Newton: turns by 0.1 rad take three, by 1 rad about ten."""

_TURNED = 1e-15
"""[rad] of a step that is rounding."""

_UNKNOWN = 1e-9
"""Of the largest: an inertia of the fingertips' middles below that is of a turn that they do not show."""


class HeldFrame:
    """Follows an object by the fingertips that hold it, however they carry it.

    Its turn is the least one that brings the middles of the fingertips, seen from their common middle, to where
    they are, in the sense of least squares. Two fingertips show no turn about the line through them; it is taken
    for none.
    """

    def __init__(self, points: Sequence[Vector], pose: Pose) -> None:
        """Take where the middles of two or more fingertips are, and the object, in any one frame [m]."""
        self._center, self._arms = _spread(points)
        a = np.array(self._arms)
        inertia = np.sum(a * a) * np.eye(3) - a.T @ a
        x, y, z = np.linalg.pinv(inertia, _UNKNOWN)
        self._compliance: Matrix = (as_vector(x), as_vector(y), as_vector(z))
        self._pose = Pose(subtract(pose.position, self._center), pose.rotation)

    def pose(self, points: Sequence[Vector]) -> Pose:
        """Return where the object is now that the fingertips are there [m]."""
        center, arms = _spread(points)
        return Pose(center, self._turn(arms)) @ self._pose

    def _turn(self, arms: Sequence[Vector]) -> Matrix:
        turn = IDENTITY
        for _ in range(_ITERATIONS):
            moment = ZERO
            for a, b in zip(self._arms, arms, strict=True):
                moment = add(moment, cross(a, rotate_back(turn, b)))
            step = rotate(self._compliance, moment)
            if math.hypot(*step) <= _TURNED:
                break
            turn = times(turn, rotation_from_rotvec(step))
        return turn


def _spread(points: Sequence[Vector]) -> tuple[Vector, list[Vector]]:
    """The middle of points, and where they are from there."""
    center = ZERO
    for point in points:
        center = add(center, point)
    center = scale(1.0 / len(points), center)
    return center, [subtract(point, center) for point in points]
