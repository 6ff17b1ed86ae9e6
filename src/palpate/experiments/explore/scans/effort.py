"""What ways cost in time."""

import math
from dataclasses import dataclass

from palpate.controllers import ExploreParameters

AT_CORNER = -0.02
"""What a corner adds to the time from rest to rest [s]: it counts as reached while the tip still moves; measured
on a ball at 50 mm/s."""

CLIMBS = 1.05
"""Way along the surface over that seen from above, about: 1.03 on a ball of 40 mm over a square of 40 mm."""

SLACK = 4.0
"""So many times longer than foretold, something is wrong: on slopes of 60 degrees the way is twice as long."""


@dataclass(frozen=True, slots=True)
class Effort:
    """What ways cost.

    Attributes:
        parameters: Speeds.
        descent: From where the run begins down to the surface [m].
        miss: Down to where nothing is met, and up again [m].
    """

    parameters: ExploreParameters
    descent: float
    miss: float

    def piece(self, way: float) -> float:
        """Return how long a way along the surface takes from corner to corner, seen from above [s]."""
        own, way = self.parameters, CLIMBS * way
        if way < own.speed**2 / own.acceleration:  # it brakes before it is at speed
            return 2.0 * math.sqrt(way / own.acceleration) + AT_CORNER
        return way / own.speed + own.speed / own.acceleration + AT_CORNER

    @property
    def ends(self) -> float:
        """From where the run begins, until the force has settled, and off the surface at last [s]."""
        own = self.parameters
        return self.down(self.descent) + own.settle_time + own.lift_distance / own.lift_speed

    @property
    def missing(self) -> float:
        """Nothing [s]."""
        return self.down(self.miss) + self.miss / self.parameters.lift_speed

    def down(self, way: float) -> float:
        """A way down [s]."""
        return way / self.parameters.landing_speed

    def hop(self, way: float, height: float) -> float:
        """Off the surface, up by a height, along a way, down and settled [s]."""
        own = self.parameters
        return height / own.lift_speed + way / own.travel_speed + self.down(height) + own.settle_time

    def slide(self, way: float) -> float:
        """A way along the surface, seen from above [s]."""
        return CLIMBS * way / self.parameters.speed
