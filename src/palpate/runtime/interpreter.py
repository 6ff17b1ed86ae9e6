"""What the Python interpreter does of its own accord, kept out of the loop's way.

Measured with numpy, scipy, numba, MuJoCo and CasADi loaded, which is 110 000 tracked objects, on two shared cores
(`benchmarks/loop.py` measures it again):

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
from collections.abc import Iterator
from contextlib import contextmanager

SWITCH_INTERVAL = 5e-5
"""How long another thread may go on once the loop is ready to run [s]; Python's own is 5e-3. Where from: above."""

_ROUNDING = 5e-7
"""Python cuts the interval off to whole microseconds: without half of one more [s], what it says is not what it
was told, and every run would take one off."""

_SMALL, _MIDDLE, _NEVER = 200, 5, 2**31 - 1
"""Young objects before a collection; collections before one of the middle generation; of these before a full one
(the largest C int). Where from: above."""


@contextmanager
def undisturbed() -> Iterator[None]:
    """Have no full garbage collections, and get Python back quickly from other threads.

    Afterwards all is as before. Takes microseconds, may be nested, and leaves a collector that is off alone. All
    that exists at the start is frozen, so that not even a collection that somebody asks for has to look at it.
    """
    young, middle, full = gc.get_threshold()
    interval = sys.getswitchinterval()
    small = min(young, _SMALL)  # 0 means off, and stays so
    frozen_by_us = gc.get_freeze_count() == 0  # unfreezing knows no levels: it belongs to who froze first
    try:
        gc.set_threshold(small, min(middle, _MIDDLE), _NEVER)
        if frozen_by_us:
            gc.freeze()
        sys.setswitchinterval(min(interval, SWITCH_INTERVAL) + _ROUNDING)
        yield
    finally:
        sys.setswitchinterval(interval + _ROUNDING)
        if frozen_by_us:
            gc.unfreeze()
        gc.set_threshold(young, middle, full)
