"""By how much a load has fallen lately, without what it does now."""

import math
from collections import deque

from palpate.errors import positive

BLOCK, BLOCKS, LATEST = 0.05, 12, 2
"""[s] Of which lowest and highest are kept, how many of them (a swing of 2 Hz comes back within 0.5 s), and how
many do not count: a load that falls now has not swung."""

REMEMBERED = BLOCK * (BLOCKS + 1)
"""[s] After which nothing counts any more."""


class RecentSwing:
    """The largest fall in the last 0.6 s, but for the last 0.1 to 0.15 s. One call of `step` per period.

    Attributes:
        size: Of that fall, in the unit of the load.
    """

    def __init__(self, period: float) -> None:
        """Take the period [s]."""
        self._length = max(round(BLOCK / positive("period", period, "s")), 1)
        self._blocks = deque[tuple[float, float]](maxlen=BLOCKS)
        self.start()

    def start(self) -> None:
        """Nothing is known yet."""
        self._blocks.clear()
        self._seen, self.size = 0, 0.0
        self._known, self._known_until = 0.0, 0

    def admit(self) -> None:
        """What it did in the latest time was a swing too, up or down."""
        if self._blocks:
            lows, highs = zip(*self._blocks, strict=True)
            self.size = self._known = max(max(highs) - min(lows), self.size)
            self._known_until = self._seen + BLOCKS * self._length

    def step(self, value: float) -> None:
        """Take one value."""
        if self._seen % self._length == 0:
            self._blocks.append((value, value))
            self.size, top = self._known if self._seen < self._known_until else 0.0, -math.inf
            for low, high in list(self._blocks)[:-LATEST]:
                self.size, top = max(self.size, top - low), max(top, high)
        else:
            low, high = self._blocks[-1]
            self._blocks[-1] = (min(low, value), max(high, value))
        self._seen += 1
