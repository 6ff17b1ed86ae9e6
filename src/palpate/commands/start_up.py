"""Signals from the first import to the last line, and terminals that are closed.

While palpate starts, nothing moves and no file is open: a signal ends the process at once, with one line. Python
itself would print a long traceback, or continue if an extension module catches the exception. After the start, a
signal raises a KeyboardInterrupt, until the last line is printed.
"""

import errno
import io
import os
import signal
import sys
import threading
import time
from contextlib import suppress
from types import FrameType
from typing import Any

from palpate.interruption import SIGNALS, exit_code, note, requested

_SAME_HANG_UP_TIME = 1.0
"""Time within which a second signal belongs to the first [s]: kernel and shell both report a closed terminal."""

_first_at = 0.0


class _CommandKeyboardInterrupt(KeyboardInterrupt):
    """A KeyboardInterrupt of a command, whose exit code the command chooses.

    CPython remembers a plain KeyboardInterrupt that leaves code compiled from text, as that of dataclasses. At its
    end CPython then kills itself by SIGINT, even if the exception was caught (bpo-1054041).
    """


def begin() -> None:
    """Let signals end the process from now on, and survive a closed terminal; foreign handlers stay."""
    if threading.current_thread() is threading.main_thread():
        for number in SIGNALS:
            if signal.getsignal(number) in (signal.SIG_DFL, signal.default_int_handler):
                signal.signal(number, _end)
    for name in ("stdout", "stderr") if os.name == "posix" else ():
        stream = getattr(sys, name)
        if isinstance(stream, io.TextIOWrapper) and stream is getattr(sys, f"__{name}__") and stream.isatty():
            outliving = _outliving(stream)
            setattr(sys, name, outliving)
            setattr(sys, f"__{name}__", outliving)


def over() -> None:
    """Let signals raise a KeyboardInterrupt from now on: the command can stop the robot and keep results."""
    _hand_over(_end, _interrupt)


def conclude() -> None:
    """Record signals from now on without an effect: only a line, or a document, remains to be written."""
    _hand_over(_interrupt, _note)


def leave() -> None:
    """Let signals end the process at once from now on: no work remains."""
    for handler in (_end, _interrupt, _note):
        _hand_over(handler, _leave)


def _hand_over(former: Any, handler: Any) -> None:
    for number in SIGNALS:
        if signal.getsignal(number) is former:
            signal.signal(number, handler)


def _end(number: int, frame: FrameType | None) -> None:
    with suppress(OSError):  # the terminal may be closed
        os.write(2, f"palpate: {interrupted_by(number)}; nothing had begun, and nothing was written\n".encode())
    os._exit(exit_code(number))


def _interrupt(number: int, frame: FrameType | None) -> None:
    global _first_at
    now = time.monotonic()
    if note(number):
        _first_at = now
    elif number != signal.SIGINT and now - _first_at < _SAME_HANG_UP_TIME:
        return
    raise _CommandKeyboardInterrupt


def _note(number: int, frame: FrameType | None) -> None:
    note(number)


def _leave(number: int, frame: FrameType | None) -> None:
    note(number)
    os._exit(exit_code())


def interrupted_by(number: int | None = None) -> str:
    """Return the words for an interruption, by default by the first signal: Ctrl-C needs no name."""
    found = number or requested() or signal.SIGINT
    return "interrupted" if found == signal.SIGINT else f"interrupted by {signal.Signals(found).name}"


class _Terminal(io.FileIO):
    """A terminal for output; once the terminal is closed, output is discarded, and SIGHUP is raised."""

    def write(self, data: Any, /) -> int:
        try:
            return super().write(data) or 0
        except OSError as error:
            if error.errno != errno.EIO:
                raise
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, self.fileno())
        os.close(nowhere)
        if requested() is None:
            os.kill(os.getpid(), signal.SIGHUP)
        return len(data)


def _outliving(stream: io.TextIOWrapper) -> io.TextIOWrapper:
    stream.flush()
    raw = io.BufferedWriter(_Terminal(stream.fileno(), "wb", closefd=False))
    return io.TextIOWrapper(raw, stream.encoding, stream.errors, line_buffering=True)
