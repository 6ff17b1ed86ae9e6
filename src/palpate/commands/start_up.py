"""Ctrl-C while palpate starts: nothing moves yet and no file is open, so it ends at once, in one line.

Python would show where among the imports it was, a screen full of it, or, inside an extension module that catches
what it does not expect, go on.
"""

import os
import signal
import threading
from types import FrameType

INTERRUPTED = 130
"""Exit code after Ctrl-C: 128 + SIGINT, the shell's convention."""


def begin() -> None:
    """End the process at a Ctrl-C from here on; where somebody else listens to it, nothing changes."""
    if (
        threading.current_thread() is threading.main_thread()
        and signal.getsignal(signal.SIGINT) is signal.default_int_handler
    ):
        signal.signal(signal.SIGINT, _end)


def over() -> None:
    """From here on a Ctrl-C is a KeyboardInterrupt again: somebody knows what is to be stopped and kept."""
    if signal.getsignal(signal.SIGINT) is _end:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _end(number: int, frame: FrameType | None) -> None:
    os.write(2, b"palpate: interrupted\n")
    os._exit(INTERRUPTED)
