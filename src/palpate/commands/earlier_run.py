"""What an earlier run has left in the folder that the next one is to write into."""

from collections.abc import Sequence
from pathlib import Path

from mcap.opcode import Opcode
from rich.console import Console

from palpate.commands.said import say
from palpate.errors import InvalidValueError
from palpate.experiments.friction.text import FRICTION_TEXT
from palpate.experiments.grasp.text import GRASP_TEXT
from palpate.experiments.kit.experiment_file import EXPERIMENT_TEXT
from palpate.experiments.regulate.file import REGULATION_TEXT
from palpate.runtime.log import log_in
from palpate.runtime.log.mcap_walk import DamageError, McapWalk, attachment_of

REPORT = "report.html"
"""Every experiment writes one."""

BY_TEXT = {EXPERIMENT_TEXT: "explore", REGULATION_TEXT: "regulate", FRICTION_TEXT: "friction", GRASP_TEXT: "grasp"}
"""Commands, by the text that their logs have, and no others."""

BY_FILE = {
    "sweep.json": "sweep",
    "contacts.csv": "explore",
    "forces.csv": "regulate",
    "friction.yaml": "friction",
    "grasp.csv": "grasp",
}
"""Commands, by what only they write beside a report."""


def earlier_run(folder: Path, command: str, names: Sequence[str]) -> tuple[str, ...]:
    """Say what of an earlier run will be written over.

    Args:
        folder: That is to be written into; need not be there.
        command: Whose run it is to be, as typed after `palpate`.
        names: Of the files that it writes, the report first.

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
    there = [folder / name for name in names if (folder / name).is_file()]
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
    try:
        texts = _texts_in(log_in(folder))
    except (InvalidValueError, DamageError, OSError):  # there is none, or nobody can read it
        texts = frozenset()
    for text, command in BY_TEXT.items():
        if text in texts:
            return command, True
    if (folder / REPORT).is_file():
        for name, command in BY_FILE.items():
            if (folder / name).is_file():
                return command, False
    return None, False


def _texts_in(path: Path) -> frozenset[str]:
    """Names of what is attached to a log, from its beginning alone: all of it may be gigabytes."""
    names = set()
    with path.open("rb") as file:
        for record in McapWalk(file).records():
            if record.opcode == Opcode.CHUNK:
                break
            if record.opcode == Opcode.ATTACHMENT:
                names.add(attachment_of(record).name)
    return frozenset(names)
