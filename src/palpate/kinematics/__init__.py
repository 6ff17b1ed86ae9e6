"""Kinematics of serial arms, for simulated and real ones alike: pure, fast, and free of any robot's library."""

from palpate.kinematics.arm import Joint, JointKind, JointLimits, SerialArm
from palpate.kinematics.denavit_hartenberg import DHRow, arm_of_rows
from palpate.kinematics.followed_path import FollowedPath, StandingArm, follow_path
from palpate.kinematics.forward import ArmKinematics
from palpate.kinematics.pose import Pose
from palpate.kinematics.position import nearest_joint_position
from palpate.kinematics.reference import FollowingErrorLimit, TipReference
from palpate.kinematics.ur5e import UR5E
from palpate.kinematics.velocity import InverseVelocity, JointMotion, Limit

__all__ = [
    "UR5E",
    "ArmKinematics",
    "DHRow",
    "FollowedPath",
    "FollowingErrorLimit",
    "InverseVelocity",
    "Joint",
    "JointKind",
    "JointLimits",
    "JointMotion",
    "Limit",
    "Pose",
    "SerialArm",
    "StandingArm",
    "TipReference",
    "arm_of_rows",
    "follow_path",
    "nearest_joint_position",
]
