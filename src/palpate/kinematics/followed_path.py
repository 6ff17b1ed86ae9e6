"""A planned path of the tip, followed by the joints before anything moves: how near they come to their limits."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

from palpate.errors import InvalidValueError, positive
from palpate.kinematics.forward import ArmKinematics
from palpate.kinematics.reference import TipReference
from palpate.kinematics.velocity import SIX, InverseVelocity
from palpate.spatial import ZERO, Vector, add_scaled, limit_norm, norm, scale, subtract

LEAST_ROOM = 0.02
"""[rad or m] from a joint to the end of its range, 1 deg or 2 cm: with less it would soon stop the arm."""

STEPS, SHORTEST, LONGEST = 2000, 2e-3, 0.05
"""Steps into which a path is divided, and bounds on their duration [s]; references recover in the longest."""

SLOWEST = 0.01
"""Of the speed of the path: what is slower stands still."""


@dataclass(frozen=True, slots=True)
class StandingArm:
    """An arm as it stands over a task.

    Attributes:
        kinematics: Of the arm, tip included.
        joint_start: Where its joints are [rad or m].
    """

    kinematics: ArmKinematics
    joint_start: tuple[float, ...]

    @property
    def turns(self) -> bool:
        """Whether it can turn its tip as it is asked to."""
        return len(self.joint_start) >= SIX

    @property
    def position(self) -> Vector:
        """Of its tip frame's origin [m]."""
        return self.kinematics.pose(self.joint_start).position


@dataclass(frozen=True, slots=True)
class Extreme:
    """An extreme value along a path.

    Attributes:
        value: What was found.
        joint: Of which joint, counted from 1; None: of all together.
        time: After which [s].
        position: Where the tip was [m].
    """

    value: float
    joint: int | None
    time: float
    position: Vector

    def __str__(self) -> str:
        x, y, z = (1e3 * each for each in self.position)
        of = "" if self.joint is None else f"of joint {self.joint}, "
        return f"{of}after {self.time:.3g} s of it, at ({x:.1f}, {y:.1f}, {z:.1f}) mm"


@dataclass(frozen=True, slots=True)
class FollowedPath:
    """How near an arm comes to its limits along a path.

    Attributes:
        room: Least distance of a joint to the end of its range [rad or m].
        speed: Largest speed of a joint that is asked for, as a share of its limit; above 1 the tip takes longer.
        singular_value: The smallest of the Jacobian, see `InverseVelocity`.
    """

    room: Extreme
    speed: Extreme
    singular_value: Extreme


def follow_path(arm: StandingArm, points: Sequence[Vector], speed: float) -> FollowedPath:
    """Return how near an arm comes to its limits, from where it stands along straight lines from point to point.

    The orientation of the tip is kept, as far as the arm can turn it.

    Args:
        arm: Where it begins.
        points: Of its tip frame's origin, base frame [m].
        speed: Of the tip [m/s].

    Raises:
        InvalidValueError: A joint comes to the end of its range, or the arm to a singularity; the message names
            joint, value, limit, time and place.
    """
    inverse = InverseVelocity(arm.kinematics, home=arm.joint_start)
    corners = (arm.position, *points)
    duration = sum(math.dist(*ends) for ends in pairwise(corners)) / positive("speed", speed, "m/s")
    period = min(max(duration / STEPS, SHORTEST), LONGEST)
    reference = TipReference(inverse, period)
    reference.start(arm.joint_start)
    limits = arm.kinematics.arm.limits
    room = Extreme(math.inf, None, 0.0, arm.position)
    fastest, singular = Extreme(0.0, None, 0.0, arm.position), room
    for i, wanted in enumerate(_stepped(corners, speed * period)):
        joints, time = reference.joint_reference, i * period
        here = reference.pose_base_tip.position
        velocity = limit_norm(scale(1.0 / period, subtract(wanted, here)), speed)
        reference.step(joints, velocity, ZERO)
        motion = reference.motion
        slower = speed / max(norm(motion.velocity), SLOWEST * speed)
        for joint, (q, rate, limit) in enumerate(zip(joints, motion.joint_velocity, limits, strict=True), 1):
            left = min(q - limit.lower, limit.upper - q)
            if left < room.value:
                room = Extreme(left, joint, time, here)
            asked = slower * abs(rate) / limit.speed
            if asked > fastest.value:
                fastest = Extreme(asked, joint, time, here)
        if motion.smallest_singular_value < singular.value:
            singular = Extreme(motion.smallest_singular_value, None, time, here)
        _check(arm, room, singular, inverse.threshold)
    return FollowedPath(room, fastest, singular)


def _check(arm: StandingArm, room: Extreme, singular: Extreme, threshold: float) -> None:
    problem = ""
    if room.joint is not None and room.value < LEAST_ROOM:
        limits = arm.kinematics.arm.limits[room.joint - 1]
        problem = (
            f"{room.value:.2g} {room} is left to the end of the range, {limits.lower:.4g} to {limits.upper:.4g} "
            f"(rad or m), must be at least {LEAST_ROOM:g}"
        )
    elif singular.value < threshold:
        problem = (
            f"it comes to a singularity {singular}: the smallest singular value of its Jacobian is "
            f"{singular.value:.3g}, must be at least {threshold:g}"
        )
    if problem:
        raise InvalidValueError(
            f"{arm.kinematics.arm.name} cannot follow the path: {problem}; place arm or object elsewhere, give "
            "another home posture, or take a smaller region"
        )


def _stepped(corners: Iterable[Vector], step: float) -> Iterator[Vector]:
    """Points at most a step apart [m]."""
    for a, b in pairwise(corners):
        count = max(1, math.ceil(math.dist(a, b) / step))
        for k in range(1, count + 1):
            yield add_scaled(a, k / count, subtract(b, a))
