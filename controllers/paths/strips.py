"""The unfelt strips between rows, and what a stroke along them is worth."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from palpate.controllers.paths.missed import TouchNoise, missed_around
from palpate.controllers.paths.row import Row
from palpate.controllers.paths.surprise import surprise
from palpate.errors import FloatArray

LOUD = 0.35
"""A stroke of its own covers where the error is above this part of the strip's largest: the test over a gap rings
for a gap beside a detail, more weakly. Measured by `benchmarks/active.py`."""

NOTICED = 4.0
"""Variance over that of noise, from which on something was felt: twice the deviation, over several stretches."""

STANDS_OUT = 3.0
"""Times what is usual in its row, from which on it is a detail and not how the surface is everywhere."""

HIDDEN = 0.01
"""Error expected of a detail of which only the foot was felt, per gap. From `benchmarks/active.py --tune`."""

Place = tuple[float, float, float, float]
"""begin, end, low, high of a strip [m]."""


@dataclass(frozen=True, slots=True)
class Strip:
    """A rectangle between two rows in which nothing was felt.

    Attributes:
        begin: Least u [m].
        end: Largest u [m].
        low: v of the row below [m].
        high: v of the row above [m].
        worth: Sum over its area of the expected error to the power that the goal asks for.
    """

    begin: float
    end: float
    low: float
    high: float
    worth: float

    @property
    def gap(self) -> float:
        """Distance of the rows [m]."""
        return self.high - self.low

    @property
    def place(self) -> Place:
        """Where it is: the same place is asked for once."""
        return (self.begin, self.end, self.low, self.high)


@dataclass(frozen=True, slots=True)
class Expectation:
    """How an error is expected from what was felt around.

    Attributes:
        noise: Of the contacts.
        stretch: Over which contacts are averaged [m].
        unknown: Error expected of detail that no row met, per gap: a strip as wide as the field must hold
            something, a narrow one hardly.
        prior: Strips wider than this may hide a detail of which a row felt the foot only [m].
    """

    noise: TouchNoise
    stretch: float
    unknown: float
    prior: float


class Columns:
    """All rows seen across: which of them cover a column of the field, and the errors expected between them.

    What a row says about a gap does not change, so it is remembered from one call to the next.
    """

    def __init__(self, begin: float, end: float, width: float, how: Expectation) -> None:
        """Take the columns, of about `width` from `begin` to `end` [m]."""
        count = max(round((end - begin) / width), 1)
        self._edges = np.linspace(begin, end, count + 1)
        self._at = 0.5 * (self._edges[1:] + self._edges[:-1])
        self._width = (end - begin) / count
        self._how = how
        self._along: dict[tuple[int, int], FloatArray] = {}
        self._feet: dict[int, npt.NDArray[np.bool_]] = {}
        self._rows: list[Row] = []
        self._order = np.zeros(0, np.intp)
        self._error = np.zeros((0, count))
        self._below = np.zeros((0, count), np.intp)
        self._gap = np.zeros((0, count))
        self._v = np.zeros(0)

    def take(self, rows: Sequence[Row]) -> None:
        """Take all rows so far: those of the last call, in the same order, and new ones."""
        self._rows = list(rows)
        self._order = np.argsort([row.v for row in rows], kind="stable")
        ordered = [self._rows[k] for k in self._order]
        self._v = np.array([row.v for row in ordered])
        slack = 1.5 * self._how.stretch
        at = self._at
        covers = np.array([(at >= row.u[0] - slack) & (at <= row.u[-1] + slack) for row in ordered])
        index = np.arange(len(ordered))[:, None]
        last = np.maximum.accumulate(np.where(covers, index, -1), axis=0)
        below: npt.NDArray[np.intp] = np.full_like(last, -1)
        below[1:] = last[:-1]
        below[~covers] = -1
        self._below = below
        self._gap = np.where(below >= 0, self._v[:, None] - self._v[below], 0.0)
        height = np.array([np.interp(at, row.u, row.height) for row in ordered])
        cross = np.array([np.interp(at, row.u, row.cross_slope) for row in ordered])
        error = surprise(self._v, height, cross, below, self._how.noise, self._width)
        for high, low in self._pairs():
            here = below[high] == low
            gap = float(self._v[high] - self._v[low])
            along = np.maximum(self._along_row(low, gap), self._along_row(high, gap))
            if gap > self._how.prior:
                foot = self._foot(low) | self._foot(high)
                along = np.where(foot, np.maximum(along, HIDDEN * gap), along)
            error[high, here] = np.maximum(error[high, here], along[here])
        self._error = np.hypot(error, self._how.unknown * self._gap)

    def strips(self, power: float, threshold: float) -> list[Strip]:
        """Return whole strips and, within them, runs where more than `threshold` [m] is expected."""
        found: list[Strip] = []
        step = self._width
        for high, low in self._pairs():
            gap, error = float(self._v[high] - self._v[low]), self._error[high]
            total = np.concatenate([[0.0], np.cumsum(error**power) * step * gap])
            for begin, end in _runs(self._below[high] == low, 1):
                found.append(self._strip(low, high, begin, end, total))
                inside = np.zeros(len(error), bool)
                inside[begin:end] = error[begin:end] > max(threshold, LOUD * float(error[begin:end].max()))
                # what lies between two loud places closer than the gap is worth the way between them
                parts = _runs(inside, max(int(gap / step), 1))
                found += [self._strip(low, high, *part, total) for part in parts if part != (begin, end)]
        return found

    def cells(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return expected errors [m], gaps [m] and areas [m^2] of all that lies between rows, shape (n,)."""
        inside = self._below >= 0
        gap = self._gap[inside]
        return self._error[inside], gap, gap * self._width

    def _strip(self, low: int, high: int, begin: int, end: int, total: FloatArray) -> Strip:
        return Strip(
            float(self._edges[begin]),
            float(self._edges[end]),
            float(self._v[low]),
            float(self._v[high]),
            float(total[end] - total[begin]),
        )

    def _pairs(self) -> list[tuple[int, int]]:
        """Neighbouring rows, the upper one first, as places in the order of v."""
        n = len(self._v)
        upper, column = np.nonzero(self._below >= 0)
        keys = np.unique(upper * n + self._below[upper, column])
        return [(int(key // n), int(key % n)) for key in keys]

    def _foot(self, place: int) -> npt.NDArray[np.bool_]:
        """Where a row felt at least the foot of a detail: how small it is there says little of its height."""
        index = int(self._order[place])
        if index not in self._feet:
            gap, row = self._how.prior, self._rows[index]
            felt = missed_around(row, gap, self._at, 0.0)
            noise = self._how.noise.missed_variance(gap, self._how.stretch)
            inside = felt[(self._at >= row.u[0]) & (self._at <= row.u[-1])]
            usual = float(np.median(inside)) if len(inside) else 0.0  # a row may lie between two columns
            self._feet[index] = (felt**2 > NOTICED * noise) & (felt > STANDS_OUT * usual)
        return self._feet[index]

    def _along_row(self, place: int, gap: float) -> FloatArray:
        index = int(self._order[place])
        key = (index, round(gap * 1e7))
        if key not in self._along:
            noise = self._how.noise.missed_variance(gap, self._how.stretch)
            self._along[key] = missed_around(self._rows[index], gap, self._at, noise)
        return self._along[key]


def _runs(inside: npt.NDArray[np.bool_], bridge: int) -> list[tuple[int, int]]:
    """Return (first, one past last) of where it is true; less than `bridge` between two runs belongs to both."""
    indices = np.flatnonzero(inside)
    if not len(indices):
        return []
    breaks = np.flatnonzero(np.diff(indices) > bridge)
    firsts = indices[np.concatenate([[0], breaks + 1])]
    lasts = indices[np.concatenate([breaks, [len(indices) - 1]])]
    return [(int(a), int(b) + 1) for a, b in zip(firsts, lasts, strict=True)]
