"""Contacts along straight strokes, and what rows some distance apart would miss between them."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from palpate.errors import FloatArray, not_negative, positive


@dataclass(frozen=True, slots=True, eq=False)
class FeltRow:
    """Heights and slopes along a straight stroke at constant v, in the plane of the path.

    They are those of the surface on which the origin of the tip frame moves, parallel to the object's: its height
    is a function of where the tip is, and the normal of the contact is its normal.

    Attributes:
        v: Where the stroke runs [m].
        u: Middles of the stretches, increasing, shape (n,) [m].
        height: Shape (n,) [m].
        slope: dh/du, shape (n,).
        cross_slope: dh/dv, shape (n,).
    """

    v: float
    u: FloatArray
    height: FloatArray
    slope: FloatArray
    cross_slope: FloatArray

    def __len__(self) -> int:
        """Number of stretches."""
        return len(self.u)

    @property
    def profile(self) -> FloatArray:
        """Heights from the slopes alone, shape (n,) [m]: right but for a constant.

        Normals err far less over a few millimetres than heights do: 0.5 degrees per contact are 3 um over 5 mm,
        where the heights of contacts differ by 30 um.
        """
        steps = 0.5 * np.diff(self.u) * (self.slope[1:] + self.slope[:-1])
        return np.concatenate([[0.0], np.cumsum(steps)])

    @classmethod
    def of(cls, v: float, stretches: list[tuple[float, float, float, float]]) -> Self:
        """Return the row of (u, height, slope, cross slope) in any order."""
        table = np.array(stretches, dtype=np.float64).reshape(-1, 4)
        table = table[np.argsort(table[:, 0], kind="stable")]
        return cls(v, table[:, 0], table[:, 1], table[:, 2], table[:, 3])


class RowRecorder:
    """Averages contacts over stretches, one call per period."""

    def __init__(self, stretch: float) -> None:
        """Take the length of a stretch [m]."""
        self._stretch = stretch
        self._stretches: list[tuple[float, float, float, float]] = []
        self._begin = 0.0
        self._count = 0
        self._u = self._h = self._hu = self._hv = 0.0

    def feel(self, u: float, height: float, slope: float, cross_slope: float) -> None:
        """Take one period."""
        if self._count and abs(u - self._begin) >= self._stretch:
            self._close()
        if not self._count:
            self._begin = u
        self._count += 1
        self._u += u
        self._h += height
        self._hu += slope
        self._hv += cross_slope

    def take(self, v: float) -> FeltRow:
        """Return the row since the last call, and start again."""
        self._close()
        row = FeltRow.of(v, self._stretches)
        self._stretches = []
        return row

    def _close(self) -> None:
        n = self._count
        if n:
            self._stretches.append((self._u / n, self._h / n, self._hu / n, self._hv / n))
        self._count = 0
        self._u = self._h = self._hu = self._hv = 0.0


CROSS_WEIGHT = 0.125
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
        variance; then the slopes at both ends count gap / 8, and the cross slopes `CROSS_WEIGHT` gap. The slopes
        at the ends are also part of the profile. Leaving that out adds a tenth at 20 stretches, a quarter at 8.
        """
        return self.slope**2 * (0.25 * stretch * gap + gap * gap / 32.0 + 1.5 * (CROSS_WEIGHT * gap) ** 2)


def missed(row: FeltRow, gap: float, at: FloatArray) -> FloatArray:
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
    error = np.hypot(along, CROSS_WEIGHT * gap * aside)
    error[(low < u[0] - slack) | (high > u[-1] + slack)] = np.nan
    return np.asarray(error)


def missed_around(row: FeltRow, gap: float, at: FloatArray, noise: float) -> FloatArray:
    """Return the root mean square of `missed` within a quarter of a gap, less what noise gives, shape (n,) [m].

    Where rows lie relative to a detail is chance, so its error is averaged over where they could. Values at the
    ends of the row repeat the last that is known; all are zero if the row is shorter than the gap.

    Args:
        row: Means along the row.
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
