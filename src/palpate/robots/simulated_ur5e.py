"""The simulated UR5e of a robot file."""

from dataclasses import replace
from typing import ClassVar

import msgspec

from palpate.kinematics import FollowingErrorLimit, Pose
from palpate.robots.device_settings import Range
from palpate.robots.simulated_kind import SimulatedKind, TipCarrier
from palpate.robots.task import Task
from palpate.sim import ArmCarrier, Tip, ur5e
from palpate.sim.carriers.arm_carrier import LOOKING_DOWN
from palpate.sim.presets import ARM

DOWN = (0.0, 0.0, -1.0)
"""Direction in which it presses."""


class SimulatedUr5eEntry(SimulatedKind, frozen=True, kw_only=True):
    """A simulated Universal Robots UR5e that starts with its tip upright: see `palpate.sim.ArmCarrier`.

    Attributes:
        robot_base_distance: From its robot base, behind the origin of the base frame, to the origin [m].
        tool_length: From its flange to the tip frame [m].
        bandwidth: Natural frequency of its servos [rad/s].
        following_error_limit: Largest distance of the reference from the actual position of the tip [m].
        time_step: Of the simulation [s]; the control period is a whole number of them.
    """

    RANGES: ClassVar[tuple[Range, ...]] = (
        *SimulatedKind.RANGES,
        ("robot_base_distance_m", 0.0, 2.0, "m"),
        ("tool_length_m", 0.0, 1.0, "m"),
        ("bandwidth_rad_per_s", 0.1, 1e4, "rad/s"),
        ("following_error_m", 1e-6, 0.1, "m"),
    )

    robot_base_distance: float = msgspec.field(name="robot_base_distance_m", default=0.45)
    tool_length: float = msgspec.field(name="tool_length_m", default=0.1)
    bandwidth: float = msgspec.field(name="bandwidth_rad_per_s", default=100.0)
    following_error_limit: float = msgspec.field(name="following_error_m", default=0.001)

    @property
    def pose_base_robot(self) -> Pose:
        """Where the arm's own base frame is in that of the scene."""
        return Pose((-self.robot_base_distance, 0.0, 0.0))

    @property
    def pose_flange_tip(self) -> Pose:
        """Where the tip frame is on the flange."""
        return Pose((0.0, 0.0, self.tool_length), LOOKING_DOWN)

    def tip_carrier(self, tip: Tip, task: Task) -> TipCarrier:
        """See `SimulatedKind`."""
        limit = FollowingErrorLimit(self.following_error_limit)
        arm = ur5e(self.pose_base_robot, self.pose_flange_tip, self.bandwidth, limit)
        carrier = ArmCarrier(arm)
        stiffness = arm.push(carrier.joint_start(task.start), DOWN) / limit.distance
        # velocity is fed forward, so that a ramp is followed without lag; what is fast the servos follow no faster
        # for that: to force control they are the delay that they are on a stage of the same bandwidth
        fidelity = replace(ARM.fidelity, time_step=self.time_step)
        return TipCarrier(carrier, fidelity, 0.0, arm.lead, stiffness, limit.distance)
