"""The unfelt strips between rows, and what a stroke along them is worth."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from palpate.controllers.paths.missed import TouchNoise, missed_around
from palpate.controllers.paths.row import Row
from palpate.errors import FloatArray

LOUD = 0.35
"""A stroke of its own covers where the error is above this part of the strip's largest: the test over a gap rings
for a gap beside a detail, more weakly. Measured by `benchmarks/active.py`."""


@dataclass(frozen=True, slots=True)
class Strip:
    """A rectangle between two rows in which nothing was felt.

    Attributes:
        begin: Least u [m].
        end: Largest u [m].
        low: v of the row below [m].
        high: v of the row above [m].
        worst: Largest error expected in it [m].
        whole: Whether it runs as far as both rows do; otherwise it is part of one that does.
        worth: Sum over its area of the expected error to the power that the goal asks for.
    """

    begin: float
    end: float
    low: float
    high: float
    worst: float
    whole: bool
    worth: float

    @property
    def gap(self) -> float:
        """Distance of the rows [m]."""
        return self.high - self.low


@dataclass(frozen=True, slots=True)
class Expectation:
    """How an error is expected from what was felt around.

    Attributes:
        noise: Of the contacts.
        stretch: Over which contacts are averaged [m].
        unknown: Error expected of detail that no row met, per gap: a strip as wide as the field must hold
            something, a narrow one hardly.
    """

    noise: TouchNoise
    stretch: float
    unknown: float


class Columns:
    """All rows seen across: which of them cover a column of the field, and the errors expected between them."""

    def __init__(self, rows: Sequence[Row], begin: float, end: float, width: float, how: Expectation) -> None:
        """Take the rows and columns of about `width` from `begin` to `end` [m]."""
        count = max(round((end - begin) / width), 1)
        self._edges = np.linspace(begin, end, count + 1)
        self._at = 0.5 * (self._edges[1:] + self._edges[:-1])
        self._rows = sorted((row for row in rows if len(row) > 1), key=lambda row: row.v)
        self._how = how
        self._along: dict[tuple[int, int], FloatArray] = {}
        slack = 1.5 * how.stretch
        self._covers = [(self._at >= row.u[0] - slack) & (self._at <= row.u[-1] + slack) for row in self._rows]

    def strips(self, power: float, threshold: float) -> list[Strip]:
        """Return whole strips and, within them, runs where more than `threshold` [m] is expected."""
        found: list[Strip] = []
        for (low, high), columns in sorted(self._pairs().items()):
            inside = np.flatnonzero(columns)
            gap = self._rows[high].v - self._rows[low].v
            error = self._expected(low, high, gap)
            for run in _runs(inside):
                found.append(self._strip(run, low, high, error, power, whole=True))
                loud = run[error[run] > max(threshold, LOUD * float(error[run].max()))]
                # what lies between two loud places closer than the gap is worth the way between them
                parts = _runs(loud, max(int(gap / (self._edges[1] - self._edges[0])), 1))
                if len(parts) != 1 or len(parts[0]) != len(run):
                    found += [self._strip(part, low, high, error, power, whole=False) for part in parts]
        return found

    def _strip(
        self, run: npt.NDArray[np.intp], low: int, high: int, error: FloatArray, power: float, *, whole: bool
    ) -> Strip:
        begin, end = float(self._edges[run[0]]), float(self._edges[run[-1] + 1])
        v0, v1 = self._rows[low].v, self._rows[high].v
        width = float(self._edges[1] - self._edges[0])
        worth = float((error[run] ** power).sum()) * width * (v1 - v0)
        return Strip(begin, end, v0, v1, float(error[run].max()), whole, worth)

    def _pairs(self) -> dict[tuple[int, int], npt.NDArray[np.bool_]]:
        """Neighbouring rows and the columns in which they are neighbours."""
        pairs: dict[tuple[int, int], npt.NDArray[np.bool_]] = {}
        for column in range(len(self._at)):
            covering = [k for k, covers in enumerate(self._covers) if covers[column]]
            for pair in pairwise(covering):
                pairs.setdefault(pair, np.zeros(len(self._at), bool))[column] = True
        return pairs

    def _expected(self, low: int, high: int, gap: float) -> FloatArray:
        """Return the error expected between two rows in every column [m]."""
        error = np.maximum(self._along_row(low, gap), self._along_row(high, gap))
        return np.sqrt(error**2 + (self._how.unknown * gap) ** 2)

    def _along_row(self, index: int, gap: float) -> FloatArray:
        key = (index, round(gap * 1e7))
        if key not in self._along:
            noise = self._how.noise.missed_variance(gap, self._how.stretch)
            self._along[key] = missed_around(self._rows[index], gap, self._at, noise)
        return self._along[key]


def _runs(indices: npt.NDArray[np.intp], bridge: int = 1) -> list[npt.NDArray[np.intp]]:
    """Split sorted indices where more than `bridge` lies between neighbours; gaps inside a run are filled."""
    if not len(indices):
        return []
    parts = np.split(indices, np.flatnonzero(np.diff(indices) > bridge) + 1)
    return [np.arange(part[0], part[-1] + 1) for part in parts]
