"""Waiting for what a busy machine does late: it stands still for a tenth of a second now and then."""

import time
from collections.abc import Callable

WITHIN = 10.0
"""[s] until something must have happened, on a machine however loaded."""


def until(met: Callable[[], object], within: float = WITHIN) -> None:
    """Wait until something is so; fail if it never is."""
    end = time.monotonic() + within
    while not met():
        assert time.monotonic() < end, "it never came to it"
        time.sleep(1e-3)


def soonest(times: Callable[[], float], wanted: float, tries: int = 8) -> float:
    """Return how long something takes [s]: the first try that is as quick as wanted, or the quickest of all.

    What is slow by itself is slow in every try; what the machine holds up is not.
    """
    best = float("inf")
    for _ in range(tries):
        best = min(best, times())
        if best <= wanted:
            break
    return best
