"""How a command says what it has to say: in words for people, or as one JSON document for programs.

Exit codes are the same either way, and this is the one place that gives them.
"""

import os
import re
import sys
import traceback
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from typing import Any, Protocol

from palpate.commands.command_result import CommandResult, ExitCode
from palpate.commands.json_document import document
from palpate.errors import InvalidValueError, PalpateError
from palpate.extras import MissingLibraryError
from palpate.plain_text import inert

Run = Callable[[], CommandResult | int]
"""Carries out a command. What returns no more than an exit code has no figures."""

KEPT = 200
"""Pieces of what went to standard error last: a refusal of what was typed is a few dozen."""


class OutputFormat(Protocol):
    """How a command is carried out and heard."""

    def carry_out(self, run: Run) -> int:
        """Carry out a command and say what is to be said; returns the exit code."""
        ...


class TextOutput:
    """A command says everything itself; of an error, one line goes to standard error."""

    def carry_out(self, run: Run) -> int:
        """Carry out a command.

        Raises:
            SystemExit: What was typed was refused, or help was asked for: both have been printed.
            Exception: What nobody foresaw.
        """
        answer = _answered(run)
        _say(answer.error)
        return int(answer.exit_code)


class JsonOutput:
    """One document goes to standard output, all words to standard error: those of other processes, too."""

    def __init__(self, command: str) -> None:
        """Take the command as typed, without the program's name."""
        self._command = command

    def carry_out(self, run: Run) -> int:
        """Carry out a command and print the document; mistakes and errors are documents, too."""
        out, heard = sys.stdout, _Heard(sys.stderr)
        with _descriptor_of_errors(out), redirect_stdout(heard), redirect_stderr(heard):
            answer = self._answer(run, heard)
        try:
            out.write(document(self._command, answer))
            out.flush()
        except BrokenPipeError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), out.fileno())
        return int(answer.exit_code)

    def _answer(self, run: Run, heard: "_Heard") -> CommandResult:
        try:
            answer = _answered(run)
        except SystemExit as left:  # the parser has refused what was typed, and has said so
            return CommandResult(ExitCode.MISTAKE if left.code else ExitCode.DONE, error=unboxed(heard.text))
        except BrokenPipeError:
            raise
        except Exception as error:
            traceback.print_exc()
            return CommandResult(ExitCode.UNFINISHED, error=f"{type(error).__name__}: {error}")
        _say(answer.error)
        return answer


def unboxed(text: str) -> str:
    """Return what the parser says of a mistake as one line, without its box and its hint to --help."""
    inside = text.splitlines()
    if len(inside) > 1 and (inside[0].startswith("╭") or not inside[1].strip(" -")):
        inside = inside[1:]  # the box's title
    lines = [re.sub("^[│|]|[│|]$|[╰╯─]|-{3,}", " ", line.strip()).strip() for line in inside]
    kept = [line for line in lines if line and not line.startswith("For full helptext")]
    said = " ".join(" ".join(kept).split())
    return re.sub(r"^Error parsing palpate[a-z ]*: ", "", said)


def _answered(run: Run) -> CommandResult:
    """Carry out a command; what it raises on purpose becomes an answer."""
    try:
        found = run()
    except (InvalidValueError, MissingLibraryError) as error:
        return CommandResult(ExitCode.MISTAKE, error=_line(error))
    except PalpateError as error:
        return CommandResult(ExitCode.UNFINISHED, error=f"{_line(error)}; the robot was stopped")
    except BrokenPipeError:
        # whoever read the output has had enough; nothing more to say, at exit neither
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return CommandResult()
    except OSError as error:
        return CommandResult(ExitCode.UNFINISHED, error=_line(error))
    except KeyboardInterrupt as error:
        # a run that is interrupted says that the robot was stopped; without a run, none moved
        return CommandResult(ExitCode.INTERRUPTED, error=_line(error) or "interrupted")
    return found if isinstance(found, CommandResult) else CommandResult(int(found))


def _line(error: BaseException) -> str:
    return " ".join(str(error).split())


def _say(error: str) -> None:
    if error:
        sys.stderr.write(f"palpate: {inert(error)}\n")


class _Heard:
    """A stream that passes everything on, and keeps the last of it."""

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
    """Let what writes to descriptor 1 itself, as other processes do, write to standard error meanwhile.

    Where `out` is another stream than the process's own, somebody listens to it already, and nothing changes.
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
