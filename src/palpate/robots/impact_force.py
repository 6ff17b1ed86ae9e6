"""Whether a robot's own limits keep its force: how hard it presses what it runs into as fast as it may."""

from dataclasses import dataclass

from palpate.controllers import LandingModel
from palpate.errors import InvalidValueError
from palpate.runtime import Limits
from palpate.sim.presets import EXPLORE

CONTACT = EXPLORE.law.stiffness
"""[N/m] Of what it runs into, fingertip and object in series: what experiments assume where nothing is known."""


@dataclass(frozen=True, slots=True)
class ImpactForce:
    """How hard a robot presses at its limits.

    Attributes:
        limits: Of the robot.
        landing: On a contact of `CONTACT`.
    """

    limits: Limits
    landing: LandingModel

    @property
    def force(self) -> float:
        """Largest that its limits allow [N]."""
        return self.landing.largest_force(self.limits.commanded_speed, self.limits.force)

    @property
    def speed(self) -> float:
        """Largest near a contact that keeps it to `Limits.largest_impact` [m/s]."""
        return self.landing.fastest(self.limits.force, self.limits.largest_impact)

    def check(self) -> None:
        """Refuse limits that break their own limit of impacts.

        Raises:
            InvalidValueError: They do.
        """
        if self.limits.commanded_speed > self.speed:
            raise InvalidValueError(
                f"limits.contact_speed_m_per_s = {self.limits.commanded_speed:.3g}: what is met so fast may be "
                f"pressed with {self.force:.3g} N (a contact of {CONTACT:g} N/m), more than "
                f"limits.impact_force_N, {self.limits.largest_impact:g} N; write at most {_floor(self.speed):g}"
            )

    def __str__(self) -> str:
        """One line for a person."""
        return (
            f"{self.force:.3g} N, on a contact of {CONTACT:g} N/m that is met with "
            f"{self.limits.commanded_speed:.3g} m/s; {self.limits.largest_impact:g} N is allowed"
        )


def _floor(speed: float) -> float:
    """Three decimals, rounded down [m/s]."""
    return int(1e3 * speed) / 1e3
