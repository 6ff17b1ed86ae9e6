"""The JSON document that a command prints for `--json`; strict JSON, without NaN."""

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
"""Version of the document's own fields; figures may change with reports."""

STATUS: Mapping[int, str] = {
    ExitCode.DONE: "done",
    ExitCode.UNFINISHED: "unfinished",
    ExitCode.MISTAKE: "wrong_input",
}


def document(command: str, result: CommandResult) -> str:
    """Return the result of a command as text, with a line feed at its end.

    Args:
        command: As typed, without the program's name: "explore", "robot check"; "" if it was not recognised.
        result: What the command returned.
    """
    content: dict[str, object] = {
        "schema": SCHEMA,
        "command": command,
        "version": __version__,
        "status": "interrupted" if result.exit_code > 128 else STATUS.get(result.exit_code, "unfinished"),
        "exit_code": int(result.exit_code),
    }
    if result.error:
        content["error"] = result.error
    content |= {
        "outcome": result.outcome,
        "figures": result.figures,
        "notes": result.notes,
        **result.facts,
        "files": result.files,
        "warnings": result.warnings,
    }
    return json.dumps(plain(content), indent=1, allow_nan=False) + "\n"


def plain(value: object) -> Any:
    """Return a value in JSON's types: null for None and for numbers that are not finite, lists for arrays.

    Raises:
        TypeError: JSON cannot represent it.
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
