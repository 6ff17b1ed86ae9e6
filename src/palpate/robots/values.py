"""Options whose default is in the robot file: fingertip, noise and period."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, TypeVar

from palpate.errors import InvalidValueError
from palpate.robots.finger_sensor import model_of_finger, noise_of
from palpate.robots.fingertip import tip_sizes
from palpate.robots.robot import Robot, load_robot

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

    Config = TypeVar("Config", bound=DataclassInstance)

TAKEN = ("tip", "force_noise", "moment_noise", "period")
"""Options that `values_of` gives."""


def values_of(robot: Robot) -> dict[str, object]:
    """Return the options that a robot file supplies: fingertip [m], noise [N, N m] and control period [s].

    Raises:
        InvalidValueError: It has no fingertip that can be simulated.
    """
    force, moment = noise_of(model_of_finger(robot.file.fingers[0]))
    sensor = robot.sensors[0]
    if robot.file.backend.REAL and sensor is not None:
        force, moment = max(sensor.noise_force), max(sensor.noise_moment)
    return {"tip": tip_sizes(robot), "force_noise": force, "moment_noise": moment, "period": robot.file.period}


def on_robot(config: "Config", robot: Robot) -> "Config":
    """Return a configuration in which a robot file supplies what of `TAKEN` is left out.

    Raises:
        InvalidValueError: Its values contradict the rest.
    """
    left_out = [name for name in TAKEN if getattr(config, name) in (None, ())]
    if not left_out:
        return config
    known = values_of(robot)
    return replace(config, **{name: known[name] for name in left_out})


@contextmanager
def named_devices(name: str) -> Iterator[Robot]:
    """Give the rig that the devices of a robot are; those that are emulated run meanwhile.

    Raises:
        InvalidValueError: There is no such robot, or it has no devices.
        DeviceError: Emulators do not come up.
    """
    robot = load_named_robot(name)
    try:
        devices = robot.file.backend.devices(robot)
    except InvalidValueError as error:
        raise InvalidValueError(f"robot = {name}: {error}") from None
    with devices as rig:
        yield rig


def load_named_robot(name: str) -> Robot:
    """Return a robot, as `load_robot` does, with one kind of error.

    Raises:
        InvalidValueError: A file cannot be read, or something in it is wrong.
    """
    try:
        return load_robot(name)
    except OSError as error:
        raise InvalidValueError(f"robot = {name}: cannot be read: {error.strerror}") from None
