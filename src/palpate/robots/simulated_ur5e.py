"""The simulated UR5e of a robot file."""

from typing import ClassVar

import msgspec

from palpate.kinematics import Pose
from palpate.robots.device_settings import Range
from palpate.robots.robot import Robot
from palpate.robots.simulated_arm import SimulatedArm
from palpate.sim import ArmModel
from palpate.sim.carriers.arm_carrier import LOOKING_DOWN
from palpate.sim.carriers.ur5e import ur5e_model


class SimulatedUr5eEntry(SimulatedArm, frozen=True, kw_only=True):
    """A simulated Universal Robots UR5e that starts with its tip upright: see `palpate.sim.ArmCarrier`.

    Attributes:
        robot_base_distance: From its robot base, behind the origin of the base frame, to the origin [m].
        tool_length: From its flange to the tip frame [m].
    """

    RANGES: ClassVar[tuple[Range, ...]] = (
        *SimulatedArm.RANGES,
        ("robot_base_distance_m", 0.0, 2.0, "m"),
        ("tool_length_m", 0.0, 1.0, "m"),
    )

    robot_base_distance: float = msgspec.field(name="robot_base_distance_m", default=0.45)
    tool_length: float = msgspec.field(name="tool_length_m", default=0.1)

    @property
    def pose_base_robot(self) -> Pose:
        """See `SimulatedArm`."""
        return Pose((-self.robot_base_distance, 0.0, 0.0))

    @property
    def pose_flange_tip(self) -> Pose:
        """See `SimulatedArm`."""
        return Pose((0.0, 0.0, self.tool_length), LOOKING_DOWN)

    def arm_model(self, robot: Robot) -> ArmModel:
        """See `SimulatedArm`."""
        return ur5e_model()
