"""What hangs in a hand: loads that fall where contacts give way, and not where they share them anew."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from palpate.friction.contact_load import ContactLoad
from palpate.kinematics.hand import HandKinematics
from palpate.runtime.data import Observation
from palpate.spatial import ZERO, Vector, add, norm, rotate


@dataclass(frozen=True, slots=True)
class MeasuredLoad:
    """One load.

    Attributes:
        size: [N], or [N m].
        deviation: Of its noise, likewise.
    """

    size: float
    deviation: float


class HangingLoad(Protocol):
    """From what the fingers feel to what hangs in the hand."""

    def measured(self, now: Observation, loads: Sequence[ContactLoad]) -> tuple[MeasuredLoad, ...]:
        """Return what hangs, always as many loads.

        Args:
            now: What is known.
            loads: Of it, what each finger bears, sensor frame.
        """
        ...


class NetForce:
    """The length of the sum of all forces. A `HangingLoad` for any number of fingers.

    What fingers push and shear against one another is no part of it, nor is the noise of where they touch. Nor is a
    moment: an object that only turns in the fingers is not heard.
    """

    def __init__(self, hand: HandKinematics, force_noise: float, fingers: int) -> None:
        """Take where the fingertips are, the deviation of one force [N], and how many fingers there are."""
        self._hand, self._deviation = hand, force_noise * math.sqrt(fingers)

    def measured(self, now: Observation, loads: Sequence[ContactLoad]) -> tuple[MeasuredLoad, ...]:
        """See `HangingLoad`."""
        assert now.hand is not None
        total: Vector = ZERO
        poses = self._hand.sensor_poses(now.hand.joint_position)
        for finger, pose in zip(now.fingers, poses, strict=True):
            total = add(total, rotate(pose.rotation, finger.force))
        return (MeasuredLoad(norm(total), self._deviation),)


class NetForceAndSpin:
    """The net force, and the spin torque of both of two opposed fingers. A `HangingLoad`.

    About the line through their contacts nothing but spin torques bear a moment: they point one way.
    """

    def __init__(self, force: NetForce, torque_noise: float) -> None:
        """Take the force, and the deviation of one spin torque [N m]."""
        self._force, self._deviation = force, torque_noise * math.sqrt(2.0)

    def measured(self, now: Observation, loads: Sequence[ContactLoad]) -> tuple[MeasuredLoad, ...]:
        """See `HangingLoad`."""
        first, second = loads
        # of opposite normals
        spin = abs(first.spin_torque - second.spin_torque)
        return (*self._force.measured(now, loads), MeasuredLoad(spin, self._deviation))
