"""Rows over a rectangle."""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from palpate.controllers import Raster
from palpate.controllers.paths import Follow, PathPlane, Point, Rows, Strategy
from palpate.errors import FloatArray
from palpate.experiments.explore_fit import Region
from palpate.experiments.scans.beyond import Beyond, longest_hops
from palpate.experiments.scans.effort import Effort


@dataclass(frozen=True, slots=True)
class RasterScan:
    """Rows over a rectangle.

    Attributes:
        region: The rectangle.
        spacing: Of rows [m].
        beyond: Where it leaves the object; None: it does not.
    """

    region: Region
    spacing: float
    beyond: Beyond | None = None

    @property
    def raster(self) -> Raster:
        """Its path."""
        return Raster(self.region.width, self.region.depth, self.spacing, self.region.center)

    @property
    def begin(self) -> Point:
        """As `Scan`."""
        return self.raster.corners()[0] if self.beyond is None else self.beyond.begin

    @property
    def box(self) -> tuple[Point, Point]:
        """As `Scan`."""
        return self.region.corners

    @property
    def row(self) -> float:
        """As `Scan`."""
        return self.region.width

    @property
    def line(self) -> str:
        """As `Scan`."""
        return f"{self.region.line}, rows {1e3 * self.spacing:g} mm apart"

    def passes(self, places: FloatArray) -> npt.NDArray[np.bool_]:
        """As `Scan`."""
        return self.region.holds(places)

    def strategy(self, plane: PathPlane, effort: Effort) -> Strategy:
        """As `Scan`."""
        if self.beyond is None:
            return Follow(self.raster, plane)
        return Rows(self.raster, plane, self.beyond.begin)

    def duration(self, effort: Effort) -> float:
        """As `Scan`."""
        pieces = sum(effort.piece(math.dist(*ends)) for ends in pairwise(self.raster.corners()))
        if self.beyond is None:
            return effort.ends + pieces
        # most rows stop at rims: about one landing each that meets nothing
        return effort.ends + pieces + min(self.beyond.missed, self.raster.rows) * effort.missing

    def longest(self, effort: Effort) -> float:
        """As `Scan`."""
        return 3.0 * self.duration(effort) + longest_hops(self.beyond, self.raster.length, effort)
