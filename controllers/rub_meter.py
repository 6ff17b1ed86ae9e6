"""Friction and torque ratio of a rub, from running sums."""

import math

from palpate.controllers.rubs import Rub, RubMeasurement
from palpate.spatial import ZERO, Vector, add, norm, scale, subtract

LEFT_OUT = 0.1
"""Time left out beyond the ramps of each motion [s]: transients of servo and sensor."""


class RubMeter:
    """Sums forces and torques over the steady parts there and back, early and late halves apart."""

    def __init__(self) -> None:
        """Begin empty."""
        self._rub: Rub | None = None
        self._steady = (0.0, 0.0)
        self._sums = [_Half() for _ in range(4)]

    def begin(self, rub: Rub) -> None:
        """A rub begins: forget the last one."""
        self._rub, self._steady = rub, _steady(rub)
        self._sums = [_Half() for _ in range(4)]

    def counts(self, since: float) -> bool:
        """Whether what is felt so long after a motion began [s] counts: the motion is steady."""
        first, last = self._steady
        return first <= since <= last

    def add(self, back: bool, since: float, tangential: Vector, normal_force: float, spin_torque: float) -> None:
        """Take what is felt in a period that counts.

        Args:
            back: Whether on the motion back.
            since: Time since this motion began [s].
            tangential: Force along the surface, base frame [N].
            normal_force: [N].
            spin_torque: [N m].
        """
        first, last = self._steady
        if normal_force > 0.0:
            late = since > 0.5 * (first + last)
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
