"""Requests to stop: Ctrl-C and similar signals end a run between two periods, never in the middle of one."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_SIGNALS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK") if hasattr(signal, name)
)
"""Ctrl-C; kill, and the system going down; the terminal closed; Ctrl-Break."""


class StopRequest:
    """Whether somebody has asked the process to stop.

    Attributes:
        received: The signal; None while there was none.
    """

    def __init__(self) -> None:
        """Nobody has asked yet."""
        self.received: signal.Signals | None = None

    def receive(self, number: int, frame: FrameType | None) -> None:
        """Take note; at a second Ctrl-C the patience is at an end, as the loop seems to hang.

        Other signals come twice at once (kernel and shell both send SIGHUP when a terminal is closed), and whoever
        sends them ends a process that hangs by SIGKILL.

        Raises:
            KeyboardInterrupt: At the second request, if it is Ctrl-C.
        """
        if self.received is not None:
            if number == signal.SIGINT:
                raise KeyboardInterrupt
            return
        self.received = signal.Signals(number)


@contextmanager
def stop_requests() -> Iterator[StopRequest]:
    """Turn the signals that end a process into a request, which is yielded; afterwards all is as before.

    Python hands signals to the main thread only: elsewhere nothing is caught. Signals that are ignored stay so
    (as under nohup).
    """
    request = StopRequest()
    if threading.current_thread() is not threading.main_thread():
        yield request
        return
    before = {number: signal.getsignal(number) for number in _SIGNALS}
    caught = {n: handler for n, handler in before.items() if handler not in (signal.SIG_IGN, None)}
    for number in caught:
        signal.signal(number, request.receive)
    try:
        yield request
    finally:
        for number, handler in caught.items():
            signal.signal(number, handler)
