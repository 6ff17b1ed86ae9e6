"""The box that a tip must stay within."""

import math
from dataclasses import dataclass

from palpate.errors import InvalidValueError
from palpate.spatial import Vector


@dataclass(frozen=True, slots=True)
class Room:
    """A box along the axes of the base.

    A controller that keeps to it reports what lies outside as out of reach. The supervisor would end the run: its
    workspace should reach farther, by what a tip needs to stop.

    Attributes:
        lower: Smallest position of the tip frame [m].
        upper: Largest position of the tip frame [m].
    """

    lower: Vector = (-math.inf, -math.inf, -math.inf)
    upper: Vector = (math.inf, math.inf, math.inf)

    def __post_init__(self) -> None:
        for axis, low, high in zip("xyz", self.lower, self.upper, strict=True):
            if not low < high:
                raise InvalidValueError(
                    f"room along {axis} is [{low:g}, {high:g}] m: must not be empty; give lower below upper"
                )

    def holds(self, position: Vector) -> bool:
        """Return whether a position [m] lies inside."""
        (x, y, z), (a, b, c), (d, e, f) = position, self.lower, self.upper
        return a <= x <= d and b <= y <= e and c <= z <= f


UNBOUNDED = Room()
