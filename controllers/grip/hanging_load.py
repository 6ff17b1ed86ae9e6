"""What hangs in a hand: loads that fall where contacts give way, and not where they share them anew."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from palpate.errors import positive
from palpate.friction.contact_load import ContactLoad
from palpate.friction.slip.load_noise import LoadNoise
from palpate.kinematics.hand import HandKinematics
from palpate.kinematics.pose import Pose
from palpate.runtime.data import Observation
from palpate.spatial import ZERO, Vector, add, add_scaled, cross, dot, norm, rotate, scale, subtract

LATELY = 0.05
"""[s] Time constant of the mean moment: friction falls within 20 ms, a pull beside the fingers grows slowly."""

NOW, BEFORE = 0.005, 0.5
"""[s] Time constants of what two fingers bear against each other, and of what it was: as a grip is let down, the
part of the one that slips goes over slowly."""


@dataclass(frozen=True, slots=True)
class MeasuredLoad:
    """One load.

    Attributes:
        size: [N], or [N m].
        deviation: Of its noise, likewise.
        wanders: As the zeros of the sensors may [N/s], or [N m/s].
    """

    size: float
    deviation: float
    wanders: float = 0.0

    def scaled(self, by: float) -> "MeasuredLoad":
        """Return it times a factor."""
        return MeasuredLoad(by * self.size, by * self.deviation, by * self.wanders)


@dataclass(frozen=True, slots=True)
class ForceErrors:
    """What the force of one finger errs by.

    Attributes:
        noise: Standard deviation [N].
        wanders: Its zero [N/s].
    """

    noise: float
    wanders: float = 0.0


class HangingLoad(Protocol):
    """From what the fingers feel to what hangs in the hand."""

    def start(self) -> None:
        """Something else hangs now."""
        ...

    def measured(self, now: Observation, loads: Sequence[ContactLoad]) -> tuple[MeasuredLoad, ...]:
        """Return what hangs, always as many loads.

        Args:
            now: What is known.
            loads: Of it, what each finger bears, sensor frame.
        """
        ...

    def shared(self, now: Observation, loads: Sequence[ContactLoad]) -> MeasuredLoad | None:
        """Return what the fingers share as they did before; None where they share anew by themselves."""
        ...


class SensorPoses:
    """Where the fingers' sensors are in the hand frame, computed once per sample."""

    def __init__(self, hand: HandKinematics) -> None:
        """Take the hand."""
        self._hand = hand
        self._joints: tuple[float, ...] | None = None
        self._poses: tuple[Pose, ...] = ()

    def at(self, now: Observation) -> tuple[Pose, ...]:
        """Return them, one per finger."""
        assert now.hand is not None
        joints = now.hand.joint_position
        if joints is not self._joints:
            self._joints, self._poses = joints, self._hand.sensor_poses(joints)
        return self._poses


class NetForce:
    """The length of the sum of all forces. A `HangingLoad` for any number of fingers.

    What fingers push and shear against one another is no part of it, nor is the noise of where they touch. Nor is
    a moment: an object that only turns in the fingers is not heard.
    """

    def __init__(self, poses: SensorPoses, errors: ForceErrors, fingers: int) -> None:
        """Take where the fingertips are, what a force errs by, and how many fingers there are."""
        self._poses = poses
        self._deviation, self._wanders = errors.noise * math.sqrt(fingers), errors.wanders * fingers

    def start(self) -> None:
        """See `HangingLoad`."""

    def measured(self, now: Observation, loads: Sequence[ContactLoad]) -> tuple[MeasuredLoad, ...]:
        """See `HangingLoad`."""
        total: Vector = ZERO
        for finger, pose in zip(now.fingers, self._poses.at(now), strict=True):
            total = add(total, rotate(pose.rotation, finger.force))
        return (MeasuredLoad(norm(total), self._deviation, self._wanders),)

    def shared(self, now: Observation, loads: Sequence[ContactLoad]) -> MeasuredLoad | None:
        """See `HangingLoad`: not told."""
        return None


