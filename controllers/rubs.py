"""Rubbing motions of a pressed finger, and what is measured from them."""

import math
from dataclasses import dataclass
from typing import Protocol

from palpate.errors import InvalidValueError, not_negative, positive

RAMP = 0.04
"""Least time in which a motion comes up to its speed, and down from it [s]: two lags of a servo of 100 rad/s."""

ACCELERATION = 0.5
"""Bound on how fast sliding speeds up [m/s^2]: a motion of 20 mm/s still does so within `RAMP`."""


@dataclass(frozen=True, slots=True)
class Rub:
    """A motion there and the same one back, at one load.

    Attributes:
        normal_force: To press with [N].
        speed: Of the contact along the surface [m/s].
        spin: About the contact's normal [rad/s]; negative: in the opposite sense first.
        duration: Of each of the two motions, with acceleration and deceleration [s].
        angular_acceleration: With which the robot can begin to turn [rad/s^2]: it comes up to its spin no faster.
        heading: Of the sliding, about the normal from the usual direction [rad].
    """

    normal_force: float
    speed: float
    spin: float
    duration: float
    angular_acceleration: float = math.inf
    heading: float = 0.0

    def __post_init__(self) -> None:
        positive("normal_force", self.normal_force, "N")
        not_negative("speed", self.speed, "m/s")
        not_negative("size of spin", abs(self.spin), "rad/s")
        if self.speed == self.spin == 0.0:
            raise InvalidValueError("speed = 0 m/s and spin = 0 rad/s: a rub must slide or turn")
        positive("angular_acceleration", self.angular_acceleration, "rad/s^2", infinite_allowed=True)
        if not self.duration > 2.0 * self.ramp:
            raise InvalidValueError(
                f"duration = {self.duration:g} s: must be more than {2.0 * self.ramp:g} s, in which a motion of "
                f"{self.speed:g} m/s and {self.spin:g} rad/s speeds up and slows down"
            )

    @property
    def ramp(self) -> float:
        """How long it takes to come up to speed [s]."""
        return max(RAMP, self.speed / ACCELERATION, abs(self.spin) / self.angular_acceleration)

    @property
    def travel(self) -> float:
        """How far the contact slides in one direction [m]."""
        return self.speed * (self.duration - self.ramp)

    @property
    def angle(self) -> float:
        """How far it turns in one direction [rad]."""
        return abs(self.spin) * (self.duration - self.ramp)

    def share(self, since: float) -> float:
        """Return which share of its speed it has after so long [s]; sliding and turning keep their ratio."""
        ramp = self.ramp
        return max(0.0, min(1.0, since / ramp, (self.duration - since) / ramp))


@dataclass(frozen=True, slots=True)
class RubMeasurement:
    """A rub as measured by plain means over it: accurate enough to decide on the next rub.

    Attributes:
        rub: What was done.
        friction: Tangential over normal force, half the difference of there and back.
        torque_ratio: Spin torque over normal force likewise [m].
        rise: How much of that still grew with the travel: 0 in slip, 1 if the surface only yielded.
    """

    rub: Rub
    friction: float
    torque_ratio: float
    rise: float


class RubProgram(Protocol):
    """Decides on the next rub."""

    def start(self) -> None:
        """A run begins."""
        ...

    def next(self, felt: RubMeasurement | None) -> Rub | None:
        """Return the next rub; None at the end.

        Args:
            felt: What the last one came to; None before the first.
        """
        ...


@dataclass(frozen=True, slots=True)
class AirSpan:
    """A stretch of time in free air, in which the sensor shows its zero.

    Attributes:
        begin: [s]
        end: [s]
    """

    begin: float
    end: float


@dataclass(frozen=True, slots=True)
class RubSpan:
    """The time interval of one direction of a rub.

    Attributes:
        rub: Of which.
        back: Whether it is the motion back.
        begin: At rest, before it moves [s].
        end: When it has come to rest [s].
    """

    rub: Rub
    back: bool
    begin: float
    end: float
