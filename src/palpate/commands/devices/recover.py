"""`palpate recover`: reports the state of a robot's devices, and brings stopped devices back after asking."""

import math
import sys
from collections.abc import Callable
from contextlib import closing

from rich.console import Console

from palpate.commands.command_result import CommandResult
from palpate.commands.devices.config import RecoverConfig
from palpate.commands.devices.rig_devices import (
    INVALID_READING,
    AnyDevice,
    fitness,
    opened_rig,
    separate_devices,
)
from palpate.hw.condition import DeviceCondition, Recoverable
from palpate.hw.devices import DeviceError, SensorReading
from palpate.robots.rig import RigParts
from palpate.runtime.data import ArmSample
from palpate.runtime.progress import doing, say
from palpate.runtime.standstill_check import REST_SPEED


def run_recover(config: RecoverConfig) -> CommandResult:
    """Report on every device, and recover those that can be.

    Returns:
        The condition of each device in the end; done if all are fit.

    Raises:
        InvalidValueError: If there is no such robot, or it has no devices.
        MissingLibraryError: If this computer lacks the arm's client library.
        DeviceError: If emulators do not come up.
    """
    with opened_rig(config.robot) as (_, parts):
        return recover_devices(parts, (lambda action: True) if config.yes else _confirmed)


def recover_devices(parts: RigParts, confirm: Callable[[str], bool]) -> CommandResult:
    """Recover the devices of a rig, one after the other.

    Args:
        parts: Devices of the rig.
        confirm: Function that is called with each action before it is taken; returns whether to take it.
    """
    console, changed, conditions = Console(), [], []
    for device in separate_devices(parts):
        with closing(device):
            condition = _condition(device)
            say(console, str(condition))
            if condition.action and confirm(f"{device.name}: {condition.action}"):
                changed.append(device.name)
                with doing(console, "recovering"):
                    condition = _condition(device, recover=True)
                say(console, str(condition))
            conditions.append(condition)
    unfit = [condition.device for condition in conditions if not condition.fit]
    verdict = f"Not fit to run: {', '.join(unfit)}" if unfit else "Fit to run"
    outcome = f"{verdict}; {'changed: ' + ', '.join(changed) if changed else 'nothing was changed'}."
    return fitness(not unfit, outcome, (outcome,), changed=changed, devices=conditions)


def _condition(device: AnyDevice, *, recover: bool = False) -> DeviceCondition:
    """Return the condition of a device, after its recovery if requested; a device that fails is not fit.

    Raises:
        MissingLibraryError: If this computer lacks its client library.
    """
    try:
        if isinstance(device, Recoverable):
            if recover:
                device.recover()
            return device.condition()
        device.start()
        sample = device.read()
    except DeviceError as error:
        return DeviceCondition(device.name, error.problem, fit=False, remedy=error.remedy)
    if isinstance(sample, SensorReading) and not sample.healthy:
        problem = getattr(device, "problem", "") or INVALID_READING
        return DeviceCondition(device.name, problem, fit=False, remedy="take loads off, and see its manual")
    if isinstance(sample, ArmSample):
        speed = math.hypot(*sample.velocity_base_tip)
        if speed >= REST_SPEED:
            remedy = "another program or a hand moves it: end that first"
            return DeviceCondition(device.name, f"it moves at {1e3 * speed:.3g} mm/s", fit=False, remedy=remedy)
        return DeviceCondition(device.name, "it stands still", fit=True)
    return DeviceCondition(device.name, "sends good readings", fit=True)


def _confirmed(action: str) -> bool:
    """Ask on the terminal; any answer but yes, and no terminal, mean no."""
    if not sys.stdin.isatty():
        say(Console(), f"Not done, for there is no terminal to ask on (--yes does it): {action}.")
        return False
    sys.stdout.write(f"{action}. Is the cause gone and the path clear? [y/N] ")
    sys.stdout.flush()
    return sys.stdin.readline().strip().lower() in ("y", "yes")
