"""Kinematics of serial arms, for simulated and real ones alike: pure, fast, and free of any robot's library."""

from palpate.kinematics.arm import DHRow, JointLimits, LinkInertia, SerialArm
from palpate.kinematics.forward import ArmKinematics
from palpate.kinematics.pose import Pose
from palpate.kinematics.position import all_joint_positions, nearest_joint_position
from palpate.kinematics.reference import FollowingErrorLimit, TipReference
from palpate.kinematics.ur5e import UR5E
from palpate.kinematics.velocity import InverseVelocity, JointMotion, Limit

__all__ = [
    "UR5E",
    "ArmKinematics",
    "DHRow",
    "FollowingErrorLimit",
    "InverseVelocity",
    "JointLimits",
    "JointMotion",
    "Limit",
    "LinkInertia",
    "Pose",
    "SerialArm",
    "TipReference",
    "all_joint_positions",
    "nearest_joint_position",
]
