"""A Universal Robots UR5e, from its file: `sim/arms/ur5e.xml`."""

from functools import cache

from palpate.kinematics import FollowingErrorLimit, Pose
from palpate.sim.carriers.arm_file import ARMS, ArmFile
from palpate.sim.carriers.arm_model import ArmModel
from palpate.sim.carriers.servoed_arm import ServoedArm


@cache
def ur5e_model() -> ArmModel:
    """Return the arm alone, without a tool."""
    return ArmFile(ARMS / "ur5e.xml", "flange").read()


def ur5e(
    pose_base_robot: Pose | None = None,
    pose_flange_tip: Pose | None = None,
    bandwidth: float = 100.0,
    following_error_limit: FollowingErrorLimit | None = None,
) -> ServoedArm:
    """Return a UR5e that stands somewhere: see `ServoedArm`."""
    stand, tip = pose_base_robot or Pose(), pose_flange_tip or Pose()
    return ServoedArm(ur5e_model(), stand, tip, bandwidth, following_error_limit or FollowingErrorLimit())
