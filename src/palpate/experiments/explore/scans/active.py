"""Coarse rows, then closer ones where the map would err."""

import math
from dataclasses import dataclass, replace

from palpate.controllers.paths import Active, ActiveSettings, Goal, GoalError, PathPlane, Point, Strategy
from palpate.experiments.explore.scans.effort import SLACK, Effort
from palpate.experiments.explore.scans.rectangle import OverRectangle


@dataclass(frozen=True, slots=True)
class ActiveScan(OverRectangle):
    """Coarse rows, then closer ones where the map would err.

    Attributes:
        goal: When it is enough.
        missed: Ends of rows at which the tip would meet nothing; None: there are none.
    """

    goal: Goal
    missed: int | None = None

    @property
    def prior(self) -> float:
        """Distance of rows that every part gets [m]."""
        return ActiveSettings.suited(self.goal.measure).prior

    @property
    def begin(self) -> Point:
        """As `Scan`."""
        return self.region.corners[0]

    @property
    def line(self) -> str:
        """As `Scan`."""
        what = "RMS" if self.goal.measure is GoalError.RMS else "at most"
        return f"{self.region.line}, until the map errs by {1e3 * self.goal.error:.3g} mm {what}"

    def strategy(self, plane: PathPlane, effort: Effort) -> Strategy:
        """As `Scan`."""
        region = self.region
        # the goal assumes one mean speed: that of a whole row with the travel to it
        speed = (region.width + self.prior) / self._each(effort)
        goal = replace(self.goal, speed=speed)
        return Active(region.width, region.depth, goal, center=region.center, plane=plane)

    def duration(self, effort: Effort) -> float:
        """As `Scan`: rows as close as a smooth surface asks for, half as many again for its details.

        If the time is over before, those that have begun until then: a row is finished.
        """
        rows = 1.5 * (self.region.depth / self.prior + 1.0)
        begun = max(min(rows, self._within(self.goal.time, effort)), 1.0)
        misses = (self.missed or 0) * effort.missing * begun / rows
        return effort.ends + begun * self._each(effort) + misses

    def longest(self, effort: Effort) -> float:
        """As `Scan`: all rows as close as they may be, or those of its time and one more, each lifted to."""
        finest = 2.0 * ActiveSettings.suited(self.goal.measure).finest
        rows = min(self.region.depth / finest, self._within(self.goal.time, effort)) + 1.0
        each = self._each(effort) + effort.hop(self.region.width, effort.descent)
        return effort.ends + SLACK * rows * each

    def _within(self, time: float, effort: Effort) -> float:
        """Return how many rows begin within a time [s], which is counted without landings; infinity allowed."""
        rows = time / self._each(effort)
        return rows if math.isinf(rows) else math.ceil(rows)

    def _each(self, effort: Effort) -> float:
        """Duration of a row and of the slide to it, without obstacles [s]."""
        return effort.piece(self.region.width) + effort.piece(self.prior)
