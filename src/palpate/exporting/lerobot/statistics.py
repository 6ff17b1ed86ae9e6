"""Statistics of columns that come in pieces, as LeRobot normalises by them: moments, extremes, quantiles."""

import numpy as np

from palpate.errors import FloatArray

QUANTILES = (0.01, 0.10, 0.50, 0.90, 0.99)
"""Those that LeRobot has."""

_SAMPLE = 20_000
"""Most rows that quantiles are of: evenly spaced ones, of a longer log; their error in rank is below 0.01 %."""


class RunningStatistics:
    """Of the columns of rows, in bounded memory."""

    def __init__(self, width: int) -> None:
        """Take the number of columns."""
        self.count = 0
        self._mean, self._squares = np.zeros(width), np.zeros(width)
        self._low, self._high = np.full(width, np.inf), np.full(width, -np.inf)
        self._sample = np.empty((0, width))
        self._step = 1

    def take(self, rows: FloatArray) -> None:
        """Take the next finite rows, shape (n, width), n at least 1."""
        with np.errstate(over="ignore", invalid="ignore"):  # of squares of what is beyond 1e154
            self._take(rows)

    def _take(self, rows: FloatArray) -> None:
        count, mean = len(rows), rows.mean(axis=0)
        total, shift = self.count + count, mean - self._mean
        self._squares += ((rows - mean) ** 2).sum(axis=0) + shift**2 * (self.count * count / total)
        self._mean += shift * (count / total)
        self._low, self._high = np.minimum(self._low, rows.min(axis=0)), np.maximum(self._high, rows.max(axis=0))
        self._sample = np.concatenate([self._sample, rows[-self.count % self._step :: self._step]])
        self.count = total
        while len(self._sample) > _SAMPLE:
            self._sample, self._step = self._sample[::2], 2 * self._step

    @property
    def found(self) -> dict[str, FloatArray]:
        """Each statistic of each column, by LeRobot's names; one that overflowed is the largest double."""
        moments = {
            "min": self._low,
            "max": self._high,
            "mean": self._mean,
            "std": np.sqrt(self._squares / self.count),
        }
        with np.errstate(over="ignore", invalid="ignore"):
            quantiles = np.quantile(self._sample, QUANTILES, axis=0)
        named = moments | {f"q{100 * q:02.0f}": row for q, row in zip(QUANTILES, quantiles, strict=True)}
        return {name: np.nan_to_num(row) for name, row in named.items()}
