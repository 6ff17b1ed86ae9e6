"""From the middle of a disc outwards."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from palpate.controllers.paths import Follow, PathPlane, Point, Spiral, Strategy, Waypoints
from palpate.errors import FloatArray
from palpate.experiments.explore.fit import Region
from palpate.experiments.explore.scans.beyond import BeyondPath, longest_hops, missed_time
from palpate.experiments.explore.scans.effort import CLIMBS, SLACK, Effort


@dataclass(frozen=True, slots=True)
class SpiralScan:
    """From the middle of a disc outwards.

    Attributes:
        region: The disc.
        spacing: Of turns [m].
        beyond: As of `RasterScan`.
    """

    region: Region
    spacing: float
    beyond: BeyondPath | None = None

    def passes(self, places: FloatArray) -> npt.NDArray[np.bool_]:
        """As `Scan`: within the outermost turn, which is no circle."""
        x, y = (places - self.region.center).T
        turns = 0.5 * self.region.width / self.spacing
        outermost = turns - (turns - np.arctan2(y, x) / (2.0 * np.pi)) % 1.0
        return np.asarray(np.hypot(x, y) <= self.spacing * outermost)

    @property
    def spiral(self) -> Spiral:
        """Its path."""
        return Spiral(0.5 * self.region.width, self.spacing, self.region.center)

    @property
    def path(self) -> Spiral | Waypoints:
        """As it is followed."""
        return self.spiral if self.beyond is None else self.beyond.path

    @property
    def begin(self) -> Point:
        """As `Scan`."""
        return self.path.corners()[0]

    @property
    def corners(self) -> tuple[Point, ...]:
        """As `Scan`."""
        return self.path.corners()

    @property
    def box(self) -> tuple[Point, Point]:
        """As `Scan`."""
        return self.region.corners

    @property
    def row(self) -> float:
        """As `Scan`: half the outermost turn, a turn's mean."""
        return 0.5 * math.pi * self.region.width

    @property
    def length(self) -> float:
        """As `Scan`."""
        return self.spiral.length

    @property
    def line(self) -> str:
        """As `Scan`."""
        return f"{self.region.line}, turns {1e3 * self.spacing:g} mm apart"

    def strategy(self, plane: PathPlane, effort: Effort) -> Strategy:
        """As `Scan`."""
        return Follow(self.path, plane)

    def duration(self, effort: Effort) -> float:
        """As `Scan`."""
        own, radius, turn = effort.parameters, 0.5 * self.region.width, 2.0 * math.pi / self.spacing
        # on its inner turns it is as slow as they are narrow: speed^2 / radius is bounded
        inner = min(radius, own.speed**2 / own.acceleration)
        slow = turn * inner * math.sqrt(inner / own.acceleration) / 1.5
        return (
            effort.ends
            + CLIMBS * slow
            + effort.slide(0.5 * turn * (radius**2 - inner**2))
            + missed_time(self.beyond, effort)
        )

    def longest(self, effort: Effort) -> float:
        """As `Scan`."""
        return SLACK * self.duration(effort) + longest_hops(self.beyond, self.length, effort)
