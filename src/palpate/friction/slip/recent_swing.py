"""By how much a load has fallen lately, without what it does now."""

import math
from functools import cache
from typing import Any

import numpy as np

from palpate.compiling import machine_code, njit
from palpate.errors import positive

BLOCK, BLOCKS, LATEST = 0.05, 12, 2
"""[s] Of which lowest and highest are kept, how many of them (a swing of 2 Hz comes back within 0.5 s), and how
many do not count: a load that falls now has not swung."""

REMEMBERED = BLOCK * (BLOCKS + 1)
"""[s] After which nothing counts any more."""


LENGTH, SEEN, SIZE, KNOWN, KNOWN_UNTIL, COUNT, LOWS = range(7)
HIGHS = LOWS + BLOCKS
"""Where in its state what is kept: samples in a block, samples so far, the fall, that of `admit` and up to which
sample it counts, how many blocks there are, and what was lowest and highest in each, oldest first."""


class RecentSwing:
    """The largest fall in the last 0.6 s, but for the last 0.1 to 0.15 s. One call of `step` per period.

    Attributes:
        state: Of `take_value`.
    """

    def __init__(self, period: float) -> None:
        """Take the period [s]."""
        self.state = np.zeros(HIGHS + BLOCKS)
        self.state[LENGTH] = max(round(BLOCK / positive("period", period, "s")), 1)
        _kernel()  # compiled before the first period

    @property
    def size(self) -> float:
        """Of that fall, in the unit of the load."""
        return float(self.state[SIZE])

    def start(self) -> None:
        """Nothing is known yet."""
        self.state[SEEN:] = 0.0

    def admit(self) -> None:
        """What it did in the latest time was a swing too, up or down."""
        state = self.state
        count = int(state[COUNT])
        if count:
            swing = state[HIGHS : HIGHS + count].max() - state[LOWS : LOWS + count].min()
            state[SIZE] = state[KNOWN] = max(swing, state[SIZE])
            state[KNOWN_UNTIL] = state[SEEN] + BLOCKS * state[LENGTH]

    def step(self, value: float) -> None:
        """Take one value."""
        _kernel()(self.state, value)


@njit(cache=True)
def take_value(state: Any, value: float) -> None:
    """See `RecentSwing.step`."""
    count = int(state[COUNT])
    if state[SEEN] % state[LENGTH] == 0.0:
        if count == BLOCKS:
            state[LOWS : HIGHS - 1] = state[LOWS + 1 : HIGHS].copy()
            state[HIGHS:-1] = state[HIGHS + 1 :].copy()
        else:
            count += 1
        state[COUNT] = count
        state[LOWS + count - 1] = state[HIGHS + count - 1] = value
        size, top = state[KNOWN] if state[SEEN] < state[KNOWN_UNTIL] else 0.0, -math.inf
        for i in range(count - LATEST):
            size, top = max(size, top - state[LOWS + i]), max(top, state[HIGHS + i])
        state[SIZE] = size
    else:
        if value < state[LOWS + count - 1]:
            state[LOWS + count - 1] = value
        if value > state[HIGHS + count - 1]:
            state[HIGHS + count - 1] = value
    state[SEEN] += 1.0


@cache
def _kernel() -> Any:
    return machine_code(take_value, np.zeros(HIGHS + BLOCKS), 0.0)
