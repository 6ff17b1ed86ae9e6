"""Times in a log, where its clock was in order."""

import numpy as np

from palpate.errors import FloatArray
from palpate.runtime.log.chunk import LogRows
from palpate.runtime.log.period_codec import PeriodCodec
from palpate.runtime.times import Times
from palpate.runtime.timing import Distribution

LONGEST = 1e9
"""[s], thirty years. Times beyond are a broken clock's, and left out of the statistics."""


class LogTimes:
    """Times of the periods of a log, read piece by piece.

    Attributes:
        duration: From the first to the last of the periods [s]; of a broken clock anything.
        numbers: How many there would be if none were missing in between.
    """

    def __init__(self, codec: PeriodCodec) -> None:
        """Take the codec of the log."""
        self.duration, self.numbers = 0.0, 0
        self._first, self._last = (0, 0.0), (-2, 0.0)  # number and time
        self._columns = [codec.columns[name].start for name in ("time", "compute_time", "lateness")]
        sampled = [name for name in codec.columns if name.endswith(".time")]
        self._sampled = [codec.columns[name].start for name in sampled]
        ages = (f"age of {name.removesuffix('.time')}" for name in sampled)
        self._times = {name: Times() for name in ("sample to sample", "compute time", "lateness", *ages)}

    def take(self, piece: LogRows) -> None:
        """Take the next periods."""
        time, compute, late = piece.values[:, self._columns].T
        if self._last[0] < 0:
            self._first = (int(piece.sequence[0]), float(time[0]))
        with np.errstate(over="ignore", invalid="ignore"):
            steps = np.diff(time, prepend=self._last[1])[np.diff(piece.sequence, prepend=self._last[0]) == 1]
            self.duration = float(time[-1] - self._first[1])
            ages = time - piece.values[:, self._sampled].T
        self._last = (int(piece.sequence[-1]), float(time[-1]))
        self.numbers = self._last[0] - self._first[0]
        for times, new in zip(self._times.values(), (steps, compute, late, *ages), strict=True):
            times.extend(_in_order(new))

    @property
    def spreads(self) -> dict[str, Distribution]:
        """Of each kind of time, without those of a broken clock; none of a kind that there is not."""
        return {name: Distribution.of(times) for name, times in self._times.items() if len(times)}


def _in_order(times: FloatArray) -> FloatArray:
    return times[np.abs(times) < LONGEST]
