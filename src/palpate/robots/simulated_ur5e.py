"""The simulated UR5e of a robot file, above the object that it is to touch."""

from dataclasses import replace

from palpate.kinematics import FollowingErrorLimit, Pose
from palpate.robots.backend_entries import SimulatedUr5eEntry
from palpate.robots.entry import entry_of
from palpate.robots.robot import Robot
from palpate.robots.simulated_stage import RobotInScene, Task, on_a_carrier, simulated_tip
from palpate.sim import ArmCarrier, Ur5e
from palpate.sim.carriers.arm_carrier import LOOKING_DOWN
from palpate.sim.presets import ARM

DOWN = (0.0, 0.0, -1.0)
"""Direction in which it presses."""


def build_ur5e(robot: Robot, task: Task) -> RobotInScene:
    """Return the simulated UR5e of a robot file, at the task's start.

    Raises:
        InvalidValueError: The simulation cannot be built as the file specifies, or cannot do the task: the start
            may be out of reach.
    """
    entry, tip = entry_of(robot, SimulatedUr5eEntry), simulated_tip(robot, task)
    arm = Ur5e(
        Pose((-entry.robot_base_distance, 0.0, 0.0)),
        Pose((0.0, 0.0, entry.tool_length), LOOKING_DOWN),
        entry.bandwidth,
        FollowingErrorLimit(entry.following_error_limit),
    )
    carrier = ArmCarrier(arm)
    stiffness = arm.push(carrier.joint_start(task.start), DOWN) / arm.following_error_limit.distance
    # velocity is fed forward, so that a ramp is followed without lag; what is fast the servos follow no faster for
    # that: to force control they are the delay that they are on a stage of the same bandwidth
    fidelity = replace(ARM.fidelity, time_step=entry.time_step)
    return on_a_carrier(robot, task, tip, carrier, fidelity, 0.0, arm.lead, stiffness)
