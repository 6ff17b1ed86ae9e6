"""How fast a controller may move the tip while it could run into something: at any time, and in any direction.

What stops a tip is the force that it runs into, after a delay in which it goes on, with a mass that must be
stopped; so the speed before decides how hard it presses. `palpate.controllers.LandingModel.largest_force` says how
hard that is.
"""

import math

from palpate.runtime.data import Command, FingerObservation, Observation
from palpate.runtime.supervision.command_conditions import ROUNDING
from palpate.runtime.supervision.finding import Violation
from palpate.runtime.supervision.limits import Limits
from palpate.spatial import Vector, dot, norm, rotate, scale, subtract

BACKING_OFF = 0.1
"""Time after the last touch [s] during which moving away from what was touched is not limited so: filters and
servos of a force control go on that long. At `Limits.speed` it is 25 mm."""


class ContactSpeedCheck:
    """Bounds the commanded speed, but for its share away from what the tip touches."""

    def __init__(self, limits: Limits) -> None:
        """Take the limits; nothing was touched yet."""
        self._limit = limits.commanded_speed
        self._touched: Observation | None = None

    @property
    def most(self) -> float:
        """Commanded speed up to which all is well, whatever is touched [m/s]."""
        return self._limit * ROUNDING

    def see(self, now: Observation) -> None:
        """Take a period."""
        for finger in now.fingers:
            if finger.touching:
                self._touched = now
                break

    def broken(self, now: Observation, command: Command) -> Violation | None:
        """Return what is wrong with a controller's command, well formed, if anything."""
        velocity, touched = command.velocity_base_tip, self._touched
        if norm(velocity) <= self.most:
            return None
        if touched is not None and now.time - touched.time <= BACKING_OFF:
            velocity = _not_away(velocity, touched)
        speed = norm(velocity)
        if speed <= self.most:
            return None
        return Violation(
            "commanded speed where something may be touched",
            f"{speed:.4g} m/s",
            f"{self._limit:g} m/s (limits.contact_speed_m_per_s), or it could press too hard",
        )


def _not_away(velocity: Vector, touched: Observation) -> Vector:
    """A velocity without its share along the force of the finger that feels most."""
    finger = max(touched.fingers, key=_size)
    size = _size(finger)
    if not 0.0 < size < math.inf:
        return velocity
    away = rotate(touched.arm.rotation_base_tip, scale(1.0 / size, finger.force))
    return subtract(velocity, scale(max(0.0, dot(velocity, away)), away))


def _size(finger: FingerObservation) -> float:
    return norm(finger.force) if finger.touching else 0.0
