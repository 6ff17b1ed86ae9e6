"""What `--dry-run` says of any experiment: all has been planned and checked, nothing moved or written."""

from collections.abc import Iterable, Sequence
from pathlib import Path

from rich.console import Console

from palpate.commands.answer import Answer, ExitCode, shown_figures
from palpate.commands.earlier_run import earlier_run
from palpate.commands.output_folder import check_folder
from palpate.commands.said import say
from palpate.reporting.data import KeyFigure
from palpate.reporting.terminal import key_figures
from palpate.robots.drivers import can_drive
from palpate.runtime import Limits
from palpate.runtime.robot import Robot
from palpate.runtime.robot_rig import RigEntry

LOG = "<date>_<time>.mcap"
"""How the log will be called, beside `latest.mcap`, a link to it."""

MILLI = 1e3


def foretell(
    command: str,
    task: str,
    out: Path,
    names: Sequence[str],
    figures: Iterable[KeyFigure],
    *,
    robot: str,
    warnings: tuple[str, ...] = (),
) -> Answer:
    """Say what would be done, after it has been planned.

    Args:
        command: That would do it, as typed after `palpate`.
        task: What it is, for the title.
        out: Folder that was asked for.
        names: Of the files that go there besides the log.
        figures: What is known beforehand.
        robot: Who would do it.
        warnings: What people should know before, a sentence each.

    Raises:
        InvalidValueError: The folder could not be written, or holds a run of another command.
    """
    check_folder(out)
    warnings = (*warnings, *earlier_run(out, command, names))
    figures = tuple(figures)
    files = tuple(out / name for name in (*names, LOG))
    outcome = "Everything is in order: nothing was moved, nothing was written."
    console = Console()
    console.print(key_figures(f"{task} (dry run)", outcome, (KeyFigure("robot", "", "", robot), *figures)))
    for warning in warnings:
        say(console, f"Note: {warning}")
    would = ", ".join(str(file) for file in files)
    say(console, f"Would be written: {would}")
    values, notes = shown_figures(figures)
    facts = {"dry_run": True, "task": task, "robot": robot}
    return Answer(ExitCode.DONE, outcome, values, notes, facts, files, warnings)


def robot_words(name: str, robot: Robot) -> str:
    """Return which robot it would be, and that nothing was connected to."""
    kind = robot.file.backend.__struct_config__.tag
    real = "; its devices were not connected to" if isinstance(robot.file.backend, RigEntry) else ""
    here = "" if can_drive(robot) else "; not to be run on this computer, which lacks ur_rtde"
    return f"{name} ({kind}){real}{here}"


def limit_figures(limits: Limits) -> tuple[KeyFigure, ...]:
    """Return at which forces and speeds the supervisor would stop it."""
    return (
        KeyFigure("force limit", limits.force, "N", "of the supervisor, which then draws back"),
        KeyFigure("speed limit", MILLI * limits.speed, "mm/s", "of the supervisor, which then stops it"),
    )
