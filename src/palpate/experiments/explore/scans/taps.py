"""Single touches on a grid."""

from dataclasses import dataclass

from palpate.controllers.paths import PathPlane, Point, Strategy, Taps, tap_grid
from palpate.experiments.explore.scans.effort import Effort
from palpate.experiments.explore.scans.rectangle import OverRectangle

RETREAT = 5e-3
"""How far a tap goes back [m]: more than a tip of 8 mm rises on a slope of 45 degrees to the next tap."""


@dataclass(frozen=True, slots=True)
class TapScan(OverRectangle):
    """Single touches on a grid.

    Attributes:
        spacing: Of taps [m].
        missed: Taps at which the tip would meet nothing; None: there are none.
    """

    spacing: float
    missed: int | None = None

    @property
    def points(self) -> tuple[Point, ...]:
        """Where it touches, in order [m]."""
        return tap_grid(self.region.width, self.region.depth, self.spacing, self.region.center)

    @property
    def corners(self) -> tuple[Point, ...]:
        """As `Scan`."""
        return self.points

    @property
    def begin(self) -> Point:
        """As `Scan`."""
        return self.points[0]

    @property
    def row(self) -> float:
        """As `Scan`: every tap is new."""
        return self.spacing

    @property
    def line(self) -> str:
        """As `Scan`."""
        return f"{len(self.points)} over {self.region.line}, {1e3 * self.spacing:g} mm apart"

    def strategy(self, plane: PathPlane, effort: Effort) -> Strategy:
        """As `Scan`."""
        return Taps(self.points, RETREAT, plane)

    def duration(self, effort: Effort) -> float:
        """As `Scan`."""
        each = effort.hop(self.spacing, RETREAT) + 0.1
        return effort.ends + len(self.points) * each + (self.missed or 0) * effort.missing

    def longest(self, effort: Effort) -> float:
        """As `Scan`."""
        return 3.0 * self.duration(effort) + len(self.points) * effort.hop(self.spacing, effort.descent)
