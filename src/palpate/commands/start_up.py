"""Signals from the first import to the last line, and terminals that are closed.

While palpate starts nothing moves yet and no file is open, so it ends at once, in one line. (Python would show
where among the imports it was, a screen full of it, or, inside an extension module that catches what it does not
expect, go on.) From then on a signal is a KeyboardInterrupt, until the last line is out.
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

SAME_HANG_UP = 1.0
"""[s] within which a second signal belongs to the first: kernel and shell both say that a terminal was closed."""

_first_at = 0.0


class _CommandKeyboardInterrupt(KeyboardInterrupt):
    """Of a command, whose exit code is its own.

    CPython notes a plain KeyboardInterrupt that leaves code given as text (dataclasses are made so while modules
    are imported), and at its very end, whoever caught it, kills itself by SIGINT (bpo-1054041).
    """


def begin() -> None:
    """End the process at a signal from here on, and outlive the terminal; where others listen, nothing changes."""
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
    """From here on a signal is a KeyboardInterrupt: somebody knows what is to be stopped and kept."""
    _hand_over(_end, _interrupt)


def conclude() -> None:
    """Note signals, and go on: only a line, or a document, is still to be written."""
    _hand_over(_interrupt, _note)


def leave() -> None:
    """From here on a signal ends the process at once: nothing is left to do but to end it."""
    for handler in (_end, _interrupt, _note):
        _hand_over(handler, _leave)


def _hand_over(former: Any, handler: Any) -> None:
    for number in SIGNALS:
        if signal.getsignal(number) is former:
            signal.signal(number, handler)


def _end(number: int, frame: FrameType | None) -> None:
    with suppress(OSError):  # nobody may be there to read it
        os.write(2, f"palpate: {interrupted_by(number)}; nothing had begun, and nothing was written\n".encode())
    os._exit(exit_code(number))


def _interrupt(number: int, frame: FrameType | None) -> None:
    global _first_at
    now = time.monotonic()
    if note(number):
        _first_at = now
    elif number != signal.SIGINT and now - _first_at < SAME_HANG_UP:
        return
    raise _CommandKeyboardInterrupt


def _note(number: int, frame: FrameType | None) -> None:
    note(number)


def _leave(number: int, frame: FrameType | None) -> None:
    note(number)
    os._exit(exit_code())


def interrupted_by(number: int | None = None) -> str:
    """Return what happened, by default at the first signal: Ctrl-C needs no name."""
    found = number or requested() or signal.SIGINT
    return "interrupted" if found == signal.SIGINT else f"interrupted by {signal.Signals(found).name}"


class _Terminal(io.FileIO):
    """A terminal to write to; once it is closed, output goes nowhere, and that is as if SIGHUP had come."""

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
