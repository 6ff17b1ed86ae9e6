"""What scans over a rectangle have in common."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from palpate.controllers.paths import Point
from palpate.errors import FloatArray
from palpate.experiments.explore.fit import Region


@dataclass(frozen=True, slots=True)
class OverRectangle:
    """A scan over a rectangle.

    Attributes:
        region: The rectangle.
    """

    region: Region

    @property
    def box(self) -> tuple[Point, Point]:
        """As `Scan`."""
        return self.region.corners

    @property
    def corners(self) -> tuple[Point, ...]:
        """As `Scan`."""
        (x0, y0), (x1, y1) = self.box
        return (x0, y0), (x1, y0), (x1, y1), (x0, y1)

    @property
    def row(self) -> float:
        """As `Scan`."""
        return self.region.width

    @property
    def length(self) -> float:
        """As `Scan`."""
        return math.nan

    def passes(self, places: FloatArray) -> npt.NDArray[np.bool_]:
        """As `Scan`."""
        return self.region.holds(places)
