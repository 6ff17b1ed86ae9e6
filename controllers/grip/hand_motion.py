"""What the hand does while an object slips in it: stand still, or move so that the object's place stays."""

from typing import Protocol

from palpate.controllers.grip.belief import SurfaceBelief
from palpate.errors import InvalidValueError, positive
from palpate.friction.contact_load import ContactLoad
from palpate.runtime.data import Observation
from palpate.spatial import ZERO, Matrix, Vector, add_scaled, limit_norm, rotate


class HandMotion(Protocol):
    """How the hand moves while an object pivots in it."""

    def velocity(self, now: Observation, rate: float) -> Vector:
        """Return the hand's velocity, base frame [m/s].

        Args:
            now: What is known.
            rate: Of the object's turn the way its torque turns it [rad/s]; below 0: back.
        """
        ...


class StandStill:
    """It stands still: the object slips down in it by e^2 / offset per radian. A `HandMotion`."""

    def velocity(self, now: Observation, rate: float) -> Vector:
        """See `HandMotion`."""
        return ZERO


class MoveAlong:
    """It moves against the slip, so that the object turns about a point that stays where it is. A `HandMotion`.

    Weight and its torque load the contacts, and by normality their slip goes with the load: with every radian the
    object slips over the fingers by v / omega, as `LimitSurface.slip_direction` says of the load that is felt. No
    motion of the hand changes that, but the hand can go the same way up.
    """

    def __init__(
        self, belief: SurfaceBelief, rotations_hand_sensor: tuple[Matrix, ...], largest_speed: float = 0.01
    ) -> None:
        """Take what is known.

        Args:
            belief: What the contacts bear; of it, only e and the exponents count.
            rotations_hand_sensor: How each finger's sensor is turned in the hand frame.
            largest_speed: Of the hand [m/s].

        Raises:
            InvalidValueError: No finger.
        """
        if not rotations_hand_sensor:
            raise InvalidValueError("rotations_hand_sensor is empty: give one per finger")
        self._belief, self._rotations = belief, rotations_hand_sensor
        self._largest = positive("largest_speed", largest_speed, "m/s")

    def velocity(self, now: Observation, rate: float) -> Vector:
        """See `HandMotion`."""
        velocity, share = ZERO, -rate / len(self._rotations)
        for i, (finger, rotation) in enumerate(zip(now.fingers, self._rotations, strict=True)):
            if not finger.believed:
                return ZERO
            slip = self._belief.surface(i).slip_direction(ContactLoad.of(finger.contact))
            if slip.spin == 0.0:
                return ZERO
            velocity = add_scaled(velocity, share / abs(slip.spin), rotate(rotation, slip.velocity))
        return rotate(now.arm.rotation_base_tip, limit_norm(velocity, self._largest))
