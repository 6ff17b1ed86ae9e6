"""Durations of the pieces of a path."""

import math
from dataclasses import dataclass

from palpate.controllers import ExploreParameters

AT_CORNER = -0.02
"""What a corner adds to the time from rest to rest [s]: it counts as reached while the tip still moves; measured
on a ball at 50 mm/s."""

CLIMBS = 1.05
"""Path length along the surface over that seen from above: 1.03 on a ball of 40 mm over a square of 40 mm."""

SLACK = 4.0
"""Longest over expected duration: on slopes of 60 degrees a path is twice as long; beyond, something is wrong."""


@dataclass(frozen=True, slots=True)
class Effort:
    """Durations of the pieces of a path.

    Attributes:
        parameters: Speeds.
        descent: From where the run begins down to the surface [m].
        miss: Down to where nothing is met, and up again [m].
    """

    parameters: ExploreParameters
    descent: float
    miss: float

    def piece(self, length: float) -> float:
        """Return the duration of a straight piece from corner to corner, `length` [m] seen from above [s]."""
        own, length = self.parameters, CLIMBS * length
        if length < own.speed**2 / own.acceleration:  # it brakes before it is at speed
            return 2.0 * math.sqrt(length / own.acceleration) + AT_CORNER
        return length / own.speed + own.speed / own.acceleration + AT_CORNER

    @property
    def ends(self) -> float:
        """Duration of the first landing with its settling, and of the last lift-off [s]."""
        own = self.parameters
        return self.down(self.descent) + own.settle_time + own.lift_distance / own.lift_speed

    @property
    def missing(self) -> float:
        """Duration of an approach that meets nothing [s]."""
        return self.down(self.miss) + self.miss / self.parameters.lift_speed

    def down(self, length: float) -> float:
        """Duration of an approach over a length [m], in [s]."""
        return length / self.parameters.landing_speed

    def hop(self, length: float, height: float) -> float:
        """Duration of lifting by a height, travelling a length [m], landing and settling [s]."""
        own = self.parameters
        return height / own.lift_speed + length / own.travel_speed + self.down(height) + own.settle_time

    def slide(self, length: float) -> float:
        """Duration of a slide, `length` [m] seen from above [s]."""
        return CLIMBS * length / self.parameters.speed
