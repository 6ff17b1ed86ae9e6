"""`palpate doctor`: connects to the devices of a robot file and reports what to fix. Moves nothing."""

from collections.abc import Callable, Iterator

from rich.console import Console
from rich.table import Table
from rich.text import Text

from palpate.commands.command_result import CommandResult, ExitCode
from palpate.commands.doctor.arm import arm_findings
from palpate.commands.doctor.computer import COMPUTER, computer_findings
from palpate.commands.doctor.config import DoctorConfig
from palpate.commands.doctor.hand import hand_findings
from palpate.commands.doctor.sensor import sensor_findings
from palpate.commands.doctor.watched import failure
from palpate.commands.progress import step_progress
from palpate.commands.say import say
from palpate.extras import MissingLibraryError
from palpate.hw.devices import DeviceError
from palpate.hw.finding import DeviceFinding, FindingVerdict
from palpate.robots.rig import RigParts, parts_of, rig_entry
from palpate.robots.robot import Robot
from palpate.robots.values import named_devices

STYLES = {FindingVerdict.GOOD: "green", FindingVerdict.NOTE: "yellow", FindingVerdict.BAD: "bold red"}

FIT, UNFIT = "Fit to run.", "Not fit to run."

Announce = Callable[[str], None]


def run_doctor(config: DoctorConfig) -> CommandResult:
    """Examine all devices and print the findings.

    Returns:
        What was found; it is done if nothing has to be fixed.

    Raises:
        InvalidValueError: There is no such robot, or it has no devices.
        DeviceError: Emulators do not come up.
    """
    with named_devices(config.robot) as rig:
        rig.file.backend.check(rig)
        return _examine(config, rig)


def _examine(config: DoctorConfig, robot: Robot) -> CommandResult:
    console = Console()
    parts = parts_of(robot)
    with step_progress(console, _steps(robot, parts)) as announce:
        found = tuple(examined(robot, parts, config.seconds, announce))
    fit = all(finding.verdict is not FindingVerdict.BAD for finding in found)
    _print(console, robot, found, fit)
    return CommandResult(
        ExitCode.DONE if fit else ExitCode.UNFINISHED,
        FIT if fit else UNFIT,
        facts={"robot": robot.file.name, "fit": fit, "findings": found},
    )


def examined(
    robot: Robot, parts: RigParts, seconds: float, announce: Announce = lambda step: None
) -> Iterator[DeviceFinding]:
    """Look at this computer, then at one device after the other: each is closed before the next one.

    Args:
        robot: Of kind `rig`.
        parts: Its devices.
        seconds: How long to watch each.
        announce: Called with the name of each step.
    """
    announce(COMPUTER)
    yield from computer_findings(robot.file, seconds)
    for i, finger in enumerate(parts.sensors):
        if not finger.in_arm:
            announce(finger.device.name)
            yield from sensor_findings(robot, i, finger, seconds)
    hand = rig_entry(robot).hand
    if parts.hand is not None and hand is not None:
        announce(parts.hand.name)
        try:
            parts.hand.start()
            yield from hand_findings(robot, hand.poll, parts.hand, seconds)
        except DeviceError as error:
            yield failure(parts.hand.name, error)
        finally:
            parts.hand.close()
    if parts.arm is not None:
        announce(parts.arm.name)
        try:
            parts.arm.start()
            yield from arm_findings(robot, parts.arm, seconds)
            for i, finger in enumerate(parts.sensors):
                if finger.in_arm:
                    yield from sensor_findings(robot, i, finger, seconds)
        except DeviceError as error:
            yield failure(parts.arm.name, error)
        except MissingLibraryError as error:
            yield DeviceFinding(
                parts.arm.name, "client library", "missing", "", "", FindingVerdict.BAD, str(error)
            )
        finally:
            parts.arm.close()


def _steps(robot: Robot, parts: RigParts) -> list[str]:
    names = [finger.device.name for finger in parts.sensors if not finger.in_arm]
    return [COMPUTER, *names, *(device.name for device in (parts.hand, parts.arm) if device is not None)]


def _print(console: Console, robot: Robot, found: tuple[DeviceFinding, ...], fit: bool) -> None:
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
    for one in sorted(to_do, key=lambda each: each.verdict is not FindingVerdict.BAD):
        word = "Fix" if one.verdict is FindingVerdict.BAD else "Note"
        say(console, f"{word}: {one.device}, {one.what}: {one.fix}")
    say(console, FIT if fit else UNFIT)
