"""Files of an earlier run in the folder that a run is about to write to."""

from collections.abc import Sequence
from pathlib import Path

from mcap.opcode import Opcode
from rich.console import Console

from palpate.bounded_file import open_regular
from palpate.errors import InvalidValueError
from palpate.experiments.kit.config_file import EXPERIMENT_TEXT, experiment_in
from palpate.experiments.kit.recording import REPORT
from palpate.experiments.kit.registry import experiment_named
from palpate.runtime.log import log_in
from palpate.runtime.log.mcap_walk import DamageError, McapWalk, attachment_of
from palpate.runtime.progress import say

SWEEP = "sweep.json"
"""File that marks the folder of a sweep."""


def earlier_run(folder: Path, command: str, names: Sequence[str]) -> tuple[str, ...]:
    """Return which files of an earlier run will be overwritten.

    Args:
        folder: Output folder; need not exist.
        command: Command of the new run, as typed after `palpate`.
        names: Files that the new run writes besides report and log.

    Returns:
        One sentence, or none if nothing is overwritten.

    Raises:
        InvalidValueError: The folder holds a run of another command, of which a part would remain.
    """
    before, log = _command_in(folder)
    if before is not None and before != command:
        raise InvalidValueError(
            f"out = {folder}: holds a run of `palpate {before}`, which would be partly overwritten; choose "
            "another folder (--out)"
        )
    there = [folder / name for name in (REPORT, *names) if (folder / name).is_file()]
    if not there:
        return ()
    more = len(there) - 1
    others = f" and {more} more file{'s' if more > 1 else ''}" if more else ""
    of = "" if before is None else " of an earlier run"
    stays = "; its log stays" if log else ""
    return (f"{there[0]}{others}{of} {'are' if more else 'is'} overwritten{stays}.",)


def print_earlier_run(console: Console, folder: Path, command: str, names: Sequence[str]) -> tuple[str, ...]:
    """Print the note of `earlier_run`, and return it."""
    notes = earlier_run(folder, command, names)
    for text in notes:
        say(console, f"Note: {text}")
    return notes


def _command_in(folder: Path) -> tuple[str | None, bool]:
    """Return which command wrote to a folder, None if unknown, and whether its log is there."""
    if not folder.is_dir():
        return None, False
    if (folder / SWEEP).is_file():
        return "sweep", False
    try:
        return _experiment_of(log_in(folder)), True
    except (InvalidValueError, DamageError, OSError):  # no log, or an unreadable one
        return None, False


def _experiment_of(path: Path) -> str | None:
    """Return the experiment of a log from its beginning alone: the whole file may be gigabytes."""
    with open_regular(path) as file:
        for record in McapWalk(file).records():
            if record.opcode == Opcode.CHUNK:
                break
            if record.opcode == Opcode.ATTACHMENT:
                found = attachment_of(record)
                if found.name == EXPERIMENT_TEXT:
                    return experiment_named(experiment_in(found.data.decode())).name
    return None
