"""A tip's motion as joint references for position servos, on a following-error limit (anti-windup).

Once per control period the wanted twist moves a reference of the tip's pose, and the joint references follow it
by `InverseVelocity`: they take its motion, and what is left between the two at `RECOVERY` per second. So nothing
drifts, and an orientation once taken is kept. Should the arm be held back, the reference of the tip waits: it
stays within the following-error limit of where the arm really is, in position and in orientation apart, so that
what stops the tip does not turn it. What pushes the tip against an obstacle is the servos' stiffness over the
following-error limit, as on the stage. Where joints are too slow, the reference slows down with them; where their
ranges end, it stops.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from palpate.errors import InvalidValueError, positive
from palpate.kinematics.pose import (
    Pose,
    orthonormal,
    rotation_from_rotvec,
    rotvec_from_rotation,
    times,
    transposed,
)
from palpate.kinematics.velocity import InverseVelocity, JointMotion, Limit
from palpate.spatial import ZERO, Matrix, Vector, add, add_scaled, dot, limit_norm, norm, scale, subtract

RECOVERY = 20.0
"""[1/s] at which joint references come back to the tip's reference after damping kept them from it: 50 ms, in
which a whole following-error limit of 1 mm asks for 20 mm/s."""


ASIDE = 2.0
"""Times the following-error limit: how far a reference may be from the tip at right angles to the wanted
direction. An arm yields askew: pushing straight at a wall without friction, a UR5e with its tip down is off to the
side by half to twice as much as ahead (by its compliance, over its workspace)."""

MAX_LEAD = math.hypot(1.0, ASIDE)
"""Times the following-error limit: how far a reference may be from the tip at all; the bound for one that shall
not move."""


@dataclass(frozen=True, slots=True)
class FollowingErrorLimit:
    """How far the reference may run ahead of the arm.

    Servos of 100 rad/s whose reference's velocity is fed forward are behind a start from rest to v by
    v / (e bandwidth) at most: 1 mm leaves starts to 0.27 m/s alone.

    Attributes:
        distance: Between the origins of the tip frames, ahead in the wanted direction [m]; sideways `ASIDE` times
            as much, on its own: a tip that pushes against a wall has its reference partly beside it, and would
            skate along the wall if what holds it there were taken back with what pushes.
        angle: Between their orientations [rad].
    """

    distance: float = 0.001
    angle: float = 0.02

    def __post_init__(self) -> None:
        positive("following-error limit distance", self.distance, "m")
        positive("following-error limit angle", self.angle, "rad")
        if self.angle > math.pi / 2.0:
            raise InvalidValueError(
                f"following-error limit angle = {self.angle:g} rad: must be at most {math.pi / 2:.4f}"
            )


class TipReference:
    """Integrates twists into joint references; one instance per arm and run.

    Attributes:
        inverse: From twists to joint velocities.
        following_error_limit: How far it may run ahead.
        joint_reference: Where the servos shall hold the joints now [rad].
        joint_feed_forward: At which velocity the servos shall take them to move [rad/s]: that of the reference, as
            far as it moves as wanted. What the following-error limit draws back is left out, and the servos damp
            it: fed forward as well, it would carry an arm that was pushed away on and on.
        pose_base_tip: Where the tip shall be now.
    """

    def __init__(
        self, inverse: InverseVelocity, period: float, following_error_limit: FollowingErrorLimit | None = None
    ) -> None:
        """Take an arm; `start` comes before the first step.

        Args:
            inverse: From twists to joint velocities.
            period: Of control [s].
            following_error_limit: How far it may run ahead.

        Raises:
            InvalidValueError: The period is too long for recovery, or for braking at the end of a range.
        """
        longest = 1.0 / max(inverse.braking_rate, RECOVERY)
        if positive("period", period, "s") > longest:
            raise InvalidValueError(
                f"period = {period:g} s: must be at most {longest:g} s, or joints pass the end of their range"
            )
        self.inverse = inverse
        self.following_error_limit = following_error_limit or FollowingErrorLimit()
        self._period = period
        self.joint_reference: tuple[float, ...] = ()
        self.joint_feed_forward: tuple[float, ...] = ()
        self.pose_base_tip = Pose()

    def start(self, joint_position: Sequence[float]) -> None:
        """Put the reference where the arm is [rad].

        Raises:
            InvalidValueError: Not one angle per joint, or out of a joint's range.
        """
        self.joint_reference = self.inverse.kinematics.arm.joint_position("joint_position", tuple(joint_position))
        self.joint_feed_forward = (0.0,) * len(self.joint_reference)
        self.pose_base_tip = self.inverse.kinematics.pose(self.joint_reference)

    def step(self, joint_position: Sequence[float], velocity: Vector, angular_velocity: Vector) -> JointMotion:
        """Move the references by one period, and return how.

        During the period the servos' references go from the old `joint_reference` to the new one at the
        returned joint velocities.

        Args:
            joint_position: Where the joints really are [rad].
            velocity: Wanted, of the tip frame's origin in base coordinates [m/s].
            angular_velocity: Likewise, of the tip frame [rad/s].
        """
        dt, here, kinematics = self._period, self.pose_base_tip, self.inverse.kinematics
        if not math.isfinite(sum(velocity) + sum(angular_velocity)):
            return self._stand_still(velocity, angular_velocity)
        wanted_shift, wanted_turn = scale(dt, velocity), scale(dt, angular_velocity)
        actual = kinematics.pose(joint_position)
        shift, turn = self._limited_shift(actual, wanted_shift), self._limited_turn(actual, wanted_turn)
        behind, turned_behind = _difference(here, kinematics.pose(self.joint_reference))
        motion = self.inverse.solve(
            self.joint_reference,
            add_scaled(scale(1.0 / dt, shift), RECOVERY, behind),
            add_scaled(scale(1.0 / dt, turn), RECOVERY, turned_behind),
        )
        if motion.limit is Limit.INVALID:
            return self._stand_still(velocity, angular_velocity)
        self.joint_feed_forward = motion.joint_velocity
        if shift is not wanted_shift or turn is not wanted_turn:
            self.joint_feed_forward = self.inverse.solve(
                self.joint_reference,
                scale(_share(shift, wanted_shift), velocity),
                scale(_share(turn, wanted_turn), angular_velocity),
            ).joint_velocity
        self.joint_reference = tuple(
            [q + dt * speed for q, speed in zip(self.joint_reference, motion.joint_velocity, strict=True)]
        )
        part = motion.scale
        if motion.limit is Limit.JOINT_POSITION:
            # what a range forbids is forgotten, or it would hold the joint at its end when all else wants back
            shift = subtract(scale(part, add(shift, behind)), behind)
            turn = subtract(scale(part, add(turn, turned_behind)), turned_behind)
        else:
            shift, turn = scale(part, shift), scale(part, turn)
        self.pose_base_tip = Pose(add(here.position, shift), _turned(here.rotation, turn))
        return motion

    def _stand_still(self, velocity: Vector, angular_velocity: Vector) -> JointMotion:
        """The motion for what is not finite: none."""
        self.joint_feed_forward = (0.0,) * len(self.joint_reference)
        return self.inverse.solve(self.joint_reference, (math.nan, *velocity[1:]), angular_velocity)

    def _limited_shift(self, actual: Pose, wanted: Vector) -> Vector:
        """The reference's shift in this period: as wanted (the same object), unless that is too far ahead."""
        here, following_error_limit = self.pose_base_tip.position, self.following_error_limit.distance
        ahead = subtract(add(here, wanted), actual.position)
        if norm(ahead) <= following_error_limit:
            return wanted
        square = dot(wanted, wanted)
        if square == 0.0:
            return subtract(add(actual.position, limit_norm(ahead, MAX_LEAD * following_error_limit)), here)
        along = scale(dot(ahead, wanted) / square, wanted)
        aside = subtract(ahead, along)
        if norm(along) <= following_error_limit and norm(aside) <= ASIDE * following_error_limit:
            return wanted
        return subtract(
            add(
                actual.position,
                add(limit_norm(along, following_error_limit), limit_norm(aside, ASIDE * following_error_limit)),
            ),
            here,
        )

    def _limited_turn(self, actual: Pose, wanted: Vector) -> Vector:
        """The reference's turn in this period: as wanted (the same object), unless that is too far ahead."""
        here = self.pose_base_tip.rotation
        ahead = rotvec_from_rotation(times(_turned(here, wanted), transposed(actual.rotation)))
        if norm(ahead) <= self.following_error_limit.angle:
            return wanted
        kept = times(rotation_from_rotvec(limit_norm(ahead, self.following_error_limit.angle)), actual.rotation)
        return rotvec_from_rotation(times(kept, transposed(here)))


def _share(moved: Vector, wanted: Vector) -> float:
    """Share of a wanted displacement that was made, 0 to 1; 1 if none was wanted."""
    square = dot(wanted, wanted)
    return min(max(dot(moved, wanted) / square, 0.0), 1.0) if square > 0.0 else 1.0


def _difference(wanted: Pose, actual: Pose) -> tuple[Vector, Vector]:
    """Shift [m] and turn [rad], in base coordinates, that take the actual pose to the wanted one."""
    turn = rotvec_from_rotation(times(wanted.rotation, transposed(actual.rotation)))
    return subtract(wanted.position, actual.position), turn


def _turned(rotation: Matrix, turn: Vector) -> Matrix:
    if turn == ZERO:
        return rotation
    return orthonormal(times(rotation_from_rotvec(turn), rotation))
