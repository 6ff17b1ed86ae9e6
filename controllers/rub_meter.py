"""Friction and torque ratio of a rub, from running sums."""

import math
from functools import cache
from typing import Any

from palpate.compiling import machine_code, njit
from palpate.controllers.rubs import Rub, RubMeasurement
from palpate.controllers.small_vectors import add_scaled, dot
from palpate.runtime.data import FingerObservation
from palpate.spatial import IDENTITY, ZERO, Matrix, Vector, Wrench, add, as_vector, norm, scale, subtract

LEFT_OUT = 0.1
"""Time left out beyond the ramps of each motion [s]: transients of servo and sensor."""


class RubMeter:
    """Sums forces and torques over the steady parts there and back, early and late halves apart."""

    def __init__(self) -> None:
        """Begin empty."""
        _kernel()  # compiled before the first period
        self._rub: Rub | None = None
        self._steady = (0.0, 0.0)
        self._sums = [_Half() for _ in range(4)]

    def begin(self, rub: Rub) -> None:
        """A rub begins: forget the last one."""
        self._rub, self._steady = rub, _steady(rub)
        self._sums = [_Half() for _ in range(4)]

    def feel(
        self, back: bool, since: float, finger: FingerObservation, rotation_base_tip: Matrix, normal: Vector
    ) -> None:
        """Take what is felt in a period; it counts while the motion is steady.

        Args:
            back: Whether on the motion back.
            since: Time since this motion began [s].
            finger: That rubs.
            rotation_base_tip: Of its tip frame.
            normal: Into the object, smoothed, base frame.
        """
        first, last = self._steady
        if first <= since <= last:
            force, centroid = as_vector(finger.contact.force), as_vector(finger.contact.centroid)
            felt = _kernel()(rotation_base_tip, force, centroid, finger.wrench, normal)
            self._add(back, since > 0.5 * (first + last), *felt)

    def _add(self, back: bool, late: bool, tangential: Vector, normal_force: float, spin_torque: float) -> None:
        if normal_force > 0.0:
            self._sums[2 * back + late].add(tangential, normal_force, spin_torque)

    def felt(self) -> RubMeasurement | None:
        """Return the measurement; None from too few samples."""
        rub = self._rub
        if rub is None or any(half.count == 0 for half in self._sums):
            return None
        halves = [self._sums[i].difference(self._sums[2 + i]) for i in (0, 1)]
        force = add(halves[0][0], halves[1][0])
        friction, torque = 0.5 * norm(force), 0.5 * abs(halves[0][1] + halves[1][1])
        if rub.speed > 0.0:
            early, late = (norm(half[0]) for half in halves)
        else:
            early, late = (abs(half[1]) for half in halves)
        # travel at the middle over travel from the middle of one half to that of the other
        first, last = self._steady
        # travel begins half a ramp after the motion does
        lever = (first + last - rub.ramp) / (last - first)
        rise = 2.0 * lever * (late - early) / (late + early) if late + early > 0.0 else math.inf
        return RubMeasurement(rub, friction, torque, rise)


def _steady(rub: Rub) -> tuple[float, float]:
    return min(rub.ramp + LEFT_OUT, 0.5 * rub.duration), rub.duration - rub.ramp


class _Half:
    """Sums over half of a motion in one direction."""

    __slots__ = ("count", "force", "torque")

    def __init__(self) -> None:
        self.count, self.force, self.torque = 0, ZERO, 0.0

    def add(self, tangential: Vector, normal_force: float, spin_torque: float) -> None:
        self.count += 1
        self.force = add(self.force, scale(1.0 / normal_force, tangential))
        self.torque += spin_torque / normal_force

    def difference(self, other: "_Half") -> tuple[Vector, float]:
        """Half the difference of the means."""
        force = subtract(scale(0.5 / self.count, self.force), scale(0.5 / other.count, other.force))
        return force, 0.5 * (self.torque / self.count - other.torque / other.count)


@njit(cache=True)
def _rubbed(
    rotation: Matrix, force: Vector, centroid: Vector, wrench: Wrench, normal: Vector
) -> tuple[Vector, float, float]:
    """Tangential force in base coordinates [N], normal force [N] and spin torque [N m] of a contact."""
    a, b, c = rotation
    moment = (wrench[3], wrench[4], wrench[5])
    x, y, z = dot(a, force), dot(b, force), dot(c, force)
    pushing = -dot((x, y, z), normal)
    p, q, r = dot(a, centroid), dot(b, centroid), dot(c, centroid)
    lever = (q * z - r * y, r * x - p * z, p * y - q * x)
    turned = (dot(a, moment), dot(b, moment), dot(c, moment))
    rest = (turned[0] - lever[0], turned[1] - lever[1], turned[2] - lever[2])
    return add_scaled((x, y, z), pushing, normal), pushing, dot(rest, normal)


@cache
def _kernel() -> Any:
    return machine_code(_rubbed, IDENTITY, ZERO, ZERO, (0.0,) * 6, ZERO)
