"""From a configuration to an exploration that can be carried out: everything is checked and built here."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from palpate.controllers import (
    ExploreController,
    ExploreParameters,
    Raster,
    force_gain,
    live_parameters,
    series_stiffness,
    tracking_delay,
)
from palpate.errors import InvalidValueError
from palpate.experiments.experiment_file import EXPERIMENT_TEXT, config_text, read_config
from palpate.experiments.explore_config import FASTEST, LEAST_FORCE, MOST_FORCE, SLOWEST, ExploreConfig
from palpate.experiments.explore_raster import raster_over
from palpate.experiments.explored_object import object_in, object_texts, scene_object
from palpate.experiments.finger_sensor import sensor_for
from palpate.experiments.robot_in_scene import build
from palpate.experiments.simulated_stage import Task, only_finger
from palpate.runtime import FingerDescription, Limits
from palpate.runtime.live import Change
from palpate.runtime.robot import Robot, load_robot, read_robot
from palpate.sim import MujocoBackend, PairParameters, SceneObject
from palpate.sim.presets import EXPLORE

CLEARANCE = 0.003
"""How far above the object's top the tip starts [m]."""

ROOM = 0.02
"""How far beyond its path the supervisor lets the tip go [m]."""

LANDING_SHARE = 0.75
"""Of the robot's force limit: a larger set force could reach it on landing."""


@dataclass(frozen=True, slots=True, eq=False)
class ExplorationPlan:
    """An exploration that can be carried out: everything checked and built, nothing moved yet.

    Attributes:
        config: What was asked for.
        robot: What carries it out.
        target: What is touched.
        raster: The path of the tip frame's origin, from above.
        parameters: For the controller.
        finger: For touch.
        limits: For the supervisor.
        backend: The simulated stage.
        expected_duration: About how long it takes [s].
        half_compliance: Of tip and object together, half their compression per force [m/N].
    """

    config: ExploreConfig
    robot: Robot
    target: SceneObject
    raster: Raster
    parameters: ExploreParameters
    finger: FingerDescription
    limits: Limits
    backend: MujocoBackend
    expected_duration: float
    half_compliance: float

    def controller(self) -> ExploreController:
        """Return a fresh controller for it."""
        return ExploreController(self.parameters, self.raster, self.config.period)

    def changes(self) -> tuple[Change, ...]:
        """Return the changes of live parameters that were asked for beforehand."""
        return tuple(Change(*change) for change in self.config.change)

    def texts(self) -> dict[str, str]:
        """Return everything that `plan_from_texts` needs to plan the very same again, by file name."""
        return {
            EXPERIMENT_TEXT: config_text(self.config),
            **object_texts(self.target, self.config),
            **self.robot.texts,
        }


def plan_from_texts(texts: Mapping[str, str]) -> ExplorationPlan:
    """Return the plan that `ExplorationPlan.texts` came from, as a log keeps them.

    Raises:
        InvalidValueError: One is missing, or something in one is wrong.
    """
    if EXPERIMENT_TEXT not in texts:
        raise InvalidValueError(f"{EXPERIMENT_TEXT!r} is missing: there are {', '.join(texts) or 'no files'}")
    config = read_config(texts[EXPERIMENT_TEXT])
    return plan(config, read_robot(texts), object_in(texts, config))


def plan(config: ExploreConfig, robot: Robot | None = None, target: SceneObject | None = None) -> ExplorationPlan:
    """Check and build everything that an exploration needs.

    Args:
        config: What to do. Fingertip, noise and period are its own, not the robot file's:
            `palpate.experiments.robot_values.config_for` takes them from there.
        robot: What carries it out; the one that `config.robot` names, if not given.
        target: What is touched; the one that `config.object` names, from its file if there is one, if not given.

    Raises:
        InvalidValueError: The configuration cannot be realised; the message says what to change.
        OSError: A file of the robot cannot be read.
    """
    robot = robot or load_robot(config.robot)
    target = target or scene_object(config)
    raster = raster_over(target, config)
    half_compliance = 0.5 / config.stiffness
    _check_compression(config, config.force * half_compliance)
    law = replace(
        EXPLORE.law,
        stiffness=config.stiffness,
        friction=config.friction,
        spin_length=config.spin_length,
        smallest_force=config.touch_force,
    )
    top = target.top + max(config.tip) + CLEARANCE
    first_x, first_y = raster.corners()[0]
    # the raster so far is the path of the tip's centre; what is moved is the tip frame, which never turns
    x, y, z = only_finger(robot).surface.center
    task = Task(
        tip=config.tip,
        compression=config.force * half_compliance,
        target=target,
        law=law,
        start=(first_x - x, first_y - y, top - z),
        period=config.period,
        sensor=sensor_for(robot, config),
        touch_force=config.touch_force,
    )
    descent = (target.top - target.bottom) + max(config.tip) + CLEARANCE
    path = replace(raster, center=(raster.center[0] - x, raster.center[1] - y))
    limits = _limits(robot.file.limits.limits(), path, top - z, descent)
    _check_force(config, limits)
    ready = build(robot, task)
    _check_push(config, ready.stiffness, robot.file.backend.leash)
    _check_speed(config, ready.backend.scene.pair, limits)
    if config.force < LEAST_FORCE * ready.touch_force * (1.0 - 1e-12):
        raise InvalidValueError(
            f"force = {config.force:g} N: must be at least {LEAST_FORCE * ready.touch_force:g} N, {LEAST_FORCE:g} "
            "times what the robot's sensor file takes for a touch (touch_force_N)"
        )
    sensing_delay = ready.finger.pipeline().delay
    delay = tracking_delay(config.period, ready.response, sensing_delay)
    parameters = ExploreParameters(
        force=config.force,
        speed=config.speed,
        gain=force_gain(series_stiffness(config.stiffness, ready.stiffness), delay),
        lead=tracking_delay(config.period, ready.lag, sensing_delay),
        approach_distance=descent,
        force_range=(LEAST_FORCE * ready.touch_force, min(MOST_FORCE, LANDING_SHARE * limits.force)),
        speed_range=(SLOWEST, min(FASTEST, limits.speed)),
    )
    live = live_parameters(parameters)
    for time, name, value in config.change:
        try:
            live.check(name, value)
        except InvalidValueError as error:
            raise InvalidValueError(f"change after {time:g} s: {error}") from None
    below = float(target.height(np.array(first_x), np.array(first_y)))
    gap = top - (target.bottom if math.isnan(below) else below)  # beside its rim a tip touches a ball, too
    return ExplorationPlan(
        config,
        robot,
        target,
        path,
        parameters,
        ready.finger,
        limits,
        ready.backend,
        _expected_duration(raster, parameters, gap),
        half_compliance,
    )


