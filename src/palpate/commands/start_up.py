"""Ctrl-C while palpate starts: nothing moves yet and no file is open, so the process ends at once, with one line.

Otherwise Python would print a traceback of its imports, or continue where an extension module catches the
exception.
"""

import os
import signal
import threading
from types import FrameType

INTERRUPTED = 130
"""Exit code after Ctrl-C: 128 + SIGINT, the shell's convention."""


def begin() -> None:
    """End the process at Ctrl-C from now on, unless another handler is installed."""
    if (
        threading.current_thread() is threading.main_thread()
        and signal.getsignal(signal.SIGINT) is signal.default_int_handler
    ):
        signal.signal(signal.SIGINT, _end)


def over() -> None:
    """From now on Ctrl-C raises KeyboardInterrupt again, which the command handles."""
    if signal.getsignal(signal.SIGINT) is _end:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _end(number: int, frame: FrameType | None) -> None:
    os.write(2, b"palpate: interrupted\n")
    os._exit(INTERRUPTED)
