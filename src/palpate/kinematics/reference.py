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

import numpy as np
import numpy.typing as npt

from palpate.compiling import machine_code
from palpate.errors import FloatArray, InvalidValueError, positive
from palpate.kinematics.forward import pose_of
from palpate.kinematics.kernel import POSE, tip_frame
from palpate.kinematics.pose import Pose
from palpate.kinematics.reference_kernel import RECOVERY, move_reference
from palpate.kinematics.velocity import InverseVelocity, JointMotion, motion_of
from palpate.spatial import Vector


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
        state: Joint references (n), their feed-forward (n), pose of the tip's reference (12), as one array that
            lives as long as this; for code that runs once per control period.
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
        self._count = n = len(inverse.kinematics.arm.joints)
        self.state: FloatArray = np.zeros(2 * n + POSE)
        self._actual, self._twist = np.zeros(n), np.zeros(6)
        limit = self.following_error_limit
        self._constants = (*inverse.constants, np.array((limit.distance, limit.angle)), float(period))
        self._move = machine_code(move_reference, *self._constants, self._actual, self._twist, self.state)
        self._moved = self._move(*self._constants, self._actual, self._twist, self.state)

    @property
    def joint_reference(self) -> tuple[float, ...]:
        """Where the servos shall hold the joints now [rad or m]."""
        return tuple(self.state[: self._count].tolist())

    @property
    def joint_feed_forward(self) -> tuple[float, ...]:
        """At which velocity the servos shall take the joints to move [rad/s or m/s].

        That of the reference, as far as it moves as wanted. What the following-error limit draws back is left out,
        and the servos damp it: fed forward as well, it would carry an arm that was pushed away on and on.
        """
        return tuple(self.state[self._count : 2 * self._count].tolist())

    @property
    def pose_base_tip(self) -> Pose:
        """Where the tip shall be now."""
        return pose_of(self.state[2 * self._count :].tolist())

    @property
    def motion(self) -> JointMotion:
        """How the last step moved the joints: in its period, from the old `joint_reference` to the new one."""
        return motion_of(self._moved)

    def start(self, joint_position: Sequence[float]) -> None:
        """Put the reference where the arm is [rad or m].

        Raises:
            InvalidValueError: Not one number per joint, or out of a joint's range.
        """
        kinematics, n = self.inverse.kinematics, self._count
        joints = kinematics.arm.joint_position("joint_position", tuple(joint_position))
        self.state[:n], self.state[n : 2 * n] = joints, 0.0
        self.state[2 * n :] = tip_frame(kinematics.chain, self.state[:n])

    def step(self, joint_position: npt.ArrayLike, velocity: Vector, angular_velocity: Vector) -> None:
        """Move the references by one period; see `motion`.

        Args:
            joint_position: Where the joints really are [rad or m], shape (joints,).
            velocity: Wanted, of the tip frame's origin in base coordinates [m/s].
            angular_velocity: Likewise, of the tip frame [rad/s].
        """
        self._actual[:], self._twist[:] = joint_position, velocity + angular_velocity
        self._moved = self._move(*self._constants, self._actual, self._twist, self.state)