def _limits(robot: Limits, raster: Raster, top: float, descent: float) -> Limits:
    """The robot's limits, with as much of its workspace as the path needs."""
    xs, ys = zip(*raster.corners(), strict=True)
    lower, upper = (min(xs), min(ys), top - descent), (max(xs), max(ys), top)
    for axis, low, high, least, most in zip(
        "xyz", lower, upper, robot.workspace_lower, robot.workspace_upper, strict=True
    ):
        if high > most or (low < least and axis != "z"):  # how far down it comes, the object decides
            raise InvalidValueError(
                f"the path reaches from {low:g} to {high:g} m along {axis}: it leaves the robot's workspace, "
                f"{least:g} to {most:g} m (limits.workspace_lower_m, workspace_upper_m in the robot file); take a "
                "smaller raster or object, or a robot with more room"
            )
    bounds = zip(lower, upper, robot.workspace_lower, robot.workspace_upper, strict=True)
    boxes = [(max(low - ROOM, least), min(high + ROOM, most)) for low, high, least, most in bounds]
    (x0, x1), (y0, y1), (z0, z1) = boxes
    return replace(robot, workspace_lower=(x0, y0, z0), workspace_upper=(x1, y1, z1))


def _check_compression(config: ExploreConfig, compression: float) -> None:
    if min(config.tip) <= compression:
        raise InvalidValueError(
            f"tip = {min(config.tip):g} m: must be larger than its compression at {config.force:g} N and "
            f"{config.stiffness:g} N/m, {compression:.2g} m"
        )


def _check_force(config: ExploreConfig, limits: Limits) -> None:
    most = min(MOST_FORCE, LANDING_SHARE * limits.force)
    if config.force > most * (1.0 + 1e-12):
        raise InvalidValueError(
            f"force = {config.force:g} N: must be at most {most:g} N, {LANDING_SHARE:.0%} of the robot's limit of "
            f"{limits.force:g} N (limits.force_N in the robot file), for landing may exceed it"
        )


def _check_push(config: ExploreConfig, stiffness: float, leash: float) -> None:
    """Refuse a force that the servos never reach: their reference runs no farther ahead than the leash."""
    push = stiffness * leash
    if config.force > push:
        raise InvalidValueError(
            f"force = {config.force:g} N: the robot pushes with at most {push:.2g} N, its servos' {stiffness:.3g} "
            f"N/m over a leash of {leash:g} m (leash_m, bandwidth_rad_per_s in the robot file); press with less, "
            "or let the leash be longer or the bandwidth higher"
        )


def _check_speed(config: ExploreConfig, pair: PairParameters, limits: Limits) -> None:
    """Refuse speeds over the limit, and at which the simulated friction is not Coulomb's or the tip lifts off."""
    if config.speed > limits.speed:
        raise InvalidValueError(
            f"speed = {config.speed:g} m/s: must be at most the robot's limit, {limits.speed:g} m/s "
            "(limits.speed_m_per_s in the robot file)"
        )
    creep = pair.creep_speed * config.force / config.touch_force  # grows with the force
    if not creep < config.speed < pair.lift_speed / 2.0:
        raise InvalidValueError(
            f"speed = {config.speed:g} m/s: must lie between {creep:.2g} m/s, below which the simulated friction "
            f"creeps, and {pair.lift_speed / 2.0:.2g} m/s, from which it may lift the tip"
        )


def _expected_duration(raster: Raster, parameters: ExploreParameters, gap: float) -> float:
    """About how long it takes: the way down, the rows on a surface that climbs, a stop at every corner."""
    stop = parameters.speed / parameters.acceleration + 0.05
    way = 1.25 * raster.length / parameters.speed + len(raster.corners()) * stop
    return gap / parameters.landing_speed + parameters.settle_time + way
