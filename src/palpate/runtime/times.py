"""Times of the periods of a run of any length, in bounded memory."""

from array import array
from typing import Any

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray

MOST_TIMES = 2**17
"""Times that are kept one by one, a megabyte: two minutes at 1 kHz."""

_AT_ONCE = 1024
"""Times that are counted at once: 20 us in a loop's second."""

_FRACTION_BITS = 13
"""Of the 52 of a double: times are counted to one part in 8192."""

_LEAST, _BEYOND = 2.0**-40, 2.0**24
"""[s] Shorter times (a picosecond) are counted as 0, longer ones (half a year) as the longest."""


def _key(time: float) -> int:
    return int(np.float64(time).view(np.int64)) >> (52 - _FRACTION_BITS)


_FIRST, _KEYS = _key(_LEAST), _key(_BEYOND) - _key(_LEAST)


class Times:
    """Times [s], one by one in their order up to `MOST_TIMES`; of more of them, how often each came.

    The longest is always exact; the others are then rounded down by less than one part in 8192.
    """

    __slots__ = ("_counts", "_kept", "_largest", "_recent")

    def __init__(self, times: FloatArray | None = None) -> None:
        """Begin with some, shape (n,), or none."""
        self._recent = array("d")
        self._kept: array[float] | None = array("d")
        self._counts: npt.NDArray[np.int64] = np.zeros(_KEYS, np.int64)
        self._largest = -np.inf
        if times is not None:
            self.extend(times)

    def append(self, time: float) -> None:
        """Take one more."""
        self._recent.append(time)
        if len(self._recent) == _AT_ONCE:
            self._count()

    def extend(self, times: FloatArray) -> None:
        """Take more, shape (n,), which are numbers."""
        self._recent.frombytes(np.ascontiguousarray(times, np.float64).tobytes())
        self._count()

    @property
    def values(self) -> FloatArray:
        """The times, in order as they came; of more than `MOST_TIMES` each different one, rising."""
        if self._kept is not None:
            return np.array(self._kept + self._recent)
        self._count()
        values = ((np.flatnonzero(self._counts) + _FIRST) << (52 - _FRACTION_BITS)).view(np.float64)
        values[0] = 0.0 if self._counts[0] else values[0]
        values[-1] = self._largest
        return np.asarray(values)

    @property
    def counts(self) -> npt.NDArray[np.int64]:
        """How often each of `values` came."""
        if self._kept is not None:
            return np.ones(len(self), np.int64)
        self._count()
        return self._counts[self._counts > 0]

    def __len__(self) -> int:
        """How many there are."""
        return len(self._recent) + (int(self._counts.sum()) if self._kept is None else len(self._kept))

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> npt.NDArray[Any]:
        """As `values`."""
        return self.values.astype(dtype or np.float64)

    def _count(self) -> None:
        times = np.array(self._recent)
        if not len(times):
            return
        keys = np.clip(times, _LEAST, np.nextafter(_BEYOND, 0.0)).view(np.int64) >> (52 - _FRACTION_BITS)
        np.add.at(self._counts, keys - _FIRST, 1)
        self._largest = max(self._largest, float(times.max()))
        if self._kept is not None:
            self._kept.extend(self._recent)
            if len(self._kept) > MOST_TIMES:
                self._kept = None
        self._recent = array("d")
