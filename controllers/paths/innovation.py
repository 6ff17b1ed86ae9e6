"""The innovation of a row: what was measured minus what its neighbours predict, and the error it implies.

Between two rows the map is about the cubic Hermite polynomial through their heights and cross slopes. A row
between them tests it: where rows at distances a below and b above predict a height that is off by r, the
surface's fourth derivative across is 24 r / (a b)^2; the strips that remain err by a^4 / 384 or b^4 / 384 of it
(error of Hermite interpolation, Stoer & Bulirsch, Numerical Analysis, 2.1.5). Unlike what is judged along rows,
this sees a seam that runs beside them.
"""

import numpy as np
import numpy.typing as npt

from palpate.controllers.paths.missed import CROSS, TouchNoise
from palpate.errors import FloatArray

UNEVEN = 2.0
"""Most that one distance counts over the other: beyond it noise would be blown up."""

LEFT = 8.0
"""Ratio of the prediction error of a row to what then remains between it and its neighbours, at equal distances.
By the law above 16; but a detail as narrow as the gap does not follow it yet, and a seam would be left half
felt."""

CLOSE = 1e-4
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

    Args:
        v: Where the rows are, increasing, shape (n,) [m].
        height: On the columns, shape (n, m) [m].
        cross_slope: dh/dv, shape (n, m).
        below: The next row below that covers the column, -1: none or not covered; shape (n, m).
        noise: Of the contacts.
        width: Of columns [m].
    """
    n, m = height.shape
    left = np.zeros((n, m))
    column = np.arange(m)
    upper, at = np.nonzero(below >= 0)
    middle = below[upper, at]
    lower = below[middle, at]
    # two strokes may share a line where they overlap by a stretch: they say nothing of each other
    inner = (lower >= 0) & (v[middle] - v[lower] > CLOSE) & (v[upper] - v[middle] > CLOSE)
    upper, middle, lower, at = upper[inner], middle[inner], lower[inner], at[inner]
    if not len(upper):
        return left
    a, b = v[middle] - v[lower], v[upper] - v[middle]
    t, g = a / (a + b), a + b
    predicted, slope = _hermite(
        t, g, height[lower, at], height[upper, at], cross_slope[lower, at], cross_slope[upper, at]
    )
    off = (height[middle, at] - predicted) ** 2 + (CROSS * g * (cross_slope[middle, at] - slope)) ** 2
    # three rows of independent noise; the outer two count for a half each in the middle
    off -= 1.5 * (noise.height**2 + (CROSS * g * noise.slope) ** 2)
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
    error = np.sqrt(np.maximum(mean, 0.0))[middle, at] / LEFT
    np.maximum.at(left, (middle, at), error * np.minimum(a / b, UNEVEN) ** 2)
    np.maximum.at(left, (upper, at), error * np.minimum(b / a, UNEVEN) ** 2)
    return left


def _hermite(
    t: FloatArray, gap: FloatArray, h0: FloatArray, h1: FloatArray, s0: FloatArray, s1: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return value and derivative at t in (0, 1) of the cubic with these end heights and slopes."""
    w = 1.0 - t
    value = h0 * w * w * (1 + 2 * t) + h1 * t * t * (3 - 2 * t) + gap * t * w * (s0 * w - s1 * t)
    slope = 6 * t * w * (h1 - h0) / gap + s0 * w * (1 - 3 * t) + s1 * t * (3 * t - 2)
    return value, slope
