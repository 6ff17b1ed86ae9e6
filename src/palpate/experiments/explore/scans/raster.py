"""Rows over a rectangle."""

import math
from dataclasses import dataclass
from itertools import pairwise

from palpate.controllers import Raster
from palpate.controllers.paths import Follow, PathPlane, Point, RasterRows, Strategy
from palpate.experiments.explore.scans.beyond import Beyond, longest_hops
from palpate.experiments.explore.scans.effort import SLACK, Effort
from palpate.experiments.explore.scans.rectangle import OverRectangle


@dataclass(frozen=True, slots=True)
class RasterScan(OverRectangle):
    """Rows over a rectangle.

    Attributes:
        spacing: Of rows [m].
        beyond: Where it leaves the object; None: it does not.
    """

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
    def corners(self) -> tuple[Point, ...]:
        """As `Scan`."""
        return self.raster.corners()

    @property
    def length(self) -> float:
        """As `Scan`."""
        return self.raster.length

    @property
    def line(self) -> str:
        """As `Scan`."""
        return f"{self.region.line}, rows {1e3 * self.spacing:g} mm apart"

    def strategy(self, plane: PathPlane, effort: Effort) -> Strategy:
        """As `Scan`."""
        if self.beyond is None:
            return Follow(self.raster, plane)
        return RasterRows(self.raster, plane, self.beyond.begin)

    def duration(self, effort: Effort) -> float:
        """As `Scan`."""
        pieces = sum(effort.piece(math.dist(*ends)) for ends in pairwise(self.raster.corners()))
        if self.beyond is None:
            return effort.ends + pieces
        # most rows stop at rims: about one landing each that meets nothing
        return effort.ends + pieces + min(self.beyond.missed, self.raster.rows) * effort.missing

    def longest(self, effort: Effort) -> float:
        """As `Scan`."""
        return SLACK * self.duration(effort) + longest_hops(self.beyond, self.length, effort)
