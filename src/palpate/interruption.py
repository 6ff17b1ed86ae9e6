"""Requests to stop: Ctrl-C and its kin end a run between two periods, never in the middle of one."""

import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from types import FrameType

SIGNALS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK") if hasattr(signal, name)
)
"""Ctrl-C; kill, and the system going down; the terminal closed; Ctrl-Break."""

_noted: list[signal.Signals] = []


def note(number: int) -> bool:
    """Note that a signal has asked the process to stop; return whether it is the first."""
    _noted.append(signal.Signals(number))
    return len(_noted) == 1


def requested() -> signal.Signals | None:
    """Return the signal that first asked this process to stop; None if there was none."""
    return _noted[0] if _noted else None


def forget() -> None:
    """Begin anew: another command in the same process."""
    _noted.clear()


def exit_code(number: int | None = None) -> int:
    """Return the exit code of a process that a signal stopped, by default the first: 128 + its number."""
    return 128 + int(number or requested() or signal.SIGINT)


@contextmanager
def handling(
    handler: Callable[[int, FrameType | None], object], numbers: Sequence[signal.Signals] = SIGNALS
) -> Iterator[None]:
    """Handle signals for a while; afterwards all is as before.

    Python hands signals to the main thread only: elsewhere nothing is caught. Signals that are ignored stay so
    (as under nohup).
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.getsignal(number) for number in numbers}
    caught = {n: former for n, former in before.items() if former not in (signal.SIG_IGN, None)}
    for number in caught:
        signal.signal(number, handler)
    try:
        yield
    finally:
        for number, former in caught.items():
            signal.signal(number, former)


@contextmanager
def finishing() -> Iterator[None]:
    """Note signals and go on, but at Ctrl-C: whoever sends the others expects the results to be there."""
    with handling(lambda number, frame: note(number), [n for n in SIGNALS if n != signal.SIGINT]):
        yield


class StopRequest:
    """Whether somebody has asked the process to stop.

    Attributes:
        received: The signal; None while there was none.
        closing: Whether the devices are being closed, which nothing interrupts: they stop the robot.
    """

    def __init__(self) -> None:
        """Nobody has asked yet."""
        self.received: signal.Signals | None = None
        self.closing = False

    def receive(self, number: int, frame: FrameType | None) -> None:
        """Take note; at a second Ctrl-C the patience is at an end, as the loop seems to hang.

        Other signals come twice at once (kernel and shell both send SIGHUP when a terminal is closed), and whoever
        sends them ends a process that hangs by SIGKILL.

        Raises:
            KeyboardInterrupt: At the second request, if it is Ctrl-C.
        """
        note(number)
        if self.received is None:
            self.received = signal.Signals(number)
        elif number == signal.SIGINT and not self.closing:
            raise KeyboardInterrupt


@contextmanager
def stop_requests() -> Iterator[StopRequest]:
    """Turn the signals that end a process into a request, which is yielded; afterwards all is as before."""
    request = StopRequest()
    with handling(request.receive):
        yield request
