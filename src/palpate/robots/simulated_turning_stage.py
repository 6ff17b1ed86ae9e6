"""The simulated turning stage of a robot file, above the object that it is to touch."""

from palpate.kinematics import FollowingErrorLimit
from palpate.robots.entry import entry_of
from palpate.robots.simulated_stage import RobotInScene, Task, on_a_carrier, simulated_tip
from palpate.runtime.robot import Robot
from palpate.runtime.robot_backend import TurningStageEntry
from palpate.sim import Fidelity, TurningStage


def build_turning_stage(robot: Robot, task: Task) -> RobotInScene:
    """Return the simulated turning stage of a robot file.

    Raises:
        InvalidValueError: The simulation cannot be what the file says, or not do the task.
    """
    entry, tip = entry_of(robot, TurningStageEntry), simulated_tip(robot, task)
    following_error_limit = FollowingErrorLimit(entry.following_error_limit, entry.angular_following_error)
    stage = TurningStage(entry.mass, entry.bandwidth, following_error_limit, entry.inertia)
    # implicitfast: the servo of its ball joint counts on damping that is implicit
    fidelity = Fidelity(entry.time_step)
    return on_a_carrier(robot, task, tip, stage, fidelity, stage.lag, stage.lag, stage.stiffness(tip.mass))
