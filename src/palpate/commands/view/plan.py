"""What `palpate view` shows: the plan of a run that is watched, or of a log."""

from dataclasses import dataclass, replace
from typing import Any

import msgspec

from palpate.errors import InvalidValueError
from palpate.experiments.kit.experiment import Experiment, Plan
from palpate.experiments.kit.from_log import LoggedRun
from palpate.robots.twin import stage_twin
from palpate.robots.values import load_named_robot
from palpate.runtime import Pacer
from palpate.runtime.pacing import SimulatedTime
from palpate.runtime.real_time import RealTime
from palpate.runtime.robot_rig import RigEntry


@dataclass(frozen=True, slots=True)
class Pace:
    """A robot file's `pace`, in simulation: so many times as fast as in reality.

    Attributes:
        scale: Times; infinite for as fast as it can be computed.
    """

    scale: float

    def pacer(self, period: float) -> Pacer:
        """Return a pacer for a control period of simulated time [s]."""
        return SimulatedTime() if self.scale == float("inf") else RealTime(period / self.scale)


def watched_plan(experiment: Experiment, config: Any, time_scale: float) -> Plan:
    """Return the plan of a run that is to be watched.

    Args:
        experiment: What is done.
        config: How; an instance of its `Config`.
        time_scale: Seconds of the run per second of wall time.

    Raises:
        InvalidValueError: It cannot be carried out, or not at such a pace.
    """
    if config.robot is None:
        if time_scale != 1.0:
            raise InvalidValueError(
                f"time_scale = {time_scale:g}: this simulation goes as fast as it can be computed; leave it out"
            )
        return experiment.plan(config, None, {})
    robot = load_named_robot(config.robot)
    paced = replace(robot, file=msgspec.structs.replace(robot.file, pace=Pace(time_scale)))
    return experiment.plan(config, paced, {})


def recorded_plan(logged: LoggedRun) -> Plan:
    """Return the plan whose scene is shown of a log: of a rig's run the same with a stage that carries the tip.

    The object is the one that the run was told of, where it was told that it is; what it really was nobody knows.

    Raises:
        InvalidValueError: It cannot be planned again, or not be simulated.
    """
    plan = logged.plan()
    if plan.robot is None or not isinstance(plan.robot.file.backend, RigEntry):
        return plan
    return logged.plan(robot=stage_twin(plan.robot))
