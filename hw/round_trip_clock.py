"""When a device sampled, on this computer's clock: never later than round trips prove.

A sample that carries an echo of what was sent to the device was taken after that was sent. Samples are numbered by
the device's own clock or counter, so what one of them proves holds for its neighbours too: one that is so many
counts later was taken later by as many of the shortest counts at least. How long a count lasts is itself measured
between round trips. Delays, however they creep, make a stamp older, never younger (Marzullo & Owicki 1983,
Maintaining the time in a distributed system, PODC: the earlier end of their interval).
"""

import math
from collections import deque
from collections.abc import Iterable
from itertools import islice
from typing import NamedTuple

RECENT = 16
"""Newest round trips, of which the one that was quickest there counts; in between, the device's clock is trusted.
Where delays jitter from 0 to 20 ms stamps are then 3 ms too old at the median, and 12 ms at most in 30 minutes."""

KEPT = 1024
"""From the oldest kept to the newest the length of a count is measured: over 8 s for 125 round trips a second."""

HOLDS = 0.5
"""[s] beyond the newest round trip, after which stamps no longer advance: without an echo nothing is young."""

_STEP = 1e-6
"""[s] by which stamps advance at least: no device takes samples closer together."""


class RoundTrip(NamedTuple):
    """What an echo proves.

    Attributes:
        counter: Of the first sample that carries it, by the clock or counter of the device; the unit is free.
        sent: Before which the sample cannot have been taken [s].
        seen: After which it cannot have been taken [s].
    """

    counter: float
    sent: float
    seen: float


class RoundTripClock:
    """Time stamps of one device that echoes."""

    def __init__(self) -> None:
        self._last = -math.inf
        self._shortest = self._longest = 0.0  # [s] that a count may last
        self.restart()

    @property
    def proven(self) -> bool:
        """Whether there has been a round trip since the counter began."""
        return bool(self._trips)

    @property
    def paced(self) -> bool:
        """Whether stamps also advance between round trips: once there have been two."""
        return self.proven and self._shortest > 0.0

    def restart(self) -> None:
        """Forget all round trips, but not how long a count lasts: the device counts anew."""
        self._trips: deque[RoundTrip] = deque(maxlen=KEPT)
        self._count, self._bound = 0.0, -math.inf

    def prove(self, trips: Iterable[RoundTrip]) -> None:
        """Take round trips, oldest first."""
        for trip in trips:
            self._take(trip)

    def stamp(self, count: float, seen: float) -> float:
        """Return when a sample was taken at the earliest [s], later than the one before; -infinity if unproven.

        Args:
            count: Its number; larger than the one before.
            seen: When it arrived [s].
        """
        ahead = count - self._count
        elapsed = min(ahead * self._shortest, HOLDS) if ahead >= 0.0 else ahead * self._longest
        time = self._bound + elapsed
        if time > seen:  # the counter has jumped: only the newest round trip can be of after that
            newest = self._trips[-1]
            self._trips = deque((newest,), KEPT)
            self._bound = time = newest.sent
        self._last = time = min(seen, max(time, self._last + _STEP))
        return time

    def _take(self, trip: RoundTrip) -> None:
        trips = self._trips
        trips.append(trip)
        count, sent, seen = trip
        first = trips[0]
        counts = count - first.counter
        if counts > 0.0:
            self._shortest = shortest = max(0.0, (sent - first.seen) / counts)
            self._longest = (seen - first.sent) / counts
        else:
            shortest = 0.0
        newest = islice(reversed(trips), RECENT)
        self._bound = max([s + shortest * (count - c) for c, s, _ in newest])
        self._count = count
