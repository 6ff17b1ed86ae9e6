"""Where an arm holds its tip, and how the tip moves with the joints."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from palpate.errors import FloatArray
from palpate.kinematics.arm import JointKind, SerialArm
from palpate.kinematics.kernel import tip_frame, tip_jacobian
from palpate.kinematics.pose import Pose, checked_pose
from palpate.spatial import Vector


@dataclass(frozen=True, slots=True, eq=False)
class ArmKinematics:
    """An arm standing somewhere, with a tip on its flange. Base coordinates are those of the scene.

    Everything is compiled when it is made; each call then costs one to two microseconds.

    Attributes:
        arm: Geometry and limits.
        pose_base_robot: Where the arm stands; a real UR's own base frame if it is the identity.
        pose_flange_tip: Where the tip frame sits on the flange.
        chain: All of this as `palpate.kinematics.kernel` takes it, read-only.
    """

    arm: SerialArm
    pose_base_robot: Pose = field(default_factory=Pose)
    pose_flange_tip: Pose = field(default_factory=Pose)
    chain: FloatArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        checked_pose("pose_base_robot", self.pose_base_robot)
        checked_pose("pose_flange_tip", self.pose_flange_tip)
        packed = _flat(self.pose_base_robot) + _flat(self.arm.pose_joint_flange @ self.pose_flange_tip)
        for joint in self.arm.joints:
            packed += [*_flat(joint.pose_before_joint), float(joint.kind is JointKind.SLIDE)]
        object.__setattr__(self, "chain", np.array(packed))
        self.pose((0.0,) * len(self.arm.joints))
        self.jacobian((0.0,) * len(self.arm.joints))

    def pose(self, joint_position: Sequence[float]) -> Pose:
        """Return pose_base_tip at these joint positions [rad or m]."""
        return pose_of(tip_frame(self.chain, np.array(joint_position)).tolist())

    def jacobian(self, joint_position: Sequence[float]) -> FloatArray:
        """Return the geometric Jacobian of the tip frame in base coordinates, shape (6, joints).

        Times joint velocities [rad/s or m/s] it is the velocity of the frame's origin [m/s], then its angular
        velocity [rad/s].
        """
        result: FloatArray = tip_jacobian(self.chain, np.array(joint_position))
        return result

    def velocity(self, joint_position: Sequence[float], joint_velocity: Sequence[float]) -> tuple[Vector, Vector]:
        """Return velocity [m/s] and angular velocity [rad/s] of the tip frame in base coordinates."""
        vx, vy, vz, wx, wy, wz = (self.jacobian(joint_position) @ np.array(joint_velocity)).tolist()
        return (vx, vy, vz), (wx, wy, wz)


def pose_of(frame: Sequence[float]) -> Pose:
    """Return a pose from 12 numbers: position, rotation by rows."""
    x, y, z, a, b, c, d, e, f, g, h, i = frame
    return Pose((x, y, z), ((a, b, c), (d, e, f), (g, h, i)))


def _flat(pose: Pose) -> list[float]:
    return [*pose.position, *(entry for row in pose.rotation for entry in row)]
