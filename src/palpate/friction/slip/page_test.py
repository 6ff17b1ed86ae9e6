"""Quickest detection of a change: Page's cumulative sum (Page 1954; optimal: Moustakides 1986)."""

import math
from functools import cache
from typing import Any

import numpy as np

from palpate.compiling import machine_code, njit
from palpate.errors import positive

THRESHOLD, MOST, SUM, ALARM = range(4)
"""Where in its state what is kept."""


class PageTest:
    """Sums the logarithm of a likelihood ratio, never below 0, until it reaches a threshold.

    With independent samples the time between two false alarms is at least exp(threshold) samples (Lorden 1971). It
    is over again when the sum is back at 0; as the sum never exceeds the threshold, that takes as little evidence
    as the alarm took.

    Attributes:
        state: Of `add_evidence`.
    """

    __slots__ = ("state",)

    def __init__(self, threshold: float, most: float) -> None:
        """Set it up.

        Args:
            threshold: Sum at which the alarm is raised.
            most: Of what one sample may add or take: no single sample decides, however odd.

        Raises:
            InvalidValueError: One of them is not above 0.
        """
        positive("threshold", threshold, "")
        positive("most", most, "", infinite_allowed=True)
        self.state = np.array([threshold, most, 0.0, 0.0])
        _kernel()  # compiled before the first period

    @property
    def sum(self) -> float:
        """The evidence so far, from 0 to the threshold."""
        return float(self.state[SUM])

    @property
    def alarm(self) -> bool:
        """Whether the threshold was reached, and the sum not back at 0 since."""
        return bool(self.state[ALARM])

    def restart(self) -> None:
        """Forget everything."""
        self.state[SUM:] = 0.0

    def add(self, log_ratio: float) -> bool:
        """Take one sample's log of likelihood "changed" over "as before"; return `alarm`. NaN says nothing."""
        found: bool = _kernel()(self.state, log_ratio)
        return found


@njit(cache=True)
def add_evidence(state: Any, log_ratio: float) -> bool:
    """See `PageTest.add`."""
    if not math.isnan(log_ratio):
        step = max(-state[MOST], min(state[MOST], log_ratio))
        state[SUM] = max(0.0, min(state[THRESHOLD], state[SUM] + step))
        if state[SUM] >= state[THRESHOLD]:
            state[ALARM] = 1.0
        elif state[SUM] == 0.0:
            state[ALARM] = 0.0
    return bool(state[ALARM] != 0.0)


@cache
def _kernel() -> Any:
    return machine_code(add_evidence, np.zeros(4), 0.0)
