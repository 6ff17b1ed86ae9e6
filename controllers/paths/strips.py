"""Strips between rows without contacts, and the worth of a stroke along each."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from palpate.controllers.paths.felt_rows import CROSS_WEIGHT, FeltRow, TouchNoise, missed_around
from palpate.errors import FloatArray

_MAX_DISTANCE_RATIO = 2.0
"""Most that one distance counts over the other: beyond it noise would be blown up."""

_INNOVATION_RATIO = 8.0
"""Ratio of the prediction error of a row to what then remains between it and its neighbours, at equal distances.
By the law above 16; but a detail as narrow as the gap does not follow it yet, and a seam would be left half
felt."""

_SAME_ROW_DISTANCE = 1e-4
"""Rows closer than this [m] are the same row twice."""


def innovation_error(
    v: FloatArray,
    height: FloatArray,
    cross_slope: FloatArray,
    below: npt.NDArray[np.intp],
    noise: TouchNoise,
    width: float,
) -> FloatArray:
    """Return the error that innovations imply for the strip below each row and column, shape (n, m) [m].

    The innovation of a row is its measured height minus the height that its neighbours predict. Between two rows
    the map is about the cubic Hermite polynomial through their heights and cross slopes. A row between them tests
    it: where rows at distances a below and b above predict a height that is off by r, the surface's fourth
    derivative across is 24 r / (a b)^2; the strips that remain err by a^4 / 384 or b^4 / 384 of it (error of
    Hermite interpolation, Stoer & Bulirsch, Numerical Analysis, 2.1.5). Unlike errors along rows, the innovation
    shows a seam that runs beside them.

    Args:
        v: Where the rows are, increasing, shape (n,) [m].
        height: On the columns, shape (n, m) [m].
        cross_slope: dh/dv, shape (n, m).
        below: The next row below that covers the column, -1: none or not covered; shape (n, m).
        noise: Random errors of the contacts.
        width: Width of the columns [m].
    """
    n, m = height.shape
    left = np.zeros((n, m))
    column = np.arange(m)
    upper, at = np.nonzero(below >= 0)
    middle = below[upper, at]
    lower = below[middle, at]
    # two strokes may share a line where they overlap by a stretch: they say nothing of each other
    inner = (
        (lower >= 0) & (v[middle] - v[lower] > _SAME_ROW_DISTANCE) & (v[upper] - v[middle] > _SAME_ROW_DISTANCE)
    )
    upper, middle, lower, at = upper[inner], middle[inner], lower[inner], at[inner]
    if not len(upper):
        return left
    a, b = v[middle] - v[lower], v[upper] - v[middle]
    t, g = a / (a + b), a + b
    predicted, slope = _hermite(
        t, g, height[lower, at], height[upper, at], cross_slope[lower, at], cross_slope[upper, at]
    )
    off = (height[middle, at] - predicted) ** 2 + (CROSS_WEIGHT * g * (cross_slope[middle, at] - slope)) ** 2
    # three rows of independent noise; the outer two count for a half each in the middle
    off -= 1.5 * (noise.height**2 + (CROSS_WEIGHT * g * noise.slope) ** 2)
    # averaged along the row over a part of the gap: noise counts less, and a detail seldom ends within it
    square = np.zeros((n, m))
    square[middle, at] = off
    known = np.zeros((n, m))
    known[middle, at] = 1.0
    half = max(int(0.25 * float(np.median(g)) / width), 1)
    total = np.concatenate([np.zeros((n, 1)), np.cumsum(square, axis=1)], axis=1)
    count = np.concatenate([np.zeros((n, 1)), np.cumsum(known, axis=1)], axis=1)
    begin, end = np.maximum(column - half, 0), np.minimum(column + half + 1, m)
    mean = (total[:, end] - total[:, begin]) / np.maximum(count[:, end] - count[:, begin], 1.0)
    error = np.sqrt(np.maximum(mean, 0.0))[middle, at] / _INNOVATION_RATIO
    np.maximum.at(left, (middle, at), error * np.minimum(a / b, _MAX_DISTANCE_RATIO) ** 2)
    np.maximum.at(left, (upper, at), error * np.minimum(b / a, _MAX_DISTANCE_RATIO) ** 2)
    return left


def _hermite(
    t: FloatArray, gap: FloatArray, h0: FloatArray, h1: FloatArray, s0: FloatArray, s1: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return value and derivative at t in (0, 1) of the cubic with these end heights and slopes."""
    w = 1.0 - t
    value = h0 * w * w * (1 + 2 * t) + h1 * t * t * (3 - 2 * t) + gap * t * w * (s0 * w - s1 * t)
    slope = 6 * t * w * (h1 - h0) / gap + s0 * w * (1 - 3 * t) + s1 * t * (3 * t - 2)
    return value, slope


