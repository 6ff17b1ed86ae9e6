"""Notices that force control oscillates, and takes gain and forward feed back until it does not.

A loop whose stiffness was misjudged swings about its set force: fast if the contact is stiffer than thought, for
the gain is then too high (half swings of 1.5 to 2 delays), and slowly, but growing, if it is softer, for the tip's
own motion then passes for the surface's (half swings of 6 delays and more). What a surface does of its own shows
neither: it is slower than the first and does not grow like the second. Swings are compared with those to the same
side: a tip can press as hard as it likes, but never pull. Where that ends in lost contact, whoever notices says so
by `lower`.
"""

from dataclasses import dataclass

from palpate.errors import check_positive

FAST_SWING = 4.0
"""A half swing shorter than this many delays is fast: what surfaces do at that rate nobody could follow."""

FAST_SWINGS = 6
"""So many fast half swings in a row that do not decay are an oscillation."""

FAST_DECAY = 0.97
"""Least ratio of a half swing to the last one on the same side for it not to count as decaying."""

SLOW_SWINGS = 3
"""So many half swings in a row, each larger by `SLOW_GROWTH` than the last one on the same side, are one, too."""

SLOW_GROWTH = 1.2

SHARE_OF_FORCE = 0.2
"""Of the set force: smaller half swings are left alone."""

MIN_SHARE = 0.125
"""Of gain and forward feed: three halvings, from an eightfold misjudged stiffness."""

FADING = 5.0
"""Delays over which the share goes to its new value, so that the command does not jump."""


@dataclass(frozen=True, slots=True)
class GuardSettings:
    """What the guard goes by.

    Attributes:
        delay: T of force control [s].
        period: Of control [s].
    """

    delay: float
    period: float

    def __post_init__(self) -> None:
        check_positive(self, delay="s", period="s")


class ForceGuard:
    """Watches the force error's half swings.

    Attributes:
        share: Of gain and forward feed that may act now, 1 at first, never more again until `reset`.
        trips: How often a swing has halved it.
    """

    def __init__(self, settings: GuardSettings) -> None:
        """Take what it goes by."""
        self._fast = FAST_SWING * settings.delay / settings.period
        self._step = 0.5 * settings.period / (FADING * settings.delay)
        self.reset()

    def reset(self) -> None:
        """Forget all swings, and allow everything."""
        self.share, self._target, self.trips = 1.0, 1.0, 0
        self._restart()

    def _restart(self) -> None:
        self._peak = self._before = self._last = 0.0
        self._periods = self._fast_ones = self._slow_ones = 0
        self._positive = True

    def step(self, error: float, force: float) -> float:
        """Take this period's force error and set force [N]; return the share."""
        self._periods += 1
        if (error > 0.0) is not self._positive:
            self._end_swing(force)
            self._positive, self._periods, self._peak = error > 0.0, 0, 0.0
        size = abs(error)
        if size > self._peak:
            self._peak = size
        if self.share > self._target:
            self.share = max(self._target, self.share - self._step)
        return self.share

    def _end_swing(self, force: float) -> None:
        peak, before = self._peak, self._before
        if peak < 0.02 * SHARE_OF_FORCE * force:  # noise about zero ends no swing worth counting
            self._fast_ones = self._slow_ones = 0
            self._before, self._last = self._last, peak
            return
        large, fast = peak > SHARE_OF_FORCE * force, self._periods < self._fast
        self._fast_ones = self._fast_ones + 1 if fast and large and peak > FAST_DECAY * before else 0
        self._slow_ones = self._slow_ones + 1 if not fast and peak > SLOW_GROWTH * before > 0.0 else 0
        self._before, self._last = self._last, peak
        if self._fast_ones >= FAST_SWINGS or (self._slow_ones >= SLOW_SWINGS and large):
            self.trips += self._target > MIN_SHARE
            self.lower()

    def lower(self) -> None:
        """Halve the share; watch anew."""
        if self._target > MIN_SHARE:
            self._target *= 0.5
        self._restart()
