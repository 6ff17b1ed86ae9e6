"""Once round the object."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from palpate.controllers.paths import Contour, EdgeSteering, LevelSteering, PathPlane, Point, Strategy, Turn
from palpate.errors import FloatArray
from palpate.experiments.explore.contour import LEAN, PredictedContour
from palpate.experiments.explore.scans.effort import CLIMBS, Effort
from palpate.spatial import add

ROUND_TRIPS = 1.5
"""A contour that has not closed after this many times its predicted length is given up."""

EXTRA_LENGTH = 0.05
"""Extra path length allowed for a contour [m]."""

QUARTERS = 4.0
"""A contour counts as so many rows: each sees another side of the object."""


@dataclass(frozen=True, slots=True, eq=False)
class ContourScan:
    """Once round the object.

    Attributes:
        predicted: The curve.
        edge: Whether it is an edge; otherwise a curve of constant height.
        turn: Sense of rotation.
        radius: Of the tip [m].
        below: How far below its height on the top the tip goes round [m]; of an edge what follows from it.
    """

    predicted: PredictedContour
    edge: bool
    turn: Turn
    radius: float
    below: float

    @property
    def begin(self) -> Point:
        """As `Scan`."""
        return self.predicted.landing

    @property
    def corners(self) -> tuple[Point, ...]:
        """As `Scan`."""
        return tuple((x, y) for x, y in self.predicted.points.tolist())

    @property
    def box(self) -> tuple[Point, Point]:
        """As `Scan`."""
        points = np.vstack([self.predicted.points, self.predicted.landing])
        (a, b), (c, d) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
        return (a, b), (c, d)

    @property
    def row(self) -> float:
        """As `Scan`."""
        return self.predicted.length / QUARTERS

    @property
    def length(self) -> float:
        """As `Scan`."""
        return self.predicted.length

    @property
    def line(self) -> str:
        """As `Scan`."""
        what = "an edge" if self.edge else f"{1e3 * self.below:.3g} mm below the top"
        return f"along {what}, about {1e3 * self.predicted.length:.0f} mm, {self.turn.name.lower()} round"

    def passes(self, places: FloatArray) -> npt.NDArray[np.bool_]:
        """As `Scan`: a line has no room for any."""
        return np.zeros(len(places), dtype=np.bool_)

    def strategy(self, plane: PathPlane, effort: Effort) -> Strategy:
        """As `Scan`."""
        longest = ROUND_TRIPS * self.predicted.length + 2.0 * self.predicted.approach_length + EXTRA_LENGTH
        begin = self.predicted.landing
        if self.edge:
            steering = EdgeSteering(plane, LEAN, self.radius, (*self.predicted.outward, 0.0), self.turn)
            return Contour(begin, steering, plane, longest)
        height = (0.0, 0.0, float(self.predicted.heights[0]))
        level = PathPlane(add(plane.origin, height), plane.rotation_base_plane)
        return Contour(begin, LevelSteering(level, self.turn), plane, longest)

    def duration(self, effort: Effort) -> float:
        """As `Scan`."""
        length = self.predicted.length + CLIMBS * self.predicted.approach_length
        return effort.ends + length / effort.parameters.speed

    def longest(self, effort: Effort) -> float:
        """As `Scan`."""
        return 3.0 * self.duration(effort) + EXTRA_LENGTH / effort.parameters.speed