class NetWrench:
    """The net force, and what is left of the net moment. A `HangingLoad` for three fingers or more.

    A moment has no direction in which it hangs: what counts is how far it has moved off its mean of late, against
    the net force at the arm of the fingertips.
    """

    def __init__(self, hand: HandKinematics, errors: ForceErrors, fingers: int, period: float) -> None:
        """Take where the fingertips are, what a force errs by, how many fingers there are, and the period [s]."""
        self._hand = hand
        self._deviation, self._wanders = errors.noise * math.sqrt(fingers), errors.wanders * fingers
        self._share = -math.expm1(-period / LATELY)
        self.start()

    def start(self) -> None:
        """See `HangingLoad`."""
        self._mean: Vector | None = None

    def measured(self, now: Observation, loads: Sequence[ContactLoad]) -> tuple[MeasuredLoad, ...]:
        """See `HangingLoad`."""
        assert now.hand is not None
        poses = self._hand.sensor_poses(now.hand.joint_position)
        center = _center([pose.position for pose in poses])
        force, moment, square = ZERO, ZERO, 0.0
        for finger, pose in zip(now.fingers, poses, strict=True):
            a, b, c, d, e, f = finger.wrench
            its, arm = rotate(pose.rotation, (a, b, c)), subtract(pose.position, center)
            force = add(force, its)
            moment = add(moment, add(rotate(pose.rotation, (d, e, f)), cross(arm, its)))
            square += dot(arm, arm)
        arm_length = math.sqrt(square / len(poses))
        self._mean = moment if self._mean is None else self._mean
        off = subtract(moment, self._mean)
        self._mean = add_scaled(self._mean, self._share, off)
        size = norm(force)
        return (
            MeasuredLoad(size, self._deviation, self._wanders),
            MeasuredLoad(max(2.0 * size * arm_length - norm(off), 0.0), self._deviation * arm_length),
        )

    def shared(self, now: Observation, loads: Sequence[ContactLoad]) -> MeasuredLoad | None:
        """See `HangingLoad`: three fingers share a load anew whenever they move, so that nothing is told."""
        return None


class OpposedLoad:
    """The net force, and the spin torque of both of two opposed fingers. A `HangingLoad`.

    About the line through their contacts nothing but spin torques bear a moment: they point one way. What one
    finger bears against the other changes only where one of them slips.
    """

    def __init__(
        self, hand: HandKinematics, errors: ForceErrors, noise: LoadNoise, length: float, period: float
    ) -> None:
        """Take the pieces.

        Args:
            hand: Where the fingertips are.
            errors: What a force errs by.
            noise: Of what one contact bears.
            length: By which spin torques are weighed against forces: e [m].
            period: Of control [s].
        """
        self._poses, self._length = SensorPoses(hand), positive("length", length, "m")
        self._force = NetForce(self._poses, errors, 2)
        self._deviation = noise.torque * math.sqrt(2.0)
        self._shared = math.sqrt(2.0) * math.hypot(noise.force, noise.torque / length)
        self._now, self._before = (-math.expm1(-period / time) for time in (NOW, BEFORE))
        self.start()

    def start(self) -> None:
        """See `HangingLoad`."""
        self._means: tuple[Vector, float, Vector, float] | None = None
        self._borne = self._most = 0.0

    def measured(self, now: Observation, loads: Sequence[ContactLoad]) -> tuple[MeasuredLoad, ...]:
        """See `HangingLoad`."""
        first, second = loads
        # of opposite normals
        spin = abs(first.spin_torque - second.spin_torque)
        return (*self._force.measured(now, loads), MeasuredLoad(spin, self._deviation))

    def shared(self, now: Observation, loads: Sequence[ContactLoad]) -> MeasuredLoad | None:
        """See `HangingLoad`: what both have borne, less what has gone over from one to the other of late."""
        first, second = (
            rotate(pose.rotation, load.tangential_force)
            for pose, load in zip(self._poses.at(now), loads, strict=True)
        )
        against, spin = subtract(first, second), (loads[0].spin_torque + loads[1].spin_torque) / self._length
        latest, its, before, other = self._means or (against, spin, against, spin)
        latest, its = add_scaled(latest, self._now, subtract(against, latest)), its + self._now * (spin - its)
        before = add_scaled(before, self._before, subtract(latest, before))
        other += self._before * (its - other)
        self._means = latest, its, before, other
        borne = sum(math.hypot(load.tangential_length, load.spin_torque / self._length) for load in loads)
        self._borne += self._now * (borne - self._borne)
        # a load that goes away is none that goes over
        self._most = max(self._borne, self._most + self._before * (self._borne - self._most))
        off = math.hypot(norm(subtract(latest, before)), its - other)
        return MeasuredLoad(max(self._most - off, 0.0), self._shared)


def _center(points: Sequence[Vector]) -> Vector:
    total = ZERO
    for point in points:
        total = add(total, point)
    return scale(1.0 / len(points), total)
