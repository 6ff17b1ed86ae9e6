"""Output of a command: text for people, or one JSON document for programs; the exit codes are the same."""

import json
import math
import os
import re
import sys
import traceback
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import fields, is_dataclass, replace
from enum import Enum
from pathlib import Path
from typing import Any, Protocol

import palpate
from palpate.commands import start_up
from palpate.commands.command_result import CommandResult, ExitCode
from palpate.errors import InvalidValueError, PalpateError
from palpate.extras import MissingLibraryError
from palpate.interruption import exit_code
from palpate.plain_text import inert
from palpate.version import __version__

SCHEMA = 1
"""Version of the document's own fields; metrics may change with reports."""

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
        "metrics": result.metrics,
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


Run = Callable[[], CommandResult | int]
"""Carries out a command; a bare exit code stands for a result without metrics."""

PACKAGE = Path(palpate.__file__).parent
"""What is ours: a bug of it shows its traceback."""

KEPT = 200
"""Last writes to standard error that are kept: a parser error takes a few dozen."""


class OutputFormat(Protocol):
    """Carries out a command and prints its result."""

    def carry_out(self, run: Run) -> int:
        """Carry out a command and print its result; returns the exit code."""
        ...


class TextOutput:
    """The command prints its own text; an error is one line on standard error."""

    def carry_out(self, run: Run) -> int:
        """Carry out a command.

        Raises:
            SystemExit: The arguments were refused, or help was requested; either has been printed.
            Exception: An internal error.
        """
        result = _result_of(run)
        _print_error(result.error)
        return int(result.exit_code)


class JsonOutput:
    """One JSON document goes to standard output, all text, of child processes too, to standard error."""

    def __init__(self, command: str) -> None:
        """Take the command as typed, without the program's name."""
        self._command = command

    def carry_out(self, run: Run) -> int:
        """Carry out a command and print the document; an error is a document, too."""
        out, errors = sys.stdout, _KeptErrors(sys.stderr)
        with _descriptor_of_errors(out), redirect_stdout(errors), redirect_stderr(errors):
            result = self._result(run, errors)
        try:
            out.write(document(self._command, result))
            out.flush()
        except BrokenPipeError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), out.fileno())
        return int(result.exit_code)

    def _result(self, run: Run, errors: "_KeptErrors") -> CommandResult:
        try:
            result = _result_of(run)
        except SystemExit as left:  # the parser has refused the arguments and printed why
            return CommandResult(ExitCode.MISTAKE if left.code else ExitCode.DONE, error=unboxed(errors.text))
        except BrokenPipeError:
            raise
        except Exception as error:
            traceback.print_exc()
            return CommandResult(ExitCode.UNFINISHED, error=f"{type(error).__name__}: {error}")
        _print_error(result.error)
        return result


def unboxed(text: str) -> str:
    """Return the parser's error message as one line, without its box and its hint to --help."""
    inside = text.splitlines()
    if len(inside) > 1 and (inside[0].startswith("╭") or not inside[1].strip(" -")):
        inside = inside[1:]  # the box's title
    lines = [re.sub("^[│|]|[│|]$|[╰╯─]|-{3,}", " ", line.strip()).strip() for line in inside]
    kept = [line for line in lines if line and not line.startswith("For full helptext")]
    sentence = " ".join(" ".join(kept).split())
    return re.sub(r"^Error parsing palpate[a-z ]*: ", "", sentence)


def _result_of(run: Run) -> CommandResult:
    """Carry out a command; an exception of palpate's own becomes a result."""
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
        place = _outside(error)
        if place is None:
            raise
        problem = f"{type(error).__name__}: {_line(error)}"
        return CommandResult(
            ExitCode.UNFINISHED,
            error=f"{place} raised {problem}; mend it there (`palpate replay LOG` evaluates a run again)",
        )
    except KeyboardInterrupt as error:
        start_up.conclude()
        # a run that is interrupted says that the robot was stopped, a sweep what it keeps; else none moved
        message = _line(error) or f"{start_up.interrupted_by()}; nothing was finished, and nothing is kept"
        return CommandResult(exit_code(), error=message)
    result = found if isinstance(found, CommandResult) else CommandResult(int(found))
    return replace(result, exit_code=exit_code()) if result.exit_code == ExitCode.INTERRUPTED else result


def _outside(error: Exception) -> str | None:
    """Return where an exception comes from, if that is an experiment's own code; None if it is palpate's."""
    for frame in reversed(traceback.extract_tb(error.__traceback__)):
        if Path(frame.filename).is_relative_to(PACKAGE):
            return None
        if "site-packages" not in frame.filename and frame.filename[0] != "<" and not _is_library(frame.filename):
            return f"{frame.filename}, line {frame.lineno}, in {frame.name},"
    return None


def _is_library(file: str) -> bool:
    return Path(file).is_relative_to(Path(os.__file__).parent)


def _line(error: BaseException) -> str:
    return " ".join(str(error).split())


def _print_error(error: str) -> None:
    if error:
        sys.stderr.write(f"palpate: {inert(error)}\n")


class _KeptErrors:
    """A stream that passes everything on and keeps the last writes."""

    def __init__(self, stream: Any) -> None:
        self._stream = stream
        self._last: deque[str] = deque(maxlen=KEPT)

    @property
    def text(self) -> str:
        return "".join(self._last)

    def write(self, text: str) -> int:
        self._last.append(text)
        return int(self._stream.write(text))

    def flush(self) -> None:
        self._stream.flush()

    def writelines(self, lines: Sequence[str]) -> None:
        for line in lines:
            self.write(line)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


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
