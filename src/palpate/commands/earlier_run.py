"""What an earlier run has left in the folder that the next one is to write into."""

from collections.abc import Sequence
from pathlib import Path

from mcap.opcode import Opcode
from rich.console import Console

from palpate.bounded_file import open_regular
from palpate.commands.say import say
from palpate.errors import InvalidValueError
from palpate.experiments.kit.config_file import EXPERIMENT_TEXT, experiment_in
from palpate.experiments.kit.recording import REPORT
from palpate.experiments.kit.registry import experiment_named
from palpate.runtime.log import log_in
from palpate.runtime.log.mcap_walk import DamageError, McapWalk, attachment_of

SWEEP = "sweep.json"
"""What only a sweep writes."""


def earlier_run(folder: Path, command: str, names: Sequence[str]) -> tuple[str, ...]:
    """Say what of an earlier run will be written over.

    Args:
        folder: That is to be written into; need not be there.
        command: Whose run it is to be, as typed after `palpate`.
        names: Of the files that it writes besides report and log.

    Returns:
        A sentence, or none if nothing will be.

    Raises:
        InvalidValueError: What is there is of another command: half of it would stay beside what is new.
    """
    before, log = _command_in(folder)
    if before is not None and before != command:
        raise InvalidValueError(
            f"out = {folder}: holds a run of `palpate {before}`, of which a part would be written over; choose "
            "another folder (--out)"
        )
    there = [folder / name for name in (REPORT, *names) if (folder / name).is_file()]
    if not there:
        return ()
    more = len(there) - 1
    others = f" and {more} more file{'s' if more > 1 else ''}" if more else ""
    of = "" if before is None else " of an earlier run"
    stays = "; its log stays" if log else ""
    return (f"{there[0]}{others}{of} {'are' if more else 'is'} written over{stays}.",)


def earlier_told(console: Console, folder: Path, command: str, names: Sequence[str]) -> tuple[str, ...]:
    """Print what `earlier_run` says, as a note, and return it."""
    said = earlier_run(folder, command, names)
    for text in said:
        say(console, f"Note: {text}")
    return said


def _command_in(folder: Path) -> tuple[str | None, bool]:
    """Which command has written into a folder, as far as that is to be seen, and whether a log of it is there."""
    if not folder.is_dir():
        return None, False
    if (folder / SWEEP).is_file():
        return "sweep", False
    try:
        return _experiment_of(log_in(folder)), True
    except (InvalidValueError, DamageError, OSError):  # there is none, or nobody can read it
        return None, False


def _experiment_of(path: Path) -> str | None:
    """The experiment of a log, from its beginning alone: all of it may be gigabytes."""
    with open_regular(path) as file:
        for record in McapWalk(file).records():
            if record.opcode == Opcode.CHUNK:
                break
            if record.opcode == Opcode.ATTACHMENT:
                found = attachment_of(record)
                if found.name == EXPERIMENT_TEXT:
                    return experiment_named(experiment_in(found.data.decode())).name
    return None
