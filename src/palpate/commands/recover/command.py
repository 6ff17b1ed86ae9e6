"""`palpate recover`: reports the state of a robot's devices, and brings back what was stopped, if it may."""

import math
import sys
from collections.abc import Callable
from contextlib import closing

from rich.console import Console

from palpate.commands.command_result import CommandResult, ExitCode
from palpate.commands.progress import doing
from palpate.commands.recover.config import RecoverConfig
from palpate.commands.say import say
from palpate.hw.condition import DeviceCondition, Recoverable
from palpate.hw.devices import ArmDevice, DeviceError, HandDevice, SensorDevice, SensorReading
from palpate.robots.rig import RigParts, parts_of
from palpate.robots.values import named_devices
from palpate.runtime.data import ArmSample
from palpate.runtime.standstill_check import REST_SPEED

AnyDevice = ArmDevice | HandDevice | SensorDevice


def condition_of(device: AnyDevice) -> DeviceCondition:
    """Return the condition of a device; one that cannot be reached is not fit.

    Raises:
        MissingLibraryError: This computer lacks its client library.
    """
    try:
        if isinstance(device, Recoverable):
            return device.condition()
        device.start()
        return _shown_by(device, device.read())
    except DeviceError as error:
        return failed(device, error)


def failed(device: AnyDevice, error: DeviceError) -> DeviceCondition:
    """Return the condition of a device that did not do what it was asked."""
    return DeviceCondition(device.name, error.problem, fit=False, remedy=error.remedy)


def _shown_by(device: AnyDevice, sample: object) -> DeviceCondition:
    """Return what a sample of a device shows of its condition."""
    if isinstance(sample, SensorReading) and not sample.healthy:
        why = getattr(device, "problem", "") or "its status says that the reading is no good"
        return DeviceCondition(device.name, why, fit=False, remedy="take loads off, and see its manual")
    if isinstance(sample, ArmSample):
        speed = math.hypot(*sample.velocity_base_tip)
        if speed >= REST_SPEED:
            remedy = "another program or somebody's hand moves it: end that first"
            return DeviceCondition(device.name, f"it moves at {1e3 * speed:.3g} mm/s", fit=False, remedy=remedy)
        return DeviceCondition(device.name, "it stands still", fit=True)
    return DeviceCondition(device.name, "sends good readings", fit=True)


Confirm = Callable[[str], bool]
"""Returns whether somebody agrees to an action."""


def run_recover(config: RecoverConfig) -> CommandResult:
    """Report on every device, and recover those that can be.

    Returns:
        The condition of each in the end; done if all are fit.

    Raises:
        InvalidValueError: There is no such robot, or it has no devices.
        MissingLibraryError: This computer lacks the arm's client library.
        DeviceError: Emulators do not come up.
    """
    with named_devices(config.robot) as rig:
        rig.file.backend.check(rig)
        return recovered(parts_of(rig), _confirmation(config))


def recovered(parts: RigParts, confirm: Confirm) -> CommandResult:
    """Recover the devices of a rig, one after the other; `confirm` is asked before each action."""
    console, changed, found = Console(), [], []
    for device in _devices(parts):
        with closing(device):
            condition = condition_of(device)
            say(console, str(condition))
            if condition.action and confirm(f"{device.name}: {condition.action}"):
                changed.append(device.name)
                condition = _after(device, console)
                say(console, str(condition))
            found.append(condition)
    unfit = [condition.device for condition in found if not condition.fit]
    fit = "Fit to run" if not unfit else f"Not fit to run: {', '.join(unfit)}"
    outcome = f"{fit}; {'changed: ' + ', '.join(changed) if changed else 'nothing was changed'}."
    say(console, outcome)
    return CommandResult(
        ExitCode.UNFINISHED if unfit else ExitCode.DONE,
        outcome,
        facts={"fit": not unfit, "changed": changed, "devices": found},
    )


def _after(device: AnyDevice, console: Console) -> DeviceCondition:
    """Recover a device and return its condition then."""
    try:
        with doing(console, "recovering"):
            if isinstance(device, Recoverable):
                device.recover()
    except DeviceError as error:
        return failed(device, error)
    return condition_of(device)


def _devices(parts: RigParts) -> list[AnyDevice]:
    """Return the devices of a rig, what only reports first."""
    found: list[AnyDevice] = [each.device for each in parts.sensors if not each.in_arm]
    return [*found, *(device for device in (parts.hand, parts.arm) if device is not None)]


def _confirmation(config: RecoverConfig) -> Confirm:
    if config.yes:
        return lambda action: True
    return _asked if sys.stdin.isatty() else _declined


def _asked(action: str) -> bool:
    """Ask on the terminal; anything but yes is no."""
    sys.stdout.write(f"{action}. Is the cause gone and the path clear? [y/N] ")
    sys.stdout.flush()
    return sys.stdin.readline().strip().lower() in ("y", "yes")


def _declined(action: str) -> bool:
    say(Console(), f"Not done, for there is no terminal to ask on (--yes does it): {action}.")
    return False
