"""Landing: how fast the tip may touch for a bounded peak of the force.

A tip that touches at speed v goes on for the delay T in which nothing that is commanded can act, and presses into
K: the force reaches K v T. What moves has a mass m, too, and is brought to rest by the contact: an elastic one
takes up v sqrt(K m), one that is damped critically (c = 2 sqrt(K m)) gives c v at once, twice as much. The peak is
bounded by the larger of both. No braking makes that second one smaller: it is there with the first sample that
shows a touch. What does is to land more slowly.

A surface that comes towards the tip adds its own speed. What goes up and down at up to V = A w is met near its
highest point by a tip that comes down slowly: in a period P = 2 pi / w that sinks by v P, and so meets the surface
no farther below that point, where a sine goes no faster than w sqrt(2 A v P) = sqrt(4 pi V v), whatever A is.
"""

import math
from dataclasses import dataclass

from palpate.errors import InvalidValueError, check_positive, not_negative, positive

FASTEST_SETTLING_PUSH = 0.005
"""Bound on the pressing speed until the force has settled, after a slower landing [m/s]: a surface that is met
near its turning point recedes faster than a slow landing could follow."""

IMPACT_DELAYS = 3.0
"""Duration of the landing's impact, in delays of force control; only after it the surface's motion is tracked."""

LANDING_OVERSHOOT = 1.0
"""Bound on how much the landing peak may exceed the set force, by default [N]."""


@dataclass(frozen=True, slots=True)
class LandingModel:
    """Speed, masses and stiffness of a landing.

    Attributes:
        stiffness: K of contact and servo in series, the largest to be expected [N/m].
        delay: T of force control [s].
        contact_stiffness: Of the contact alone, likewise [N/m].
        mass: What moves with the tip [kg]; 0 if its momentum does not count.
    """

    stiffness: float
    delay: float
    contact_stiffness: float
    mass: float = 0.0

    def __post_init__(self) -> None:
        check_positive(self, stiffness="N/m", delay="s", contact_stiffness="N/m")
        not_negative("mass", self.mass, "kg")

    @property
    def force_per_speed(self) -> float:
        """Of the peak [N s/m]."""
        return max(self.stiffness * self.delay, 2.0 * math.sqrt(self.contact_stiffness * self.mass))

    def peak(self, speed: float, touch_force: float = 0.0) -> float:
        """Return a bound on the force with which a tip lands [N].

        Args:
            speed: Of the tip [m/s].
            touch_force: At which the touch is noticed [N].
        """
        return not_negative("touch_force", touch_force, "N") + self.force_per_speed * positive(
            "speed", speed, "m/s"
        )

    def largest_force(self, speed: float, limit: float) -> float:
        """Return a bound on the force with which a tip presses that is stopped at a force limit [N].

        It reaches the limit at its full speed and goes on for T, or exceeds it with the knock already: L + K T v,
        or 2 v sqrt(K m) if that is more. Both do not add up: a contact that takes up the knock by damping does so
        before the limit is reached again. For elastic contacts of 1 to 100 kN/m on servos of 30 to 80 kN/m this is
        15 % more than the linear model of both gives; on the simulated stage and UR5e 0 to 40 % more
        (`tests/sim/test_force_limits.py`).

        Args:
            speed: Of the tip [m/s].
            limit: Force at which it is stopped [N].
        """
        positive("limit", limit, "N")
        knock = 2.0 * math.sqrt(self.contact_stiffness * self.mass)
        return max(limit + self.stiffness * self.delay * positive("speed", speed, "m/s"), knock * speed)

    def fastest(self, limit: float, largest: float) -> float:
        """Return the speed with which `largest_force` is as large as this [m/s].

        Args:
            limit: Force at which the tip is stopped [N].
            largest: Force beyond it [N].
        """
        left = positive("largest - limit", largest - positive("limit", limit, "N"), "N")
        knock = 2.0 * math.sqrt(self.contact_stiffness * self.mass)
        return min(left / (self.stiffness * self.delay), largest / knock if knock > 0.0 else math.inf)

    def speed(self, force: float, touch_force: float = 0.0, excess: float = LANDING_OVERSHOOT) -> float:
        """Return the largest speed of landing [m/s] that keeps the peak to the set force and an excess.

        Args:
            force: That is to be held [N].
            touch_force: At which the touch is noticed [N].
            excess: That is allowed [N].

        Raises:
            InvalidValueError: The touch is noticed too late for any speed.
        """
        left = positive("force", force, "N") + positive("excess", excess, "N")
        left -= not_negative("touch_force", touch_force, "N")
        if left <= 0.0:
            raise InvalidValueError(
                f"touch_force = {touch_force:g} N: must be below force + excess = {force + excess:g} N; press more"
            )
        return left / self.force_per_speed

    def speed_on_motion(self, most: float, fastest: float) -> float:
        """Return the largest speed of landing [m/s] on a surface that goes up and down, for a bounded force.

        Args:
            most: With which it may be met [N].
            fastest: The surface goes [m/s].
        """
        allowed = positive("most", most, "N") / self.force_per_speed
        slow = positive("fastest", fastest, "m/s") * math.pi
        root = math.sqrt(slow + allowed) - math.sqrt(slow)  # of v + sqrt(4 pi V v) = allowed
        return max(root**2, allowed - fastest)


def meeting_speed(landing: float, fastest: float) -> float:
    """Return at most how fast tip and a surface that goes up and down meet [m/s].

    Args:
        landing: Speed of landing [m/s].
        fastest: The surface goes [m/s].
    """
    positive("landing", landing, "m/s")
    return landing + min(fastest, math.sqrt(4.0 * math.pi * positive("fastest", fastest, "m/s") * landing))


def moved_mass(servo_stiffness: float, response: float) -> float:
    """Return what a critically damped servo moves [kg]: K / w^2 with its response of 2 / w.

    Args:
        servo_stiffness: Along the normal, at the tip [N/m].
        response: How long it takes to follow [s].
    """
    return positive("servo_stiffness", servo_stiffness, "N/m") * (0.5 * positive("response", response, "s")) ** 2
