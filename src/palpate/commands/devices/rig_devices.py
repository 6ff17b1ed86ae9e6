"""The devices of a robot file, opened one after the other, and the verdict on the whole rig."""

from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import RenderableType

from palpate.commands.command_result import CommandResult, ExitCode
from palpate.hw.devices import ArmDevice, HandDevice, SensorDevice
from palpate.robots.rig import RigParts, parts_of
from palpate.robots.robot import Robot
from palpate.robots.values import named_devices

AnyDevice = ArmDevice | HandDevice | SensorDevice

INVALID_READING = "its status marks the reading as invalid"
"""Problem of a sensor that names none."""


@contextmanager
def opened_rig(name: str) -> Iterator[tuple[Robot, RigParts]]:
    """Yield a robot with its devices, which are not started; emulators run meanwhile.

    Raises:
        InvalidValueError: If there is no such robot, or it has no devices.
        DeviceError: If emulators do not come up.
    """
    with named_devices(name) as robot:
        robot.file.backend.check(robot)
        yield robot, parts_of(robot)


def separate_devices(parts: RigParts) -> list[AnyDevice]:
    """Return all devices but sensors in the arm, in order of care: sensors, which only report, come first."""
    sensors: list[AnyDevice] = [finger.device for finger in parts.sensors if not finger.in_arm]
    return [*sensors, *(device for device in (parts.hand, parts.arm) if device is not None)]


def fitness(fit: bool, outcome: str, shown: tuple[RenderableType, ...] = (), **facts: object) -> CommandResult:
    """Return the result of a command that has examined a rig; unfinished if the rig is not fit to run."""
    code = ExitCode.DONE if fit else ExitCode.UNFINISHED
    return CommandResult(code, outcome, facts={"fit": fit, **facts}, shown=shown)
