"""The plane in which a path is drawn, and along whose axis the tip comes and goes."""

import math
from dataclasses import dataclass

from palpate.errors import rotation_matrix, vector
from palpate.spatial import IDENTITY, ZERO, Matrix, Vector, add, dot, rotate, rotate_back, subtract

Point = tuple[float, float]
"""(u, v) in the plane of the path [m]; in the default plane x and y of the base."""

FLATTEST = 0.05
"""Least cosine between normal and axis for which a slope is given: 87 degrees; a height is no function beyond."""


@dataclass(frozen=True, slots=True)
class PathPlane:
    """Where u, v and the height above them lie in the base frame.

    Attributes:
        origin: Where u = v = 0 and the height is 0, base frame [m].
        rotation_base_plane: Maps (u, v, height) to base coordinates; its third column is the axis, which points
            away from the object: the tip approaches against it.
    """

    origin: Vector = ZERO
    rotation_base_plane: Matrix = IDENTITY

    def __post_init__(self) -> None:
        vector("origin", self.origin, 3, "m")
        rotation_matrix("rotation_base_plane", self.rotation_base_plane)

    @property
    def axis(self) -> Vector:
        """Unit vector away from the object, base frame."""
        a, b, c = self.rotation_base_plane
        return (a[2], b[2], c[2])

    def base(self, point: Point, height: float = 0.0) -> Vector:
        """Return a point of the plane in base coordinates [m]."""
        return add(self.origin, rotate(self.rotation_base_plane, (point[0], point[1], height)))

    def flat(self, position: Vector) -> Vector:
        """Return (u, v, height) of a position in base coordinates [m]."""
        return rotate_back(self.rotation_base_plane, subtract(position, self.origin))

    def slopes(self, normal: Vector) -> Point | None:
        """Return (dh/du, dh/dv) of a surface with this outward normal (base); None where it is too steep."""
        u, v, h = rotate_back(self.rotation_base_plane, normal)
        return None if h < FLATTEST else (-u / h, -v / h)

    def steepness(self, normal: Vector) -> float:
        """Return the angle between the outward normal (base) and the axis [rad]."""
        return math.acos(min(max(dot(normal, self.axis), -1.0), 1.0))
