"""How much rows some distance apart would miss, judged from what was felt along one row.

Rows a gap apart leave the surface between them to interpolation from heights and slopes. A row is felt densely,
so it tells what such interpolation would miss **along** it: the error of the cubic Hermite polynomial over the
same gap. Detail is taken to be as fine across the rows as along them.
"""

from dataclasses import dataclass

import numpy as np

from palpate.controllers.paths.row import Row
from palpate.errors import FloatArray, not_negative, positive

CROSS = 0.125
"""Error in height per gap and cross slope: as end slopes count in Hermite interpolation."""


@dataclass(frozen=True, slots=True)
class TouchNoise:
    """Random errors of contacts along a path.

    Attributes:
        height: Standard deviation of a contact along its normal [m].
        correlation: Length of path over which that error stays alike [m].
        slope: Standard deviation of a stretch's mean normal [rad].
    """

    height: float = 3.0e-5
    correlation: float = 1.0e-3
    slope: float = 2.3e-3

    def __post_init__(self) -> None:
        not_negative("height noise", self.height, "m")
        positive("correlation length", self.correlation, "m")
        not_negative("slope noise", self.slope, "rad")

    def missed_variance(self, gap: float, stretch: float) -> float:
        """Return the variance that noise alone gives `missed` at a gap, at most [m^2].

        The profile is a sum of slopes, so its second difference over the gap has stretch * gap / 4 times their
        variance; then the slopes at both ends count gap / 8, and the cross slopes `CROSS` gap. That the slopes at
        the ends are also part of the profile is left out: it takes off a tenth at 20 stretches, a quarter at 8.
        """
        return self.slope**2 * (0.25 * stretch * gap + gap * gap / 32.0 + 1.5 * (CROSS * gap) ** 2)


def missed(row: Row, gap: float, at: FloatArray) -> FloatArray:
    """Return what interpolation over `gap` centred at `at` misses, shape (n,) [m].

    Two errors are taken together: of the profile, its cubic Hermite interpolation, and of the cross slope, its
    mean over both ends. The second tells of detail beside the row. NaN where the row does not reach half a gap to
    both sides.
    """
    u = row.u
    if len(row) < 2:
        return np.full(len(at), np.nan)
    low, high = at - 0.5 * gap, at + 0.5 * gap
    # rows begin and end within a stretch of where they were meant to: there the profile goes on straight
    slack = 1.5 * (u[1] - u[0])
    longer = np.concatenate([[u[0] - slack], u, [u[-1] + slack]])
    profile = row.profile
    profile = np.concatenate([[-slack * row.slope[0]], profile, [profile[-1] + slack * row.slope[-1]]])
    across = 0.5 * (np.interp(low, longer, profile) + np.interp(high, longer, profile))
    across += 0.125 * gap * (np.interp(low, u, row.slope) - np.interp(high, u, row.slope))
    along = np.interp(at, longer, profile) - across
    cross = row.cross_slope
    aside = np.interp(at, u, cross) - 0.5 * (np.interp(low, u, cross) + np.interp(high, u, cross))
    error = np.hypot(along, CROSS * gap * aside)
    error[(low < u[0] - slack) | (high > u[-1] + slack)] = np.nan
    return np.asarray(error)


def missed_around(row: Row, gap: float, at: FloatArray, noise: float) -> FloatArray:
    """Return the root mean square of `missed` within a quarter of a gap, less what noise gives, shape (n,) [m].

    Where rows lie relative to a detail is chance, so its error is averaged over where they could. Values at the
    ends of the row repeat the last that is known; all are zero if the row is shorter than the gap.

    Args:
        row: What was felt.
        gap: Distance of rows [m].
        at: Evenly spaced places along it, shape (n,) [m].
        noise: Variance of `missed` from noise [m^2].
    """
    error = missed(row, gap, at)
    known = np.isfinite(error)
    if not known.any() or len(at) < 2:
        return np.zeros(len(at))
    square = np.interp(at, at[known], error[known] ** 2)
    half = max(int(0.25 * gap / (at[1] - at[0])), 1)
    total = np.concatenate([[0.0], np.cumsum(square)])
    index = np.arange(len(at))
    begin, end = np.maximum(index - half, 0), np.minimum(index + half + 1, len(at))
    return np.asarray(np.sqrt(np.maximum((total[end] - total[begin]) / (end - begin) - noise, 0.0)))
