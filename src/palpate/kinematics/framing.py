"""Where a camera stands that has everything in view, and no farther away."""

from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.spatial import Vector, as_vector

UP = (0.0, 0.0, 1.0)
"""Of pictures."""


@dataclass(frozen=True, slots=True)
class Framing:
    """A camera.

    Attributes:
        looks_at: Middle of the picture, base frame [m].
        position: Of the camera, base frame [m].
    """

    looks_at: Vector
    position: Vector

    @property
    def distance(self) -> float:
        """Between the two [m]."""
        return float(np.linalg.norm(np.subtract(self.position, self.looks_at)))


def framing(points: FloatArray, towards: Vector, angle: float, aspect: float, room: float = 1.0) -> Framing:
    """Return the camera nearest to the middle of some points that has all of them in its picture.

    A point at r from the middle is seen at right.r and up.r, from the distance d - towards.r; it is in the picture
    if neither is more than that distance times the tangent of half the angle of view.

    Args:
        points: Shape (n, 3), one or more [m].
        towards: From the middle to the camera; its length does not matter, but it is not vertical.
        angle: Of view, from top to bottom [rad].
        aspect: Width of the picture over its height.
        room: How much larger the picture is than it need be.

    Raises:
        InvalidValueError: There are no points.
    """
    if not len(points):
        raise InvalidValueError("there are no points to look at: must be one or more")
    low, high = points.min(axis=0), points.max(axis=0)
    middle = (low + high) / 2.0
    back = np.array(towards) / np.linalg.norm(towards)
    right = np.cross(UP, back)
    right /= np.linalg.norm(right)
    up = np.cross(back, right)
    tangent = np.tan(angle / 2.0)
    seen = points - middle
    across = np.maximum(np.abs(seen @ up), np.abs(seen @ right) / aspect) * room / tangent
    distance = float(np.max(across + seen @ back))
    # points in one place, or in a line with the camera, which stays outside
    distance = max(distance, 0.55 * float(np.linalg.norm(high - low)), 1e-3)
    return Framing(as_vector(middle), as_vector(middle + distance * back))