_ERROR_THRESHOLD = 0.35
"""A stroke of its own covers where the error is above this part of the strip's largest: the test over a gap rings
for a gap beside a detail, more weakly. Measured by `benchmarks/active.py`."""

_DETECTION_RATIO = 4.0
"""Variance over that of noise, from which on something was felt: twice the deviation, over several stretches."""

_DETAIL_RATIO = 3.0
"""Error over the usual one of its row from which on it is a detail, and no property of the whole surface."""

_HIDDEN_ERROR_RATIO = 0.02
"""Error expected of a detail of which only the flank was felt, per gap. Chosen with `benchmarks/active.py tuning`:
over `--seeds 15` the median path length to 0.1 mm on local detail is 0.64 of the best raster's with it, 0.77
without."""

_FLANK_GAP = 3.3e-3
"""Strips wider than this may hide a detail of which a row felt the flank only [m]: a raised cosine 2 mm wide ends
2 mm from its middle, so 1.7 mm to both sides of it a row feels a fortieth of it."""

_TAIL_GAPS = 0.5
"""How far from a closer row's end the test over a gap rings, in gaps."""

_MIN_SPACING = 1.2e-3
"""Minimum distance of rows that a detail requires at once [m]: two stretches of path."""

_MAX_ROWS = 6
"""Maximum number of rows that a detail requires in one gap: at far smaller gaps a row shows noise."""

_STROKE_MARGIN = 0.05
"""How much farther to each side than the loud part of a strip its stroke goes, in gaps. From
`benchmarks/active.py tuning`."""

