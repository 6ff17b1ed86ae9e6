"""What a robot file says that an exploration would otherwise be told."""

from dataclasses import replace

from palpate.errors import InvalidValueError
from palpate.experiments.explore.config import ExploreConfig
from palpate.robots.finger_sensor import model_of_finger, noise_of
from palpate.robots.simulated_stage import tip_sizes
from palpate.runtime.robot import Robot, load_robot
from palpate.runtime.robot_rig import RigEntry

SAID = ("tip", "force_noise", "moment_noise", "period")
"""Fields that `values_of` gives."""


def values_of(robot: Robot) -> dict[str, object]:
    """Return fields of `ExploreConfig` as a robot file gives them: fingertip, noise and period.

    Raises:
        InvalidValueError: It has no fingertip that an exploration can use.
    """
    force, moment = noise_of(model_of_finger(robot.file.fingers[0]))
    sensor = robot.sensors[0]
    if isinstance(robot.file.backend, RigEntry) and sensor is not None:
        force, moment = max(sensor.noise_force), max(sensor.noise_moment)
    return {
        "tip": tip_sizes(robot),
        "force_noise": force,
        "moment_noise": moment,
        "period": robot.file.period,
    }


def on_robot(config: ExploreConfig, robot: Robot) -> ExploreConfig:
    """Return a configuration in which a robot file says what is left out: fingertip, noise and period.

    Raises:
        InvalidValueError: What it says cannot be with the rest.
    """
    left_out = [name for name in SAID if getattr(config, name) in (None, ())]
    if not left_out:
        return config
    said = values_of(robot)
    return replace(config, **{name: said[name] for name in left_out})  # type: ignore[arg-type]  # by their names


def load_named_robot(name: str) -> Robot:
    """Return a robot, as `load_robot` does, with one kind of error.

    Raises:
        InvalidValueError: A file cannot be read, or something in it is wrong.
    """
    try:
        return load_robot(name)
    except OSError as error:
        raise InvalidValueError(f"robot = {name}: cannot be read: {error.strerror}") from None
