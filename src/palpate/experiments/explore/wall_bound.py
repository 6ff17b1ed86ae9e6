"""Bound on the force with which a sweeping tip hits an unexpected wall, and the speed that keeps it to a limit."""

import math
from dataclasses import dataclass

from palpate.controllers import LandingModel


@dataclass(frozen=True, slots=True)
class WallBound:
    """Force of hitting a vertical wall or a step during a sweep.

    One contact does not show what lies ahead, so the wall is met at full speed, as in a landing, while the tip
    presses on the floor: at most F + v max(K T, 2 sqrt(K m)) (see `palpate.controllers.landing`), and friction
    makes that sqrt(1 + mu^2) longer. No control makes it smaller, since the
    damping force of an inelastic contact is present at the first sample; a lower speed does.

    Attributes:
        force: Largest force with which a wall is hit at the speed of the sweep [N].
        speed: Fastest sweep that keeps it to the limit [m/s].
        limit: Of the robot [N].
    """

    force: float
    speed: float
    limit: float

    @classmethod
    def of(cls, landing: LandingModel, force: float, speed: float, friction: float, limit: float) -> "WallBound":
        """Return the bound for a set force [N], a speed [m/s], friction and the robot's force limit [N]."""
        per_speed, longer = landing.force_per_speed, math.hypot(1.0, friction)
        return cls(longer * (force + per_speed * speed), max(limit / longer - force, 0.0) / per_speed, limit)

    def __str__(self) -> str:
        """The bound as text for a report."""
        return (
            f"hit with up to {self.force:.3g} N at this speed; up to {1e3 * self.speed:.3g} mm/s it stays below "
            f"the robot's limit of {self.limit:g} N"
        )
