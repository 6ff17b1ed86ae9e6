"""What hangs in a hand, as one number that falls where contacts give way, and not where they share it anew."""

import math
from collections.abc import Sequence
from typing import Protocol

from palpate.friction.contact_load import ContactLoad
from palpate.friction.limit_surface import LimitSurface
from palpate.friction.slip.load_noise import LoadNoise
from palpate.kinematics.hand import HandKinematics
from palpate.runtime.data import Observation
from palpate.spatial import ZERO, Vector, add, norm, rotate


class HangingLoad(Protocol):
    """From what the fingers feel to what hangs in the hand."""

    def measured(self, now: Observation, loads: Sequence[ContactLoad]) -> tuple[float, float]:
        """Return its size and the standard deviation of that [N].

        Args:
            now: What is known.
            loads: Of it, what each finger bears, sensor frame.
        """
        ...


class SummedLoad:
    """The sum of |(f_t, tau / e)| over the fingers: of two opposed ones, whose friction points one way.

    A `HangingLoad` that knows nothing of where the fingers are, and hears spin as it hears slip.
    """

    def __init__(self, surface: LimitSurface, noise: LoadNoise) -> None:
        """Take how torque is weighed against force (mu has no part in it), and the noise of one finger."""
        self._surface, self._noise = surface, noise

    def measured(self, now: Observation, loads: Sequence[ContactLoad]) -> tuple[float, float]:
        """See `HangingLoad`."""
        sizes = sum(load_size(self._surface, load) for load in loads)
        return sizes, math.hypot(*(self._deviation(load) for load in loads))

    def _deviation(self, load: ContactLoad) -> float:
        # at least that of the torque: to first order it has no part where there is none, but its square has
        surface = self._surface
        ratio = self._noise.of_ratio(surface, load.normal_force, load.tangential_length, load.spin_torque)
        return max(ratio * surface.friction * load.normal_force, self._noise.torque / surface.spin_length)


class NetForce:
    """The length of the sum of all forces. A `HangingLoad` for any number of fingers.

    What three fingers push and shear against one another is no part of it. Nor is a moment: an object that only
    turns in the fingers is not heard.
    """

    def __init__(self, hand: HandKinematics, force_noise: float, fingers: int) -> None:
        """Take where the fingertips are, the deviation of one force [N], and how many fingers there are."""
        self._hand, self._deviation = hand, force_noise * math.sqrt(fingers)

    def measured(self, now: Observation, loads: Sequence[ContactLoad]) -> tuple[float, float]:
        """See `HangingLoad`."""
        assert now.hand is not None
        total: Vector = ZERO
        poses = self._hand.sensor_poses(now.hand.joint_position)
        for finger, pose in zip(now.fingers, poses, strict=True):
            total = add(total, rotate(pose.rotation, finger.force))
        return norm(total), self._deviation


def load_size(surface: LimitSurface, load: ContactLoad) -> float:
    """Return |(f_t, tau / e)| of a load [N]: what friction, times its normal force, must be."""
    return surface.friction * surface.load_ratio(1.0, load.tangential_length, load.spin_torque)
