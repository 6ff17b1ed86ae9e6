"""Threads that run before others, where the system lets them: those that wait for a device, or play one.

Ordinary threads beside a busy computer wait for milliseconds before they run; a reading then is old before anybody
has seen it.
"""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress

MOST_URGENT = -20
"""Niceness of the most urgent of ordinary threads (sched(7))."""

DEVICE_PRIORITY = 40
"""SCHED_FIFO priority of a thread that plays a device: below a control thread's 50 (`real_time.USUAL_PRIORITY`),
which must never wait for it."""


def be_urgent() -> None:
    """Let the calling thread, and those that it starts, run before others; without leave nothing changes."""
    with suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, 0, MOST_URGENT)  # on Linux of the thread, elsewhere of the process


def be_real_time() -> None:
    """Let the calling thread run before all ordinary ones; where that is not allowed, before most of them.

    For a device that is emulated: at its clients' niceness, who wake it and are woken by it thousands of
    times a second, it was given half of the time that it wanted, and its clock fell 15 % behind the wall's.
    """
    be_urgent()
    if sys.platform == "linux":
        with suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(DEVICE_PRIORITY))


@contextmanager
def urgent_threads() -> Iterator[None]:
    """Let threads and processes that are started within be urgent where they may; then all is as before."""
    before = os.getpriority(os.PRIO_PROCESS, 0)
    be_urgent()
    try:
        yield
    finally:
        with suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, 0, before)


def urgency_granted() -> bool:
    """Whether the system lets threads of this process be urgent."""
    with urgent_threads():
        return os.getpriority(os.PRIO_PROCESS, 0) == MOST_URGENT
