"""What hangs in a hand: loads that fall where contacts give way, and not where they share them anew."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from palpate.compiling import machine_code, njit
from palpate.controllers.small_vectors import dot, length
from palpate.errors import positive
from palpate.friction.contact_load import ContactLoad
from palpate.friction.slip.load_noise import LoadNoise
from palpate.kinematics.hand import HandKinematics
from palpate.kinematics.pose import Pose
from palpate.quick_init import quick_init
from palpate.runtime.data import Observation
from palpate.spatial import (
    IDENTITY,
    ZERO,
    Matrix,
    Vector,
    Wrench,
    add,
    add_scaled,
    cross,
    norm,
    rotate,
    scale,
    subtract,
)
from palpate.spatial import dot as inner

LATELY = 0.05
"""[s] Time constant of the mean moment: friction falls within 20 ms, a pull beside the fingers grows slowly."""

NOW, BEFORE = 0.005, 0.5
"""[s] Time constants of what two fingers bear against each other, and of what it was: as a grip is let down, the
part of the one that slips goes over slowly."""


@quick_init
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


class NetWrench:
    """The net force, and what is left of the net moment, for three fingers or more.

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
        """Begin with another load."""
        self._mean: Vector | None = None

    def measured(self, now: Observation, loads: Sequence[ContactLoad]) -> tuple[MeasuredLoad, ...]:
        """Return the loads that hang in the hand, always the same number of them."""
        assert now.hand is not None
        poses = self._hand.sensor_poses(now.hand.joint_position)
        center = _center([pose.position for pose in poses])
        force, moment, square = ZERO, ZERO, 0.0
        for finger, pose in zip(now.fingers, poses, strict=True):
            a, b, c, d, e, f = finger.wrench
            its, arm = rotate(pose.rotation, (a, b, c)), subtract(pose.position, center)
            force = add(force, its)
            moment = add(moment, add(rotate(pose.rotation, (d, e, f)), cross(arm, its)))
            square += inner(arm, arm)
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
        """Return None: three fingers share a load anew whenever they move."""
        return None


class OpposedLoad:
    """The net force, and the spin torque of both of two opposed fingers.

    What fingers push and shear against one another is no part of the net force, nor is the noise of where they
    touch. About the line through their contacts nothing but spin torques bear a moment: they point one way. What
    one finger bears against the other changes only where one of them slips.
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
        self._force_deviation, self._wanders = errors.noise * math.sqrt(2.0), errors.wanders * 2.0
        self._deviation = noise.torque * math.sqrt(2.0)
        self._shared = math.sqrt(2.0) * math.hypot(noise.force, noise.torque / length)
        self._now, self._before = (-math.expm1(-period / time) for time in (NOW, BEFORE))
        self._state = np.zeros(MOST + 1)
        _kernels()  # compiled before the first period

    def start(self) -> None:
        """Begin with another load."""
        self._state[:] = 0.0

    def measured(self, now: Observation, loads: Sequence[ContactLoad]) -> tuple[MeasuredLoad, ...]:
        """Return the loads that hang in the hand, always the same number of them."""
        (one, other), (a, b) = self._poses.at(now), now.fingers
        force = _kernels()[0](one.rotation, other.rotation, a.wrench, b.wrench)
        first, second = loads
        # of opposite normals
        spin = abs(first.spin_torque - second.spin_torque)
        return MeasuredLoad(force, self._force_deviation, self._wanders), MeasuredLoad(spin, self._deviation)

    def shared(self, now: Observation, loads: Sequence[ContactLoad]) -> MeasuredLoad | None:
        """Return the load that both fingers share as before: what both carried, less what shifted lately."""
        (one, other), (first, second) = self._poses.at(now), loads
        size = _kernels()[1](
            self._state,
            (self._now, self._before, self._length),
            *(one.rotation, first.tangential_force, first.spin_torque),
            *(other.rotation, second.tangential_force, second.spin_torque),
        )
        return MeasuredLoad(size, self._shared)


HangingLoad = NetWrench | OpposedLoad
"""Load that hangs in the hand, estimated from the finger wrenches."""


KNOWN, LATEST, ITS, EARLIER, OTHER, BORNE, MOST = 0, 1, 4, 5, 8, 9, 10
"""Where in its state what is kept of what one finger bears against the other: whether anything is known, the force
[N] and the spin torque over `length` [N] of late, the same of before, and what both bear [N], of late and lately
at most."""


@njit(cache=True)
def _turned(rotation: Matrix, a: Vector) -> Vector:
    return dot(rotation[0], a), dot(rotation[1], a), dot(rotation[2], a)


@njit(cache=True)
def _net_force(one: Matrix, other: Matrix, first: Wrench, second: Wrench) -> float:
    """Length of the sum of two forces that are felt in two frames [N]."""
    a, b = _turned(one, first[:3]), _turned(other, second[:3])
    return length(a[0] + b[0], a[1] + b[1], a[2] + b[2])


@njit(cache=True)
def _shared_size(
    state: Any,
    constants: Vector,
    one: Matrix,
    first: Vector,
    its_spin: float,
    other: Matrix,
    second: Vector,
    other_spin: float,
) -> float:
    now, before, lever = constants
    a, b = _turned(one, first), _turned(other, second)
    spin = (its_spin + other_spin) / lever
    known = state[KNOWN] != 0.0
    state[KNOWN] = 1.0
    for i in range(3):
        against = a[i] - b[i]
        if not known:
            state[LATEST + i] = state[EARLIER + i] = against
        state[LATEST + i] += now * (against - state[LATEST + i])
        state[EARLIER + i] += before * (state[LATEST + i] - state[EARLIER + i])
    if not known:
        state[ITS] = state[OTHER] = spin
    state[ITS] += now * (spin - state[ITS])
    state[OTHER] += before * (state[ITS] - state[OTHER])
    borne = length(length(first[0], first[1], first[2]), its_spin / lever, 0.0)
    borne += length(length(second[0], second[1], second[2]), other_spin / lever, 0.0)
    state[BORNE] += now * (borne - state[BORNE])
    # a load that goes away is none that goes over
    state[MOST] = max(state[BORNE], state[MOST] + before * (state[BORNE] - state[MOST]))
    x, y, z = state[1] - state[5], state[2] - state[6], state[3] - state[7]
    gone_over = length(length(x, y, z), state[ITS] - state[OTHER], 0.0)
    left: float = max(state[MOST] - gone_over, 0.0)
    return left


@cache
def _kernels() -> tuple[Any, Any]:
    wrench = (0.0,) * 6
    return (
        machine_code(_net_force, IDENTITY, IDENTITY, wrench, wrench),
        machine_code(_shared_size, np.zeros(MOST + 1), ZERO, IDENTITY, ZERO, 0.0, IDENTITY, ZERO, 0.0),
    )


def _center(points: Sequence[Vector]) -> Vector:
    total = ZERO
    for point in points:
        total = add(total, point)
    return scale(1.0 / len(points), total)
