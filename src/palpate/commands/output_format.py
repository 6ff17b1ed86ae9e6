"""Output of a command: text, or one JSON document for programs; the exit codes are the same."""

import json
import math
import os
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stdout
from dataclasses import fields, is_dataclass, replace
from enum import Enum
from pathlib import Path
from typing import Any

import palpate
from palpate.commands import start_up
from palpate.commands.command_result import CommandResult, ExitCode
from palpate.errors import InvalidValueError, PalpateError
from palpate.extras import MissingLibraryError
from palpate.interruption import exit_code
from palpate.plain_text import inert
from palpate.version import __version__

Run = Callable[[], CommandResult | int]
"""Carries out a command; a bare exit code stands for a result without metrics."""

_SCHEMA = 1
"""Version of the document's own fields; metrics may change with reports."""

_STATUS: Mapping[int, str] = {ExitCode.DONE: "done", ExitCode.MISTAKE: "wrong_input"}

_PACKAGE = Path(palpate.__file__).parent
_STANDARD_LIBRARY = Path(os.__file__).parent


def run_with_text(run: Run) -> int:
    """Carry out a command, which prints its own text; an error is one line on standard error.

    Returns:
        The exit code.

    Raises:
        SystemExit: If help was requested; it has been printed.
        Exception: If palpate itself is in error.
    """
    return _reported(_result_of(run))


def run_with_json(run: Run, command: str) -> int:
    """Carry out a command and print one JSON document; all text, of child processes too, goes to standard error.

    Args:
        run: Carries out the command; an error becomes a document, too.
        command: Command as typed, without the program's name.

    Returns:
        The exit code.
    """
    out = sys.stdout
    with _descriptor_of_errors(out), redirect_stdout(sys.stderr):
        try:
            result = _result_of(run)
            _reported(result)
        except BrokenPipeError:
            raise
        except Exception as error:
            traceback.print_exc()
            result = CommandResult(ExitCode.UNFINISHED, error=f"{type(error).__name__}: {error}")
    try:
        out.write(document(command, result))
        out.flush()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), out.fileno())
    return int(result.exit_code)


def document(command: str, result: CommandResult) -> str:
    """Return the result of a command as text, with a line feed at its end.

    Args:
        command: Command as typed, without the program's name: "explore", "robot check"; "" if it is unknown.
        result: Result of the command.
    """
    interrupted = result.exit_code > 128
    content: dict[str, object] = {
        "schema": _SCHEMA,
        "command": command,
        "version": __version__,
        "status": "interrupted" if interrupted else _STATUS.get(result.exit_code, "unfinished"),
        "exit_code": int(result.exit_code),
    }
    if result.error:
        content["error"] = result.error
    content |= {
        "outcome": result.outcome,
        "metrics": result.metrics,
        "notes": result.notes,
        **result.facts,
        "files": result.files,
        "warnings": result.warnings,
    }
    return json.dumps(json_value(content), indent=1, allow_nan=False) + "\n"


def json_value(value: object) -> Any:
    """Return a value in JSON's types: null for None and for numbers that are not finite, lists for arrays.

    Raises:
        TypeError: If JSON cannot represent it.
    """
    if value is None or (isinstance(value, bool | str) and not isinstance(value, Enum)):
        return value
    if isinstance(value, Enum):
        return json_value(value.value)
    if isinstance(value, int):
        return int(value)
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, Mapping):
        return {str(key): json_value(item) for key, item in value.items()}
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: json_value(getattr(value, field.name)) for field in fields(value)}
    as_lists = getattr(value, "tolist", None)
    if as_lists is not None:  # numpy's numbers and arrays
        return json_value(as_lists())
    if isinstance(value, Sequence | set | frozenset):
        return [json_value(item) for item in value]
    raise TypeError(f"{type(value).__name__} cannot be JSON")


def _result_of(run: Run) -> CommandResult:
    """Carry out a command; an exception that is no error of palpate becomes a result."""
    try:
        found = run()
    except (InvalidValueError, MissingLibraryError) as error:
        return CommandResult(ExitCode.MISTAKE, error=_line(error))
    except PalpateError as error:
        return CommandResult(ExitCode.UNFINISHED, error=f"{_line(error)}; the robot was stopped")
    except BrokenPipeError:
        # the reader has closed the pipe: print nothing more, at exit neither
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return CommandResult()
    except OSError as error:
        return CommandResult(ExitCode.UNFINISHED, error=_line(error))
    except Exception as error:
        place = _foreign_place(error)
        if place is None:
            raise
        problem = f"{type(error).__name__}: {_line(error)}"
        return CommandResult(
            ExitCode.UNFINISHED,
            error=f"{place} raised {problem}; mend it there (`palpate replay LOG` evaluates a run again)",
        )
    except KeyboardInterrupt as error:
        start_up.conclude()
        # the messages of runs and sweeps name the state and the kept files; without a message nothing has moved
        message = _line(error) or f"{start_up.interrupted_by()}; nothing was finished, and nothing is kept"
        return CommandResult(exit_code(), error=message)
    result = found if isinstance(found, CommandResult) else CommandResult(int(found))
    return replace(result, exit_code=exit_code()) if result.exit_code == ExitCode.INTERRUPTED else result


def _reported(result: CommandResult) -> int:
    """Print the lines, the tables and the error of a result, and return its exit code."""
    if result.shown:
        from rich.console import Console  # only now: --help needs none

        from palpate.runtime.progress import say

        console = Console()
        for each in result.shown:
            if isinstance(each, str):
                say(console, each)
            else:
                console.print(each)
    if result.error:
        sys.stderr.write(f"palpate: {inert(result.error)}\n")
    return int(result.exit_code)


def _foreign_place(error: Exception) -> str | None:
    """Return the line of an experiment's own code that has raised an exception; None if palpate has raised it."""
    for frame in reversed(traceback.extract_tb(error.__traceback__)):
        file = Path(frame.filename)
        if file.is_relative_to(_PACKAGE):
            return None
        library = "site-packages" in frame.filename or file.is_relative_to(_STANDARD_LIBRARY)
        if not library and not frame.filename.startswith("<"):
            return f"{frame.filename}, line {frame.lineno}, in {frame.name},"
    return None


def _line(error: BaseException) -> str:
    return " ".join(str(error).split())


@contextmanager
def _descriptor_of_errors(out: Any) -> Iterator[None]:
    """Redirect file descriptor 1, to which child processes write, to standard error.

    Nothing changes if `out` is not the process's own standard output.
    """
    own: Any = sys.__stdout__
    if out is not own or own.fileno() != 1:
        yield
        return
    out.flush()
    kept = os.dup(1)
    os.dup2(2, 1)
    try:
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)
