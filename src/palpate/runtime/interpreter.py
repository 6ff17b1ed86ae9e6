"""What the Python interpreter does of its own accord, kept from delaying the loop.

Measured with numpy, scipy, numba, MuJoCo and CasADi loaded, which is 110 000 tracked objects, on two shared cores
(`benchmarks/costs` measures it again):

- A full garbage collection takes 65 to 150 ms. The loop makes no cyclic garbage and so starts none, but
  controllers and observers of others may. With the collector off, each of their cycles would stay: 1 KB a period
  is 3.6 GB an hour. So young collections stay on, small and often: 20 to 70 us each, 70 to 220 us where they
  include the middle generation (with Python's own thresholds 70 to 200 us and 0.2 to 5 ms). Full ones wait until
  the run is over. Of cycles that live for 50 periods, one in twenty then waits with them.
- A thread that computes in Python, woken up for 20 ms eight times a second, makes the loop's 99th percentile of
  lateness 5.2 ms with Python's switch interval of 5 ms, 1.2 to 1.9 ms with 1 ms, 0.2 to 0.6 ms with 50 us. Shorter
  ones gain nothing, and at 10 us there were stalls of 50 ms, as the threads did little but hand over.
"""

import gc
import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

SWITCH_INTERVAL = 5e-5
"""How long another thread may go on once the loop is ready to run [s]; Python's own is 5e-3. Where from: above."""

SIMULATED_INTERVAL = 5e-4
"""The same where nothing waits for a deadline [s]: a simulation that records takes two thirds of the time that it
takes with the other, by which it hands over to the log's writer at every call that lets go of Python's lock."""

_ROUNDING = 5e-7
"""Python cuts the interval off to whole microseconds: without half of one more [s], what it says is not what it
was set, and every run would take one off."""

_SMALL, _MIDDLE, _NEVER = 200, 5, 2**31 - 1
"""Young objects before a collection; collections before one of the middle generation; of these before a full one
(the largest C int). Where from: above."""


IMMORTAL = 1000
"""As many objects may be frozen although nobody froze any: Python 3.12 puts some 400 there that never die. A
program that freezes what it has loaded has thousands."""


class _Interpreter:
    """The one interpreter: kept from delaying the loop from the first run's start to the last one's end.

    Runs need not be nested: robots of several environments, or loops in several threads, overlap as they like. If
    each put back what it had found, the last to end would put back what the first had set.
    """

    def __init__(self) -> None:
        # entered again by the end of a run that a collection finds abandoned within the lock
        self._lock = threading.RLock()
        self._runs = 0
        self._put_back = ExitStack()

    def enter(self, interval: float) -> None:
        with self._lock:
            self._runs += 1
            if self._runs == 1:
                self._keep_out()
            sys.setswitchinterval(min(sys.getswitchinterval(), interval) + _ROUNDING)

    def leave(self) -> None:
        with self._lock:
            self._runs -= 1
            if self._runs == 0:
                self._put_back.close()

    def _keep_out(self) -> None:
        interval = sys.getswitchinterval()
        self._put_back.callback(sys.setswitchinterval, interval + _ROUNDING)
        young, middle, full = gc.get_threshold()  # young: 0 means off, and stays so
        self._put_back.callback(gc.set_threshold, young, middle, full)
        gc.set_threshold(min(young, _SMALL), min(middle, _MIDDLE), _NEVER)
        if gc.get_freeze_count() <= IMMORTAL:  # unfreezing knows no levels: it belongs to who froze first
            self._put_back.callback(gc.unfreeze)
            gc.freeze()


_interpreter = _Interpreter()


@contextmanager
def undisturbed(interval: float = SWITCH_INTERVAL) -> Iterator[None]:
    """Have no full garbage collections, and get Python back quickly from other threads.

    Once the last of those who asked for it has ended, all is as it was before the first. Takes microseconds, may
    be nested or overlap, and leaves a collector that is off alone. All that exists at the start is frozen, so that
    not even a collection that somebody asks for has to look at it.

    Args:
        interval: How long another thread may go on once the loop is ready to run [s]; the least of all who ask
            counts.
    """
    _interpreter.enter(interval)
    try:
        yield
    finally:
        _interpreter.leave()