_FLANK_MARGIN = 0.6
"""The same for a stroke that goes less than half a gap from a row, in its distance: the loud part then ends on the
flanks of the detail, and a stroke that ends there misleads the map."""

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
        v: Where a stroke along it is best [m].
        beside: How much farther to each side the stroke should go [m].
    """

    begin: float
    end: float
    low: float
    high: float
    worth: float
    v: float
    beside: float = 0.0

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
    """Parameters from which the error between rows is expected.

    Attributes:
        noise: Random errors of the contacts.
        stretch: Over which contacts are averaged [m].
        unknown: Error expected of detail that no row met, per gap: a strip as wide as the field must hold
            something, a narrow one hardly.
        prior: Gap over which the flank of a detail is looked for [m].
    """

    noise: TouchNoise
    stretch: float
    unknown: float
    prior: float


class StripColumns:
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
        self._rows: list[FeltRow] = []
        self._order = np.zeros(0, np.intp)
        self._error = np.zeros((0, count))
        self._firm = np.zeros((0, count))
        self._below = np.zeros((0, count), np.intp)
        self._gap = np.zeros((0, count))
        self._v = np.zeros(0)

    def take(self, rows: Sequence[FeltRow]) -> None:
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
        error = innovation_error(self._v, height, cross, below, self._how.noise, self._width)
        tails = np.zeros(error.shape, bool)
        for high, low in self._pairs():
            here = below[high] == low
            gap = float(self._v[high] - self._v[low])
            along = np.maximum(self._along_row(low, gap), self._along_row(high, gap))
            if gap > _FLANK_GAP:
                flank = self._flank(low) | self._flank(high)
                along = np.where(flank, np.maximum(along, _HIDDEN_ERROR_RATIO * gap), along)
            error[high, here] = np.maximum(error[high, here], along[here])
            self._mark_tails(tails[high], error[high], here, gap)
        self._error = error
        self._firm = np.where(tails, 0.0, error)

    def whole(self, power: float) -> list[Strip]:
        """Return whole strips between two rows; their worth is the error of a detail that they may hide."""
        found: list[Strip] = []
        for high, low in self._pairs():
            here = self._below[high] == low
            gap = float(self._v[high] - self._v[low])
            worth = (self._how.unknown * gap) ** power * gap * self._width * int(here.sum())
            inside = np.flatnonzero(here)
            middle = 0.5 * float(self._v[high] + self._v[low])
            part = (int(inside[0]), int(inside[-1]) + 1)
            # a column counts as felt a slack beyond a row's end: the stroke closes that too
            found.append(self._strip(low, high, part, worth, middle, 3.0 * self._how.stretch))
        return found

    def loud(self, power: float, threshold: float, tolerance: float, *, tails: bool) -> list[Strip]:
        """Return the parts of strips where much is expected.

        Args:
            power: With which errors count.
            threshold: Error that is much [m].
            tolerance: Error that a detail may leave: its largest [m]; for power 2 the sum of its squared errors
                over the area [m^4].
            tails: Also where the error is likely to be the ringing of a detail that has closer rows already.
        """
        found: list[Strip] = []
        step = self._width
        every = self._error if tails else self._firm
        for high, low in self._pairs():
            gap, error = float(self._v[high] - self._v[low]), every[high]
            total = np.concatenate([[0.0], np.cumsum(error**power) * step * gap])
            for begin, end in _runs(self._below[high] == low, 1):
                inside = np.zeros(len(error), bool)
                inside[begin:end] = error[begin:end] > max(
                    threshold, _ERROR_THRESHOLD * float(error[begin:end].max())
                )
                # what lies between two loud places closer than the gap is worth the distance between them
                for first, last in _runs(inside, max(int(gap / step), 1)):
                    worth = float(total[last] - total[first])
                    found.append(self._detail(low, high, (first, last), worth, power, tolerance))
        return found

    def cells(self, *, tails: bool = True) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return expected errors [m], gaps [m] and areas [m^2] of all that lies between rows, shape (n,)."""
        inside = self._below >= 0
        gap = self._gap[inside]
        return (self._error if tails else self._firm)[inside], gap, gap * self._width

    def _detail(
        self, low: int, high: int, part: tuple[int, int], worth: float, power: float, tolerance: float
    ) -> Strip:
        """Return the stroke for a loud part.

        The rows themselves say what distance a detail asks for. Where that is less than half the gap, the stroke
        goes this far from the row that felt more, and only as far along as that row felt it over this distance:
        halving would lay rows where the detail no longer is.
        """
        gap, inside = float(self._v[high] - self._v[low]), slice(*part)
        breadth = min(self._width * (part[1] - part[0]), gap)  # taken to be as broad as it is long
        count = 2
        while count < _MAX_ROWS and gap / count > _MIN_SPACING:
            left = np.maximum(self._along_row(low, gap / count), self._along_row(high, gap / count))[inside]
            rest = float(left.max()) if power > 2.0 else float((left**2).sum()) * self._width * breadth
            if rest <= tolerance:
                break
            count += 1
        if count == 2:
            middle = 0.5 * float(self._v[low] + self._v[high])
            return self._strip(low, high, part, worth, middle, _STROKE_MARGIN * gap)
        step = gap / count
        below, above = self._along_row(low, 2.0 * step)[inside], self._along_row(high, 2.0 * step)[inside]
        up = float((below**2).sum()) >= float((above**2).sum())
        felt = below if up else above
        loud = np.flatnonzero(felt > _ERROR_THRESHOLD * felt.max())
        if len(loud):
            part = (part[0] + int(loud[0]), part[0] + int(loud[-1]) + 1)
        v = float(self._v[low]) + step if up else float(self._v[high]) - step
        return self._strip(low, high, part, worth, v, _FLANK_MARGIN * step)

    def _mark_tails(
        self, tail: npt.NDArray[np.bool_], error: FloatArray, here: npt.NDArray[np.bool_], gap: float
    ) -> None:
        """Mark where the error falls off from the end of a closer row: the detail is there, not here."""
        band = max(int(_TAIL_GAPS * gap / self._width), 1)
        for begin, end in _runs(here, 1):
            stop, start = min(begin + band, end), max(end - band, begin)
            if begin > 0 and error[stop - 1] <= _ERROR_THRESHOLD * error[begin]:
                tail[begin:stop] = True
            if end < len(error) and error[start] <= _ERROR_THRESHOLD * error[end - 1]:
                tail[start:end] = True

    def _strip(
        self, low: int, high: int, part: tuple[int, int], worth: float, v: float, beside: float = 0.0
    ) -> Strip:
        begin, end = float(self._edges[part[0]]), float(self._edges[part[1]])
        return Strip(begin, end, float(self._v[low]), float(self._v[high]), worth, v, beside)

    def _pairs(self) -> list[tuple[int, int]]:
        """Neighbouring rows, the upper one first, as places in the order of v."""
        n = len(self._v)
        upper, column = np.nonzero(self._below >= 0)
        keys = np.unique(upper * n + self._below[upper, column])
        return [(int(key // n), int(key % n)) for key in keys]

    def _flank(self, place: int) -> npt.NDArray[np.bool_]:
        """Where a row felt at least the flank of a detail: how small it is there says little of its height."""
        index = int(self._order[place])
        if index not in self._feet:
            gap, row = self._how.prior, self._rows[index]
            felt = missed_around(row, gap, self._at, 0.0)
            noise = self._how.noise.missed_variance(gap, self._how.stretch)
            inside = felt[(self._at >= row.u[0]) & (self._at <= row.u[-1])]
            usual = float(np.median(inside)) if len(inside) else 0.0  # a row may lie between two columns
            self._feet[index] = (felt**2 > _DETECTION_RATIO * noise) & (felt > _DETAIL_RATIO * usual)
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
