"""The one JSON document that a command prints for `--json`: strict, so that any reader takes it."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from enum import Enum
from pathlib import Path
from typing import Any

from palpate.commands.command_result import CommandResult, ExitCode
from palpate.version import __version__

SCHEMA = 1
"""Raised when a field of the document itself goes or gets another meaning; figures come and go with reports."""

STATUS: Mapping[int, str] = {
    ExitCode.DONE: "done",
    ExitCode.UNFINISHED: "unfinished",
    ExitCode.MISTAKE: "wrong_input",
}


def document(command: str, answer: CommandResult) -> str:
    """Return an answer as text, one line end at its end.

    Args:
        command: As typed, without the program's name: "explore", "robot check"; "" if none was recognised.
        answer: Of the command.
    """
    told: dict[str, object] = {
        "schema": SCHEMA,
        "command": command,
        "version": __version__,
        "status": "interrupted" if answer.exit_code > 128 else STATUS.get(answer.exit_code, "unfinished"),
        "exit_code": int(answer.exit_code),
    }
    if answer.error:
        told["error"] = answer.error
    told |= {
        "outcome": answer.outcome,
        "figures": answer.figures,
        "notes": answer.notes,
        **answer.facts,
        "files": answer.files,
        "warnings": answer.warnings,
    }
    return json.dumps(plain(told), indent=1, allow_nan=False) + "\n"


def plain(value: object) -> Any:
    """Return a value as JSON holds it: null for a number that is none or not finite, lists for arrays.

    Raises:
        TypeError: There is no such thing in JSON.
    """
    if value is None or (isinstance(value, bool | str) and not isinstance(value, Enum)):
        return value
    if isinstance(value, Enum):
        return plain(value.value)
    if isinstance(value, int):
        return int(value)
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    as_lists = getattr(value, "tolist", None)
    if as_lists is not None:  # numpy's numbers and arrays
        return plain(as_lists())
    if isinstance(value, Sequence | set | frozenset):
        return [plain(item) for item in value]
    raise TypeError(f"{type(value).__name__} cannot be JSON")
