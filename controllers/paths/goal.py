"""When an active exploration is done."""

import math
from dataclasses import dataclass
from enum import Enum

from palpate.errors import InvalidValueError, positive


class GoalError(Enum):
    """Which error a goal speaks of."""

    RMS = 2.0
    """Root mean square over the area; the value is the power with which errors count."""
    LARGEST = 4.0
    """The largest anywhere: large errors count far more than small ones."""


class StopReason(Enum):
    """Why an active exploration planned no further leg."""

    REACHED = "the map should be as accurate as asked for"
    SPENT = "the time was over"
    EXHAUSTED = "nothing was left to refine"


@dataclass(frozen=True, slots=True)
class Goal:
    """When an active exploration is done: whichever comes first.

    Attributes:
        error: Wanted error of the map [m].
        measure: Of which kind.
        length: Path length of the tip, lifted or not [m].
        area: Part of the field over which `error` is wanted, between 0 and 1: the rest may stay unknown.
        time: Duration of the motion at `speed` [s]. A leg that has begun is finished.
        speed: Of the tip along the surface [m/s]; it says how far the tip comes in `time`.
    """

    error: float = 2e-5
    measure: GoalError = GoalError.RMS
    length: float = math.inf
    area: float = 1.0
    time: float = math.inf
    speed: float = 0.02

    def __post_init__(self) -> None:
        positive("goal error", self.error, "m")
        positive("goal length", self.length, "m", infinite_allowed=True)
        positive("goal time", self.time, "s", infinite_allowed=True)
        positive("goal speed", self.speed, "m/s")
        if not 0.0 <= self.area <= 1.0:
            raise InvalidValueError(f"goal area = {self.area:g}: must lie between 0 and 1 (all of the field)")

    @property
    def path_length(self) -> float:
        """Largest path length that `length` and `time` allow [m]."""
        return min(self.length, self.time * self.speed)
