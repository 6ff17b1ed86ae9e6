"""The robot above the object that a regulation of force presses on."""

from dataclasses import replace

from palpate.errors import InvalidValueError
from palpate.experiments.kit.contact_checks import LEAST_TOUCH_FORCE, TOUCH_DEVIATIONS, check_compression
from palpate.experiments.kit.run_checks import CLEARANCE
from palpate.experiments.regulate.config import RegulateConfig
from palpate.experiments.regulate.parts import sensor_of
from palpate.robots.fingertip import fingertip, start_above
from palpate.robots.in_scene import build
from palpate.robots.robot import Robot
from palpate.robots.task import RobotInScene, Task
from palpate.sim import Target
from palpate.sim.presets import EXPLORE


def built(config: RegulateConfig, robot: Robot, target: Target) -> RobotInScene:
    """Return the robot above the object.

    Raises:
        InvalidValueError: The fingertip is smaller than its compression, or a real surface is to move.
    """
    if robot.file.backend.REAL and config.surface != "still":
        raise InvalidValueError(
            f"surface = {config.surface}: is for simulated objects; a real one does as it likes: leave it still"
        )
    tip = fingertip(robot, config.tip)
    sensor = sensor_of(robot, config)
    compression = 0.5 * config.force / config.true_stiffness
    check_compression(tip.half_extents, config.force, config.true_stiffness)
    noise = 0.0 if sensor.model.noise is None else max(sensor.model.noise.sd[:3])
    law = replace(
        EXPLORE.law,
        stiffness=config.true_stiffness,
        friction=config.friction,
        spin_length=config.spin_length,
    )
    task = Task(
        tip=tip,
        compression=compression,
        target=target,
        law=law,
        start=start_above(tip, target.shape.top, CLEARANCE),
        period=config.period or robot.file.period,
        sensor=sensor,
        touch_force=max(LEAST_TOUCH_FORCE, TOUCH_DEVIATIONS * noise),
    )
    return build(robot, task)
