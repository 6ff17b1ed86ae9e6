"""A raster: parallel rows over a rectangle, joined at alternate ends."""

import math
from dataclasses import dataclass
from itertools import pairwise

from palpate.controllers.paths.plane import Point
from palpate.controllers.paths.spacing import check_spacing
from palpate.errors import positive


@dataclass(frozen=True, slots=True)
class Raster:
    """Rows along u, stepping along v: x and y of the base, unless the path's plane is another.

    Attributes:
        width: Extent along u [m].
        depth: Extent along v [m].
        spacing: Distance between rows [m], an upper bound: the rows are spread evenly.
        center: Middle of the rectangle, in the plane of the path [m].
    """

    width: float
    depth: float
    spacing: float
    center: Point = (0.0, 0.0)

    def __post_init__(self) -> None:
        positive("raster width", self.width, "m")
        positive("raster depth", self.depth, "m")
        positive("raster spacing", self.spacing, "m")
        check_spacing("raster", self.spacing, "depth", self.depth)

    @property
    def rows(self) -> int:
        """Number of rows."""
        return math.ceil(self.depth / self.spacing - 1e-9) + 1

    def corners(self) -> tuple[Point, ...]:
        """Return the corners of the path, in order."""
        x, y = self.center
        corners = []
        for row in range(self.rows):
            along = y - self.depth / 2 + self.depth * row / (self.rows - 1)
            ends = [(x - self.width / 2, along), (x + self.width / 2, along)]
            corners += ends if row % 2 == 0 else ends[::-1]
        return tuple(corners)

    @property
    def length(self) -> float:
        """Length of the path, in its plane [m]."""
        corners = self.corners()
        return sum(math.dist(a, b) for a, b in pairwise(corners))
