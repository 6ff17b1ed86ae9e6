"""What `palpate view` shows, from the plan of a run: the scene, and the pace of a run that is watched."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import msgspec
import mujoco

from palpate.commands.replay.kinds import kind_of
from palpate.commands.typed_values import set_options
from palpate.commands.view.twin import shown_plan
from palpate.errors import InvalidValueError
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.plan import ExplorationPlan, plan
from palpate.experiments.friction.plan import FrictionPlan
from palpate.experiments.grasp.plan import GraspPlan
from palpate.experiments.grasp.scene import scene_of
from palpate.experiments.kit.experiment_file import load_overlay
from palpate.experiments.kit.scene_view import scene_view
from palpate.experiments.regulate.plan import RegulationPlan
from palpate.experiments.regulate.view import regulation_scene
from palpate.robots.known_truth import known_scene
from palpate.robots.values import load_named_robot
from palpate.runtime import Pacer
from palpate.runtime.log import Log
from palpate.runtime.pacing import SimulatedTime
from palpate.runtime.real_time import RealTime
from palpate.viewing import ViewScene

OWN = {"config": "give it as --config FILE.YAML"}
"""What --set does not take, and what to type."""

ViewedPlan = ExplorationPlan | RegulationPlan | FrictionPlan | GraspPlan
"""What there is a view of."""


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


def watched_plan(words: Sequence[str], config: Path | None, time_scale: float) -> ExplorationPlan:
    """Return the plan of an exploration that is to be watched.

    Args:
        words: Values as NAME=VALUE; they go before those of the file, and those before the robot file's.
        config: Experiment file, if there is one.
        time_scale: Seconds of the run per second of wall time.

    Raises:
        InvalidValueError: Something in it is wrong.
    """
    overlay = {} if config is None else load_overlay(config, ExploreConfig)
    overlay |= set_options(words, ExploreConfig, OWN)
    asked = ExploreConfig(**overlay)  # type: ignore[arg-type]  # their types have been checked
    robot = load_named_robot(asked.robot)
    paced = replace(robot, file=msgspec.structs.replace(robot.file, pace=Pace(time_scale)))
    return plan(asked, paced)


def recorded_plan(log: Log) -> ViewedPlan:
    """Return the plan of the run that a log is of.

    Raises:
        InvalidValueError: It is of something else, or of a palpate that did things differently.
    """
    kind = kind_of(log)
    try:
        planned = kind.plan(log.attachments, {})
    except InvalidValueError as error:
        raise InvalidValueError(
            f"{log.path}: what it says of the run cannot be understood; another palpate wrote it? {error}"
        ) from None
    if not isinstance(planned, ViewedPlan):
        raise InvalidValueError(f"{log.path}: there is no view of what `{kind.command}` does")
    return planned


def simulated_model(planned: ViewedPlan) -> mujoco.MjModel:
    """Return the compiled scene of a run; of a rig's, what it was told that there is."""
    if isinstance(planned, GraspPlan):
        return scene_of(planned.config, planned.hand.hand).model
    return known_scene(shown_plan(planned).backend).model


def view_scene(planned: ViewedPlan) -> ViewScene:
    """Return what there is to see of a run, without map and plan; of a rig's, what it was told that there is."""
    if isinstance(planned, RegulationPlan):
        shown = shown_plan(planned)
        assert isinstance(shown, RegulationPlan)  # the same kind
        return regulation_scene(shown)
    model = simulated_model(planned)
    if isinstance(planned, GraspPlan):
        fingers = "two" if planned.config.fingers == 2 else "three"
        return scene_view(f"A {planned.config.object} in {fingers} fingers", model)
    if isinstance(planned, FrictionPlan):
        return scene_view(f"Friction of a {planned.config.object}, {planned.config.robot}", model)
    config = planned.config
    title = f"Exploration of {config.article} {config.object}, {config.robot}"
    return scene_view(title, model, config.map_spacing)
