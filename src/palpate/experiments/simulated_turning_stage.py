"""The simulated turning stage of a robot file, above the object that it is to touch."""

from palpate.experiments.simulated_stage import RobotInScene, Task, check_simulated, on_a_carrier, simulated_tip
from palpate.kinematics import Leash
from palpate.runtime.robot import Robot
from palpate.runtime.robot_backend import TurningStageEntry
from palpate.sim import Fidelity, TurningStage


def build_turning_stage(robot: Robot, task: Task) -> RobotInScene:
    """Return the simulated turning stage of a robot file.

    Raises:
        InvalidValueError: The simulation cannot be what the file says, or not do the task.
    """
    entry, tip = _entry(robot), simulated_tip(robot, task)
    leash = Leash(entry.leash, entry.angular_leash)
    stage = TurningStage(entry.mass, entry.bandwidth, leash, entry.inertia)
    # implicitfast: the servo of its ball joint counts on damping that is implicit
    fidelity = Fidelity(entry.time_step)
    return on_a_carrier(robot, task, tip, stage, fidelity, stage.lag, stage.lag, stage.stiffness(tip.mass))


def check_turning_stage(robot: Robot) -> None:
    """Refuse a turning stage that could do no task at all.

    Raises:
        InvalidValueError: It could not.
    """
    check_simulated(robot, _entry(robot).time_step)


def _entry(robot: Robot) -> TurningStageEntry:
    entry: object = robot.file.backend
    if not isinstance(entry, TurningStageEntry):
        raise TypeError(f"a {type(entry).__name__} is no turning stage")
    return entry
