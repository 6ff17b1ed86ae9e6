"""numba's `njit`, and what is said where compiling takes a while.

Compiled kernels are kept on disk (`cache=True`), so that only the first run after an install waits. It is told on
the logger `palpate`, which writes to standard error unless a program says otherwise.
"""

import logging
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from time import monotonic
from typing import Any

from numba import njit as njit
from numba.core import event as events

FIRST = 2.0
"""[s] of compiling after which somebody who waits is told what for."""

NEXT = 10.0
"""[s] of compiling from one such line to the next, where one kernel follows another."""

_log = logging.getLogger("palpate")


@contextmanager
def compiling(what: str, *, kept: bool = True, told_after: float = FIRST) -> Iterator[None]:
    """Say what is being compiled, if the block is not done within a time.

    Args:
        what: Is compiled.
        kept: Whether the next process finds it compiled.
        told_after: [s].
    """
    then = " (once: it is kept; `palpate warm-up` compiles everything)" if kept else ""
    timer = threading.Timer(told_after, _log.warning, (f"palpate: compiling {what}{then}",))
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


class _Kernels(events.Listener):  # type: ignore[misc]
    """Hears of each function that numba compiles; what that calls is compiled meanwhile, and counts with it."""

    def __init__(self) -> None:
        self._depth, self._began, self._left = 0, 0.0, FIRST
        self._told: Any = None

    def on_start(self, event: events.Event) -> None:
        self._depth += 1
        if self._depth == 1:
            dispatcher = event.data["dispatcher"]
            function = dispatcher.py_func
            self._began = monotonic()
            self._told = compiling(
                f"{function.__module__}.{function.__qualname__}", kept=_is_kept(dispatcher), told_after=self._left
            )
            self._told.__enter__()

    def on_end(self, event: events.Event) -> None:
        self._depth -= 1
        if self._depth == 0:
            self._told.__exit__(None, None, None)
            left = self._left - (monotonic() - self._began)
            self._left = left if left > 0.0 else NEXT


def _is_kept(dispatcher: Any) -> bool:
    return dispatcher.stats.cache_path is not None


events.register("numba:compile", _Kernels())  # numba compiles under a lock: one thread at a time
