"""The robot above what it touches, and the part of its workspace that the touches need."""

from collections.abc import Sequence
from dataclasses import replace

import msgspec
import numpy as np

from palpate.controllers.touch_sequence import TouchStep
from palpate.errors import InvalidValueError
from palpate.experiments.kit.contact_checks import LEAST_TOUCH_FORCE, TOUCH_DEVIATIONS, check_compression
from palpate.experiments.tip_calibration.bench import simulated_bench
from palpate.experiments.tip_calibration.config import TipConfig
from palpate.experiments.tip_calibration.unknown_tip import TipErrors, true_tip
from palpate.robots.finger_sensor import model_with_noise, noise_of
from palpate.robots.fingertip import fingertip, only_finger
from palpate.robots.in_scene import build
from palpate.robots.robot import Robot
from palpate.robots.task import RobotInScene, Task
from palpate.runtime import Limits
from palpate.sim import SeededSensor
from palpate.sim.presets import EXPLORE
from palpate.spatial import as_vector

ROOM = 0.03
"""How far beyond the places of the touches the supervisor lets the tip frame go [m]."""

ABOVE = 0.02
"""How far above all that is touched the tip starts [m]."""


def built(config: TipConfig, robot: Robot) -> RobotInScene:
    """Return the robot above what it touches; in a simulation with the tip that is sought.

    Raises:
        InvalidValueError: The tip is smaller than its compression, or a real one is asked to be another.
    """
    typed, real = fingertip(robot), robot.file.backend.REAL
    if real and config.tip_is_other:
        raise InvalidValueError(
            "unknown_tip, size_error, center_error, turn_error, stiffness_ratio: are for simulations; a real tip "
            "is what it is: leave them out"
        )
    errors = TipErrors.of(config)
    tip = true_tip(typed, errors) if config.tip_is_other else typed
    stiffness = config.stiffness * errors.stiffness
    check_compression(typed.half_extents, max(config.forces), stiffness)
    model = model_with_noise(only_finger(robot), config.force_noise, config.moment_noise)
    noise, _ = noise_of(model)
    x, y, _ = typed.center
    reach = float(np.linalg.norm(typed.center)) + max(typed.half_extents)
    target = simulated_bench(config)
    start = (-x, -y, target.top + reach + ABOVE)
    task = Task(
        tip=tip,
        compression=0.5 * max(config.forces) / config.stiffness,
        target=target,
        law=replace(EXPLORE.law, stiffness=stiffness, friction=config.friction, spin_length=config.spin_length),
        start=start,
        period=robot.file.period,
        sensor=SeededSensor(model, config.seed),
        touch_force=max(LEAST_TOUCH_FORCE, TOUCH_DEVIATIONS * noise),
        believed=typed,
    )
    return build(robot, task)


def workspace_of(robot: Limits, limits: Limits, steps: Sequence[TouchStep]) -> Limits:
    """Return limits with as much of the robot's workspace as touches need.

    Args:
        robot: The robot's own.
        limits: For this run.
        steps: Where the tip goes.

    Raises:
        InvalidValueError: They need more.
    """
    places = np.array([(*step.standoff[:2], z) for step in steps for z in (step.standoff[2], step.height)])
    low, high = places.min(axis=0), places.max(axis=0)
    least, most = np.array(robot.workspace_lower), np.array(robot.workspace_upper)
    for axis in range(3):
        if low[axis] < least[axis] or high[axis] > most[axis]:
            raise InvalidValueError(
                f"the touches reach from {low[axis]:.3g} to {high[axis]:.3g} m along {'xyz'[axis]}: they leave "
                f"the robot's workspace, {least[axis]:g} to {most[axis]:g} m (limits.workspace_lower_m, "
                "workspace_upper_m in the robot file); put plate, rod and ball elsewhere"
            )
    lower, upper = np.maximum(low - ROOM, least), np.minimum(high + ROOM, most)
    return msgspec.structs.replace(limits, workspace_lower=as_vector(lower), workspace_upper=as_vector(upper))
