"""A path given point by point."""

import math
from dataclasses import dataclass
from itertools import pairwise

from palpate.controllers.paths.plane import Point
from palpate.errors import InvalidValueError

CLOSEST = 1e-4
"""Neighbours must be farther apart [m]: as close as a corner counts as reached."""


@dataclass(frozen=True, slots=True)
class Waypoints:
    """Straight lines from point to point.

    Attributes:
        points: In the plane of the path [m], at least two.
    """

    points: tuple[Point, ...]

    def __post_init__(self) -> None:
        if len(self.points) < 2:
            raise InvalidValueError(f"the path has {len(self.points)} points: it needs at least 2")
        for a, b in pairwise(self.points):
            if not CLOSEST < math.dist(a, b) < math.inf:
                raise InvalidValueError(
                    f"points {a} and {b} m: must be finite and more than {CLOSEST:g} m apart to give a direction"
                )

    @property
    def length(self) -> float:
        """Length of the path [m]."""
        return sum(math.dist(a, b) for a, b in pairwise(self.points))

    def corners(self) -> tuple[Point, ...]:
        """Return the points."""
        return self.points
