"""Keeps an axis of the tip normal to the surface, without making the contact slide."""

import math
from dataclasses import dataclass

from palpate.errors import check_positive, positive, vector
from palpate.spatial import ZERO, Matrix, Vector, as_vector, cross, dot, limit_norm, norm, rotate, scale, subtract

ACCELERATION_IN_RATES = 10.0
"""Bound on angular acceleration, per largest rate [1/s]: from rest to full rate in a tenth of a second."""


@dataclass(frozen=True, slots=True)
class NormalAxis:
    """The axis to keep normal, with its rate and acceleration limits.

    Attributes:
        axis: Of the tip, that shall point into the object: a direction in the tip frame.
        gain: Turning rate per angle [1/s]. Turning is a delayed integrator like force control: gain times the
            robot's delay must stay well below pi/2.
        fastest: Largest turning rate [rad/s].
        pivot: Of the tip, that follows the path as if the tip did not turn: the tip frame's origin, or a
            fingertip's centre that lies far from it [m].
    """

    axis: Vector = (0.0, 0.0, -1.0)
    gain: float = 4.0
    fastest: float = 0.5
    pivot: Vector = ZERO

    def __post_init__(self) -> None:
        positive("length of axis", norm(as_vector(vector("axis", self.axis, 3, ""))), "")
        vector("pivot", self.pivot, 3, "m")
        check_positive(self, gain="1/s", fastest="rad/s")


class Orientation:
    """From the surface's normal to a turn of the tip about the contact point.

    Attributes:
        pivot: See `NormalAxis`.
    """

    def __init__(self, wanted: NormalAxis, period: float) -> None:
        """Take what is wanted and the control period [s]."""
        self._wanted = wanted
        self._axis = scale(1.0 / norm(wanted.axis), wanted.axis)
        self.pivot = wanted.pivot
        self._most_change = ACCELERATION_IN_RATES * wanted.fastest * period
        self._rate: Vector = ZERO

    def reset(self) -> None:
        """The tip does not turn."""
        self._rate = ZERO

    def rest(self) -> Vector:
        """Return the angular velocity that brings the tip to rest, for the next period [rad/s], base frame."""
        self._rate = self._towards(ZERO)
        return self._rate

    def turn(self, rotation_base_tip: Matrix, normal: Vector) -> Vector:
        """Return the angular velocity for the next period [rad/s], base frame.

        It has no part about the normal: about that the tip need not turn.

        Args:
            rotation_base_tip: Of the tip frame.
            normal: Unit, into the object, base frame.
        """
        axis = rotate(rotation_base_tip, self._axis)
        about, cosine = cross(axis, normal), dot(axis, normal)
        sine = norm(about)
        if sine == 0.0:
            return self.rest()  # aligned; or opposed, which no contact is
        angle = math.atan2(sine, cosine)
        wanted = limit_norm(scale(self._wanted.gain * angle / sine, about), self._wanted.fastest)
        self._rate = self._towards(wanted)
        return self._rate

    def _towards(self, wanted: Vector) -> Vector:
        change = subtract(wanted, self._rate)
        size = norm(change)
        if size <= self._most_change:
            return wanted
        step = scale(self._most_change / size, change)
        return (self._rate[0] + step[0], self._rate[1] + step[1], self._rate[2] + step[2])


def carried_along(angular_velocity: Vector, lever: Vector) -> Vector:
    """Return the velocity of the tip frame's origin [m/s] that keeps a point of the tip in place while it turns.

    Args:
        angular_velocity: Of the tip frame, base coordinates [rad/s].
        lever: From the frame's origin to the point, base coordinates [m].
    """
    return cross(lever, angular_velocity)
