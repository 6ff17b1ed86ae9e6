"""`palpate doctor`: connects to the devices of a robot file, and says what to fix. Moves nothing."""

import json
import sys
from collections.abc import Callable, Iterator

from rich.console import Console
from rich.table import Table
from rich.text import Text

from palpate.errors import InvalidValueError
from palpate.experiments.doctor_computer import COMPUTER, computer_findings
from palpate.experiments.doctor_config import DoctorConfig
from palpate.experiments.doctor_devices import arm_findings, failure, hand_findings, sensor_findings
from palpate.experiments.doctor_finding import Finding, Verdict
from palpate.experiments.progress import step_progress
from palpate.experiments.rig_built import RigParts, check_rig, parts_of
from palpate.experiments.robot_values import load_named_robot
from palpate.hw.devices import DeviceError
from palpate.runtime.robot import Robot
from palpate.runtime.robot_rig import RigEntry

STYLES = {Verdict.GOOD: "green", Verdict.NOTE: "yellow", Verdict.BAD: "bold red"}

Tell = Callable[[str], None]


def run_doctor(config: DoctorConfig) -> int:
    """Look at all devices and print what was found.

    Returns:
        0 if nothing has to be fixed, else 1.

    Raises:
        InvalidValueError: There is no such robot, or it has no devices.
    """
    robot = load_named_robot(config.robot)
    if not isinstance(robot.file.backend, RigEntry):
        kind = robot.file.backend.__struct_config__.tag
        raise InvalidValueError(
            f"robot = {config.robot}: backend.kind = {kind} has no devices to connect to; give a robot file of "
            "kind rig, or say `palpate robot check` for this one"
        )
    check_rig(robot)
    console = Console(stderr=config.json)
    parts = parts_of(robot)
    with step_progress(console, _steps(robot, parts)) as tell:
        found = tuple(examined(robot, parts, config.seconds, tell))
    fit = all(finding.verdict is not Verdict.BAD for finding in found)
    if config.json:
        rows = [{name: getattr(finding, name) for name in Finding.__slots__} for finding in found]
        json.dump({"robot": robot.file.name, "fit": fit, "findings": rows}, sys.stdout, indent=1)
        sys.stdout.write("\n")
    else:
        _print(console, robot, found, fit)
    return 0 if fit else 1


def examined(robot: Robot, parts: RigParts, seconds: float, tell: Tell = lambda step: None) -> Iterator[Finding]:
    """Look at this computer, then at one device after the other: each is closed before the next one.

    Args:
        robot: Of kind `rig`.
        parts: Its devices.
        seconds: How long to watch each.
        tell: Told of each step.
    """
    tell(COMPUTER)
    yield from computer_findings(robot.file, seconds)
    for i, finger in enumerate(parts.sensors):
        if not finger.in_arm:
            tell(finger.device.name)
            yield from sensor_findings(robot, i, finger, seconds)
    backend = robot.file.backend
    assert isinstance(backend, RigEntry)  # parts were made of it
    if parts.hand is not None and backend.hand is not None:
        tell(parts.hand.name)
        try:
            parts.hand.start()
            yield from hand_findings(robot, backend.hand, parts.hand, seconds)
        except DeviceError as error:
            yield failure(parts.hand.name, error)
        finally:
            parts.hand.close()
    if parts.arm is not None:
        tell(parts.arm.name)
        try:
            parts.arm.start()
            yield from arm_findings(robot, parts.arm, seconds)
            for i, finger in enumerate(parts.sensors):
                if finger.in_arm:
                    yield from sensor_findings(robot, i, finger, seconds)
        except DeviceError as error:
            yield failure(parts.arm.name, error)
        finally:
            parts.arm.close()


def _steps(robot: Robot, parts: RigParts) -> list[str]:
    names = [finger.device.name for finger in parts.sensors if not finger.in_arm]
    return [COMPUTER, *names, *(device.name for device in (parts.hand, parts.arm) if device is not None)]


def _print(console: Console, robot: Robot, found: tuple[Finding, ...], fit: bool) -> None:
    table = Table(title=Text(robot.file.name), show_edge=False)
    for column in ("device", "what", "value", "unit", "should be", ""):
        table.add_column(column, justify="right" if column == "value" else "left")
    last = ""
    for one in found:
        value = one.value if isinstance(one.value, str) else f"{one.value:.4g}"
        device, last = "" if one.device == last else one.device, one.device
        style = STYLES[one.verdict]
        cells = (device, one.what, value, one.unit, one.wanted)
        table.add_row(*(Text(cell) for cell in cells), Text(one.verdict, style=style))
    console.print(table)
    to_do = [one for one in found if one.fix]
    for one in sorted(to_do, key=lambda each: each.verdict is not Verdict.BAD):
        word = "Fix" if one.verdict is Verdict.BAD else "Note"
        console.print(
            f"{word}: {one.device}, {one.what}: {one.fix}", highlight=False, markup=False, soft_wrap=True
        )
    console.print("Fit to run." if fit else "Not fit to run.", highlight=False)
