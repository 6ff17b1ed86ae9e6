"""Real time: absolute deadlines on the monotonic clock, and the urgency that a control thread needs.

Measured at 1 kHz (`benchmarks/costs` does it again): what delays a wake-up most is the 50 us of timer
slack that Linux gives every ordinary thread, then other work on the same core.
"""

import contextlib
import ctypes
import math
import os
import sys
import threading
from collections.abc import Callable
from contextlib import ExitStack
from enum import StrEnum
from time import monotonic, sleep

from palpate.errors import InvalidValueError, OverrunError, not_negative, positive
from palpate.runtime.pacing import Punctuality
from palpate.runtime.times import Times
from palpate.runtime.urgency import MOST_URGENT

USUAL_PRIORITY = 50
"""SCHED_FIFO priority to ask for, of 1..99 (sched(7)): that of the kernel's threaded interrupt handlers, so that
the loop does not delay the devices that it waits for."""

MOST_BEHIND = 10
"""Periods that `Overrun.CATCH_UP` lags behind at most: 10 ms at 1 kHz, caught up within a millisecond or so.
Longer stalls are the machine's, and a robot should not get tens of stale commands at once."""

_SET_TIMER_SLACK, _GET_TIMER_SLACK = 29, 30
"""PR_SET_TIMERSLACK and PR_GET_TIMERSLACK of prctl(2), from linux/prctl.h."""


class Overrun(StrEnum):
    """What to do when a deadline has passed before the period's work was done. Each one is counted."""

    SKIP = "skip"
    """Leave out the deadlines that have passed and wait for the next one: the robot keeps its last command a
    little longer, and samples stay on the grid. The safe choice, and the default."""

    CATCH_UP = "catch up"
    """Go on at once, one period after the other, until the deadlines are met again; more than `MOST_BEHIND`
    periods behind, skip. For controllers that count periods."""

    STOP = "stop"
    """Raise `OverrunError` the first time. After that skip: what brings the robot to rest needs its periods."""


class RealTime:
    """Wakes the calling thread at start + k * period, k = 1, 2, ...; no error accumulates."""

    def __init__(
        self,
        period: float,
        overrun: Overrun = Overrun.SKIP,
        *,
        spin: float = 0.0,
        priority: int | None = None,
    ) -> None:
        """Set the pace; nothing is asked of the system before `start`.

        Args:
            period: Between deadlines [s].
            overrun: What to do when one is missed.
            spin: How long before a deadline to stop sleeping and watch the clock [s]: 2e-4 wakes within a
                microsecond most of the time, and keeps a fifth of a core busy at 1 kHz.
            priority: Run the thread as SCHED_FIFO with this priority, `USUAL_PRIORITY` for example; where the
                system refuses, with the highest ordinary priority it grants. None: as it is.

        Raises:
            InvalidValueError: A value that cannot be.
        """
        self._period = positive("period", period, "s")
        try:
            self._overrun = Overrun(overrun)
        except ValueError:
            known = ", ".join(Overrun)
            raise InvalidValueError(f"overrun = {overrun!r}: must be one of {known}") from None
        self._spin = not_negative("spin", spin, "s")
        if self._spin >= self._period:
            raise InvalidValueError(f"spin = {spin:g} s: must be shorter than the period of {period:g} s")
        if priority is not None and not 1 <= priority <= 99:
            raise InvalidValueError(f"priority = {priority!r}: must be a whole number from 1 to 99, or None")
        self._priority = priority
        self._urgency = _Urgency()
        self._start = -math.inf  # before any deadline: a wait without a start is found where it costs nothing
        self._index = 0
        self._late, self._lateness = Times(), 0.0
        self._overruns = 0
        self._stopped_once = False

    @property
    def period(self) -> float:
        """Between deadlines [s]."""
        return self._period

    @property
    def lateness(self) -> float:
        """From the last deadline to the wake-up after it [s]; 0 before the first."""
        return self._lateness

    def start(self) -> None:
        """Make the calling thread urgent and begin the first period now; an earlier run is forgotten.

        Start other threads before this: those started after it are ordinary ones all the same, but on Linux only.
        """
        self._urgency.give_back()
        self._late, self._lateness = Times(), 0.0
        self._overruns, self._index, self._stopped_once = 0, 0, False
        self._urgency.take(self._priority)
        self._start = monotonic()

    def wait(self) -> None:
        """Return at the next deadline; at once or at a later one if it has passed (see `Overrun`).

        Raises:
            OverrunError: It has passed, and the policy is to stop.
            InvalidValueError: Not started.
        """
        self._index += 1
        deadline = self._start + self._index * self._period
        now = monotonic()
        if now > deadline:
            deadline = self._missed(deadline, now)
        pause = deadline - self._spin - now
        if pause > 0.0:
            sleep(pause)  # CPython >= 3.11 on Linux: clock_nanosleep to an absolute time, as good as our own
        now = monotonic()
        while now < deadline:
            now = monotonic()
        self._lateness = now - deadline
        self._late.append(self._lateness)

    def stop(self) -> Punctuality:
        """Give the thread its old urgency back; return how deadlines were kept. May be called more than once."""
        self._urgency.give_back()
        self._start = -math.inf
        return Punctuality(self._late, self._overruns, self._urgency.note)

    def _missed(self, deadline: float, now: float) -> float:
        """The deadline to wait for instead; or an `OverrunError`."""
        if self._start == -math.inf:
            raise InvalidValueError("wait() without start(): call start() first")
        behind = now - deadline
        if self._overrun is Overrun.CATCH_UP and behind <= MOST_BEHIND * self._period:
            self._overruns += 1
            return deadline
        passed = math.ceil(behind / self._period)  # a deadline that is right now has not passed
        self._overruns += passed
        if self._overrun is Overrun.STOP and not self._stopped_once:
            self._stopped_once = True
            self._index += passed - 1
            self._lateness = behind
            self._late.append(behind)
            raise OverrunError(
                f"the period's work was done {1e3 * behind:.3g} ms after its deadline; the limit is the period of "
                f"{1e3 * self._period:g} ms: take a longer period, a faster controller or real-time priority, or "
                f"tolerate it ({Overrun.__name__}.{Overrun.SKIP.name})"
            )
        self._index += passed
        return self._start + self._index * self._period


