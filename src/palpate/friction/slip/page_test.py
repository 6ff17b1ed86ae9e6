"""Quickest detection of a change: Page's cumulative sum (Page 1954; optimal: Moustakides 1986)."""

import math

from palpate.errors import positive


class PageTest:
    """Sums the logarithm of a likelihood ratio, never below 0, until it reaches a threshold.

    With independent samples the time between two false alarms is at least exp(threshold) samples (Lorden 1971). It
    is over again when the sum is back at 0; as the sum never exceeds the threshold, that takes as little evidence
    as the alarm took.
    """

    __slots__ = ("_alarm", "_most", "_sum", "_threshold")

    def __init__(self, threshold: float, most: float) -> None:
        """Set it up.

        Args:
            threshold: Sum at which the alarm is raised.
            most: Of what one sample may add or take: no single sample decides, however odd.

        Raises:
            InvalidValueError: One of them is not above 0.
        """
        self._threshold = positive("threshold", threshold, "")
        self._most = positive("most", most, "", infinite_allowed=True)
        self._sum, self._alarm = 0.0, False

    @property
    def sum(self) -> float:
        """The evidence so far, from 0 to the threshold."""
        return self._sum

    @property
    def alarm(self) -> bool:
        """Whether the threshold was reached, and the sum not back at 0 since."""
        return self._alarm

    def restart(self) -> None:
        """Forget everything."""
        self._sum, self._alarm = 0.0, False

    def add(self, log_ratio: float) -> bool:
        """Take one sample's log of likelihood "changed" over "as before"; return `alarm`. NaN says nothing."""
        if math.isnan(log_ratio):
            return self._alarm
        step = max(-self._most, min(self._most, log_ratio))
        self._sum = max(0.0, min(self._threshold, self._sum + step))
        if self._sum >= self._threshold:
            self._alarm = True
        elif self._sum == 0.0:
            self._alarm = False
        return self._alarm
