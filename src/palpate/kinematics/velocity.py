"""From a wanted motion of the tip to joint velocities: damped near singularities, within the joints' limits.

With the tip's twist t = (v / length, w) and the Jacobian J in the same unit, J = U S V', the joint velocities are

    sum_i  g(s_i) v_i (u_i . t),    g(s) = s / (s^2 + lambda(s)^2),
    lambda(s) = (threshold / 2) (1 - (s / threshold)^2) below the threshold, 0 above

damped least squares (Nakamura & Hanafusa 1986; Wampler 1986), with damping only along the singular directions
that need it (Maciejewski & Klein 1988) and growing as in Chiaverini, Siciliano & Egeland (1994), whose lambda^2 is
proportional to 1 - (s / threshold)^2; here lambda itself is, so that g has a continuous slope. With
x = s / threshold, g = 4 x / (threshold (1 + x^2)^2) below the threshold. So

- above the threshold the motion is exact;
- below, the share ((1 - x^2) / (1 + x^2))^2 of the twist along u_i is lost: 13 % at x = 2/3, 36 % at 1/2;
- no twist asks for more than 1.3 |t| / threshold, at any pose.

Close to a singularity, g leads into it and out again equally slowly, so that pushing on at the edge of the reach
for a while would be paid for by as long a wait on the return. So a component that leads on towards it (its
singular value shrinks along it, by the curvature u . (dJ/dt) v) fades out between 0.2 and 0.1 of the threshold.
Where an arm stands exactly in a singularity it must be led out of it by the joints.

Slides count in units of `length`, so that 1 rad weighs what one length does. An arm of three to five joints cannot
hold its tip's orientation: there v alone counts, and w is what comes of it.

Joints beyond those that the tip needs go to a home posture meanwhile, at `POSTURE_RATE`, by what of that does not
move the tip (Liegeois 1977), and no faster than `POSTURE_SHARE` of the motion of the tip: an arm whose tip stands
still stands still.

The whole motion is then scaled down until each joint keeps to its speed, and comes to its range's end no faster
than `braking_rate` times what is left: the tip keeps to its path, and takes longer. At the end of its range a
joint stops the arm, unless it moves back. The joint velocities are continuous in the wanted twist and in the joint
angles within their ranges, but where two singular values below 0.2 of the threshold cross.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from palpate.errors import FloatArray, InvalidValueError, check_positive
from palpate.kinematics import kernel
from palpate.kinematics.forward import ArmKinematics, pose_of
from palpate.kinematics.pose import Pose
from palpate.spatial import Vector

LENGTH = 0.4
"""[m] that weighs a shift of the tip against a turn by 1 rad: half the reach of an arm of the UR5e's size
(0.425 + 0.3922 m)."""

THRESHOLD = 0.05
"""Of singular values, with `LENGTH`. From 1.3 v / (LENGTH threshold) = pi rad/s: up to v = 48 mm/s the damping
alone keeps a UR5e's joints within their speed. It sets in 6 degrees before a straight wrist and 8 before a
straight elbow."""

BRAKING_RATE = 10.0
"""[1/s]: from full speed, pi rad/s, a joint brakes over the last 18 degrees with at most 31 rad/s^2."""

FEWEST_JOINTS, SIX = 3, 6
"""Joints with which a tip can be moved along any direction; and turned about any axis, too."""

_FLOOR = 0.1
"""Of the threshold: no nearer to a singularity does a motion lead that heads for it."""

_BEND = 0.05
"""Of the curvature that tells where a direction leads: 0.3 at a UR5e's straight elbow and over its shoulder, below
1e-3 at its straight wrist, which has no outside. Below this value the fading sets in gradually."""


POSTURE_RATE = 1.0
"""[1/s] at which joints that the tip leaves free go home: slower than strokes of a scan, faster than its drift."""

POSTURE_SHARE = 0.5
"""Of the joint velocities that the tip needs, as a norm: less than those themselves, so that what moves the tip
stays the larger part."""


class Limit(Enum):
    """What slowed a motion down."""

    NONE = int(kernel.UNLIMITED)
    JOINT_SPEED = int(kernel.SPEED)
    JOINT_POSITION = int(kernel.POSITION)
    INVALID = int(kernel.INVALID)
    """The wanted twist or the joint angles are not finite: the arm stands still."""


_LIMITS = tuple(Limit)


@dataclass(frozen=True, slots=True)
class JointMotion:
    """Joint velocities for a wanted twist, and what became of it.

    Attributes:
        joint_velocity: [rad/s or m/s].
        pose_base_tip: Of the tip at the joint positions they were asked for.
        velocity: What the tip will have, base coordinates [m/s].
        angular_velocity: Likewise [rad/s].
        scale: By which the whole motion was slowed down, 0 to 1.
        limit: What did that.
        joint: Which joint did, counted from 0; None if none.
        smallest_singular_value: Of the Jacobian in the unit of `InverseVelocity.length`; below
            `InverseVelocity.threshold` the motion is damped.
    """

    joint_velocity: tuple[float, ...]
    pose_base_tip: Pose
    velocity: Vector
    angular_velocity: Vector
    scale: float
    limit: Limit
    joint: int | None
    smallest_singular_value: float


@dataclass(frozen=True, slots=True, eq=False)
class InverseVelocity:
    """Joint velocities from twists: see the module's text for the method.

    Compiled when it is made; a solution then costs about ten microseconds.

    Attributes:
        kinematics: Of the arm.
        length: That weighs shifts against turns [m].
        threshold: Singular value below which damping sets in.
        braking_rate: Largest speed towards the end of a joint's range per angle left [1/s]. Who integrates the
            velocities in steps of at most 1 / braking_rate never passes it.
        home: Joint positions that joints which the tip leaves free go to [rad or m]; without: mid-range.
        constants: Chain, bounds, home and settings, as `palpate.kinematics.kernel` takes them.
    """

    kinematics: ArmKinematics
    length: float = LENGTH
    threshold: float = THRESHOLD
    braking_rate: float = BRAKING_RATE
    home: tuple[float, ...] = ()
    constants: tuple[FloatArray, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        check_positive(self, length="m", threshold="", braking_rate="1/s")
        arm, limits = self.kinematics.arm, self.kinematics.arm.limits
        if len(limits) < FEWEST_JOINTS:
            raise InvalidValueError(
                f"{arm.name} has {len(limits)} joints: a tip's position alone asks for {FEWEST_JOINTS}"
            )
        bounds = np.array([(each.lower, each.upper, each.speed) for each in limits]).T.copy()
        home = arm.joint_position("home", self.home) if self.home else bounds[:2].mean(axis=0)
        settings = [self.length, self.threshold, _FLOOR, _BEND, self.braking_rate, POSTURE_RATE, POSTURE_SHARE]
        constants = (self.kinematics.chain, bounds, np.array(home), np.array(settings))
        object.__setattr__(self, "constants", constants)
        self.solve((0.0,) * len(limits), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))

    @property
    def turns(self) -> bool:
        """Whether the arm can turn its tip as it is asked to, and not only move it."""
        return len(self.kinematics.arm.joints) >= SIX

    def solve(self, joint_position: Sequence[float], velocity: Vector, angular_velocity: Vector) -> JointMotion:
        """Return joint velocities at these joint positions.

        Args:
            joint_position: [rad or m], one per joint.
            velocity: Wanted, of the tip frame's origin in base coordinates [m/s].
            angular_velocity: Likewise, of the tip frame [rad/s].
        """
        q, twist = np.array(joint_position, float), np.array(velocity + angular_velocity, float)
        chain, bounds, home, settings = self.constants
        return motion_of(kernel.joint_motion(chain, bounds, home, settings, q, twist))


def motion_of(found: FloatArray) -> JointMotion:
    """Return a joint motion of the numbers that `kernel.joint_motion` gives."""
    numbers = found.tolist()
    vx, vy, vz, wx, wy, wz, scale, smallest, limit, joint = numbers[-10:]
    return JointMotion(
        tuple(numbers[12:-10]),
        pose_of(numbers[:12]),
        (vx, vy, vz),
        (wx, wy, wz),
        scale,
        _LIMITS[int(limit)],
        int(joint) if joint >= 0.0 else None,
        smallest,
    )