class _Urgency:
    """Scheduling of one thread: taken, and given back as it was."""

    def __init__(self) -> None:
        self._undo = ExitStack()
        self.note = ""

    def take(self, priority: int | None) -> None:
        """Make the calling thread wake up precisely, and before others if a priority is asked for."""
        self.note = ""
        try:
            self.note = "; ".join(filter(None, (self._take_slack(), self._take_priority(priority))))
        except BaseException:
            self.give_back()
            raise

    def give_back(self) -> None:
        """Put everything back; of no effect when nothing is taken."""
        self._undo.close()

    def _later(self, undo: Callable[[], object]) -> None:
        """Have it undone at the end. Said before it is done: an interruption in between must not lose it."""

        def undo_quietly() -> None:
            with contextlib.suppress(OSError):  # the thread is gone, or the system does not let go
                undo()

        self._undo.callback(undo_quietly)

    def _take_slack(self) -> str:
        """Wake up at the time asked for, not up to 50 us later with other timers."""
        if sys.platform != "linux":
            return ""
        prctl = ctypes.CDLL(None).prctl
        before, thread = prctl(_GET_TIMER_SLACK, 0, 0, 0, 0), threading.get_native_id()
        if before < 0:  # a sandbox
            return "the system does not let wake-ups be more precise than 50 us: going on without"

        def undo() -> None:
            if threading.get_native_id() == thread:  # prctl knows only its caller
                prctl(_SET_TIMER_SLACK, ctypes.c_ulong(before), 0, 0, 0)

        self._later(undo)
        prctl(_SET_TIMER_SLACK, ctypes.c_ulong(1), 0, 0, 0)
        return ""

    def _take_priority(self, priority: int | None) -> str:
        if priority is None:
            return ""
        if sys.platform != "linux":
            return f"real-time priority is not supported on {sys.platform}: going on without"
        thread = threading.get_native_id()
        policy, parameter = os.sched_getscheduler(thread), os.sched_getparam(thread)
        nice = os.getpriority(os.PRIO_PROCESS, thread)  # of the thread, on Linux
        # threads and processes started from this one shall be ordinary: a log writer at FIFO would be a rival
        reset = os.SCHED_RESET_ON_FORK

        def undo() -> None:
            try:
                os.sched_setscheduler(thread, policy, parameter)
            except PermissionError:  # who may not raise priorities may not take this flag off: it does no harm
                os.sched_setscheduler(thread, policy | reset, parameter)

        self._later(undo)
        try:
            os.sched_setscheduler(thread, os.SCHED_FIFO | reset, os.sched_param(priority))
        except OSError as error:
            refused = _refusal(priority, error)
        else:
            return f"real-time priority {priority} (SCHED_FIFO)"
        self._later(lambda: os.setpriority(os.PRIO_PROCESS, thread, nice))
        try:
            os.setpriority(os.PRIO_PROCESS, thread, MOST_URGENT)
            os.sched_setscheduler(thread, policy | reset, parameter)
        except OSError:
            return f"{refused}; going on without"
        return f"{refused}; going on with nice {MOST_URGENT} instead"


def _refusal(priority: int, error: OSError) -> str:
    """Why there is no real-time priority, and how to get it."""
    if sys.platform != "linux":
        return ""
    import resource

    allowed = resource.getrlimit(resource.RLIMIT_RTPRIO)[0]
    if isinstance(error, PermissionError) and 0 <= allowed < priority:
        least = f", or ask for at most {allowed}" if allowed else ""
        return (
            f"no permission for real-time priority {priority} (RLIMIT_RTPRIO {allowed}): add "
            f"`@realtime - rtprio 90` to /etc/security/limits.d/realtime.conf and join that group, or run with "
            f"CAP_SYS_NICE{least}"
        )
    return f"no real-time priority {priority} ({error.strerror}): see sched(7) and the container's limits"
