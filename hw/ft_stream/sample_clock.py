"""When a record was sampled, on this computer's clock, from the device's own counter.

Arrivals are late by the wire's and the system's delays, which jump; the counter does not jump, but runs at a rate
and from an origin that nobody knows exactly. No record arrives before it was sent, so that arrivals over counts
lie on or above a line, and the least delayed ones lie on it. Of all lines below the points the one nearest to them
in the sum is the edge of their lower convex hull above their mean count (Moon, Skelly & Towsley 1999, Estimation
and removal of clock skew from network delay measurements, INFOCOM). It is found from the earliest arrivals of
quarter seconds, over the last twenty, anew each quarter second; the time stamps bend towards the new line and do
not jump. They are later than the sampling by the least delay, which is the same for all: it belongs to the
`device_delay_s` of the sensor file.
"""

import itertools
import math
from collections import deque
from collections.abc import Sequence

MODULUS = 1 << 32
"""Counters are unsigned, 32 bits: at 7000 a second they wrap after a week."""

LEARNING = 1.0
"""Time over which the counter's rate is learned before it is used [s]; until then a stamp is -infinity."""

UNCERTAIN = 2e-4
"""[s] by which the least delays of two blocks differ on a quiet line. The rate is known to this, and to twice the
scatter of the least delays that were seen, over the time learned."""

FEWEST = 10
"""Records to learn from, however long it takes; a sensor of 100 Hz gives 25 in the time."""

BLOCK = 0.25
"""Of which the earliest arrival is kept [s]."""

BLOCKS = 80
"""Kept: 20 s. Quartz changes by less than 1e-6 in such a time, which is 20 us, unless it is being warmed."""

FEWEST_BLOCKS = 4
"""Below, the rate is kept and only the origin is fitted: a second."""

CLOCK_KEEPS = 5e-5
"""Share by which a device's clock keeps its rate against this computer's, as quartz does, warming up included.
More is delay that creeps, and makes stamps old; what creeps more slowly remains unnoticed."""

KNOWN = 16.0
"""[s] after which the rate is no longer learned."""

JUMP = 0.005
"""Arrival earlier than the line allows [s], by which the counter has jumped, or this computer slept: fifty times
what the line is wrong by at worst. The origin is sought anew."""

SLOWEST = 0.1
"""Least advance of stamps, in units of what the counter says: they never stand still or go back."""


class StreamClock:
    """Time stamps of one stream; cheap enough for 7000 records a second."""

    def __init__(self) -> None:
        self._pace = self._pace_fit = 0.0
        self._pace_learned = 0.0
        self._learned_over = self._change = 0.0
        self.restart()

    @property
    def learned(self) -> bool:
        """Whether there are stamps."""
        return self._pace_learned > 0.0

    def restart(self) -> None:
        """Forget the origin of the counter, not its rate: the device began anew."""
        self._last: int | None = None
        self._origin = 0.0
        self._count = 0
        self._stamp = -math.inf
        self._points: deque[tuple[float, float]] = deque(maxlen=BLOCKS)
        self._learning: list[tuple[float, float]] = []
        # The line in use, from a reference point on; and the fitted one, by which a block's earliest is found.
        self._pace = self._pace_fit
        self._at = 0.0
        self._line_at = 0.0
        self._block_end = BLOCK
        self._earliest: tuple[float, float] = (0.0, 0.0)
        self._earliest_delay = math.inf

    def stamp(self, counter: int, arrival: float) -> float:
        """Return when a record was sampled, `time.monotonic` [s], later than any before and not after its arrival.

        Args:
            counter: Of the record; it must have advanced.
            arrival: When it was read [s].
        """
        if self._last is None:
            self._origin = arrival
            advance = 0
        else:
            advance = (counter - self._last) % MODULUS
        self._last = counter
        self._count += advance
        x, y = float(self._count), arrival - self._origin
        if not self.learned:
            self._learn(x, y)
            if not self.learned:
                return -math.inf
        on_line = self._line_at + self._pace * (x - self._at)
        if y < on_line - JUMP:
            self.restart()
            return self.stamp(counter, arrival)
        if y < on_line:
            self._line_at -= on_line - y
            on_line = y
        delay = y - self._pace_fit * x
        if delay < self._earliest_delay:
            self._earliest, self._earliest_delay = (x, y), delay
        if y >= self._block_end:
            self._end_block(x, y, on_line)
        stamp = min(max(self._origin + on_line, self._stamp + SLOWEST * self._pace * advance), arrival)
        self._stamp = stamp
        return stamp

    def _learn(self, x: float, y: float) -> None:
        self._learning.append((x, y))
        if y < LEARNING or len(self._learning) < FEWEST:
            return
        at, line_at, pace = line_below(self._learning)
        if pace <= 0.0:
            self._learning.clear()
            return
        self._pace = self._pace_fit = pace
        self._at, self._line_at = at, line_at
        # Its quarters stand for it until there are blocks.
        quarter = len(self._learning) // 4
        for i in range(0, 4 * quarter, quarter):
            self._points.append(min(self._learning[i : i + quarter], key=lambda point: point[1] - pace * point[0]))
        self._learning.clear()
        self._know(pace, (at, line_at), y)
        self._block_end = y + BLOCK

    def _know(self, pace: float, on_line: tuple[float, float], over: float) -> None:
        """Take a rate that was learned over a time [s]."""
        at, line_at = on_line
        scatter = max(y - line_at - pace * (x - at) for x, y in self._points)
        self._pace_learned, self._learned_over = pace, over
        self._change = max((UNCERTAIN + 2.0 * scatter) / over, CLOCK_KEEPS)

    def _end_block(self, x: float, y: float, on_line: float) -> None:
        """Fit again, and head for where the new line will be a block from now."""
        self._points.append(self._earliest)
        self._earliest_delay = math.inf
        self._block_end = y + BLOCK
        at, line_at, pace = line_below(self._points)
        few = len(self._points) < FEWEST_BLOCKS
        if few:
            pace = self._pace_fit
        slowest, fastest = (1.0 - self._change) * self._pace_learned, (1.0 + self._change) * self._pace_learned
        if not slowest <= pace <= fastest or few:
            pace = min(max(pace, slowest), fastest)
            at, line_at = min(self._points, key=lambda point: point[1] - pace * point[0])
        self._pace_fit = pace
        if self._learned_over < KNOWN and y >= 2.0 * self._learned_over:
            self._know(pace, (at, line_at), y)
        ahead = BLOCK / pace
        there = line_at + pace * (x + ahead - at)
        self._at, self._line_at = x, on_line
        self._pace = min(max((there - on_line) / ahead, slowest), fastest)


def line_below(points: Sequence[tuple[float, float]]) -> tuple[float, float, float]:
    """Return the line below all points whose distances to them, measured upwards, have the least sum.

    Args:
        points: (x, y) with growing x, at least one.

    Returns:
        A point of it x, y, and its slope; slope 0 for a single point.
    """
    hull: list[tuple[float, float]] = []
    for x, y in points:
        while len(hull) >= 2:
            (xa, ya), (xb, yb) = hull[-2], hull[-1]
            if (yb - ya) * (x - xb) < (y - yb) * (xb - xa):
                break
            hull.pop()
        hull.append((x, y))
    middle = sum(x for x, _ in points) / len(points)
    for (xa, ya), (xb, yb) in itertools.pairwise(hull):
        if xb >= middle:
            return xa, ya, (yb - ya) / (xb - xa)
    return hull[0][0], hull[0][1], 0.0
