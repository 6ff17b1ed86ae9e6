"""What a fingertip is calibrated on: a point, a line or a plane that stands still, about where it is believed.

Nothing of it needs to be measured beforehand but the radius that rounds it: of a ball, a needle's point, a rod, an
edge. Where it is and how it is turned is found together with the tip.
"""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from palpate.errors import FloatArray, InvalidValueError, check_positive, not_negative, vector
from palpate.spatial import ZERO, Vector

LARGEST_RADIUS = 0.1
"""[m] of a ball or rod: beyond, it is a number in millimetres."""


class TargetKind(StrEnum):
    """What of a target is flat: nothing, one direction, two."""

    POINT = "point"
    LINE = "line"
    PLANE = "plane"


@dataclass(frozen=True, slots=True)
class TouchTarget:
    """Something that is touched.

    Attributes:
        name: In tables and messages.
        kind: A ball or needle is a point, a rod or edge a line, a plate a plane.
        place: A point of it, base frame [m]: the ball's centre, on the rod's axis, on the plate.
        direction: Of the line, or the plane's outward normal, base frame; of any length. No matter for a point.
        radius: That rounds it [m]; 0 for a sharp one and for a plate.
        place_sd: Standard deviation of `place`, each axis [m].
        direction_sd: Of the direction, about each axis [rad].
    """

    name: str
    kind: TargetKind
    place: Vector
    direction: Vector = ZERO
    radius: float = 0.0
    place_sd: float = 2e-3
    direction_sd: float = 0.05

    def __post_init__(self) -> None:
        vector("place", self.place, 3, "m")
        length = float(np.linalg.norm(vector("direction", self.direction, 3, "")))
        if self.kind is not TargetKind.POINT and not length > 0.0:
            what = "a line's direction" if self.kind is TargetKind.LINE else "a plane's outward normal"
            raise InvalidValueError(f"target {self.name}: direction = {self.direction}: give {what}")
        if not_negative("radius", self.radius, "m") > LARGEST_RADIUS:
            raise InvalidValueError(
                f"target {self.name}: radius = {self.radius:g} m: must be at most {LARGEST_RADIUS:g} m"
            )
        if self.kind is TargetKind.PLANE and self.radius > 0.0:
            raise InvalidValueError(f"target {self.name}: radius = {self.radius:g} m: a plane has none")
        check_positive(self, place_sd="m", direction_sd="rad")

    @property
    def unit(self) -> FloatArray:
        """Its direction, of length 1, shape (3,); zeros for a point."""
        if self.kind is TargetKind.POINT:
            return np.zeros(3)
        direction = np.array(self.direction)
        return np.asarray(direction / np.linalg.norm(direction))

    @property
    def free_directions(self) -> FloatArray:
        """Directions in which its place matters, as rows, base frame, shape (3, 3), (2, 3) or (1, 3)."""
        if self.kind is TargetKind.POINT:
            return np.eye(3)
        if self.kind is TargetKind.PLANE:
            return self.unit[None]
        return across(self.unit)


def across(unit: FloatArray) -> FloatArray:
    """Return two unit vectors at right angles to one another and to `unit` (..., 3), shape (..., 2, 3)."""
    helper = np.zeros_like(unit)
    np.put_along_axis(helper, np.argmin(np.abs(unit), axis=-1)[..., None], 1.0, axis=-1)
    first = np.cross(unit, helper)
    first /= np.linalg.norm(first, axis=-1, keepdims=True)
    return np.asarray(np.stack([first, np.cross(unit, first)], axis=-2), dtype=float)
