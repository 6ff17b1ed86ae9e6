"""What `palpate view` shows: the plan of a run that is watched, and the scene of any plan."""

from dataclasses import dataclass, replace
from typing import Any

import msgspec

from palpate.errors import InvalidValueError
from palpate.experiments.kit.experiment import Experiment, Plan
from palpate.experiments.kit.options import lasting
from palpate.robots.twin import stage_twin
from palpate.robots.values import load_named_robot
from palpate.runtime import Pacer
from palpate.runtime.pacing import SimulatedTime
from palpate.runtime.real_time import RealTime
from palpate.runtime.robot_backend import EmulatedHandEntry, EmulatedUr5eEntry
from palpate.runtime.robot_rig import RigEntry
from palpate.viewing import ViewScene


DEVICES = RigEntry, EmulatedUr5eEntry, EmulatedHandEntry
"""Have clocks of their own, be they emulated."""


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
        time_scale: Seconds of the run per second of wall time; of devices, and simulated hands, it cannot be chosen.

    Raises:
        InvalidValueError: It cannot be carried out, or not at such a pace.
    """
    robot = None if config.robot is None else load_named_robot(config.robot)
    if robot is not None and not isinstance(robot.file.backend, DEVICES):
        robot = replace(robot, file=msgspec.structs.replace(robot.file, pace=Pace(time_scale)))
    elif time_scale != 1.0:
        own = "this simulation goes as fast as it can be computed" if robot is None else "devices keep real time"
        raise InvalidValueError(f"time_scale = {time_scale:g}: {own}; leave it out")
    return experiment.plan(config, robot, {})


def shown_scene(experiment: Experiment, plan: Plan) -> ViewScene:
    """Return what there is to see of a run: on a rig without a hand, a stage that carries the tip.

    The object is the one that the run was told of, where it was told that it is; what it really was nobody knows.

    Raises:
        InvalidValueError: It cannot be simulated.
    """
    robot = plan.robot
    if robot is None or not isinstance(robot.file.backend, RigEntry) or robot.file.backend.hand is not None:
        return plan.view()
    return experiment.plan(lasting(plan.config), stage_twin(robot), plan.texts()).view()
