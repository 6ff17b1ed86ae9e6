"""Where the middle of a fingertip is when it rests on an object from above, on a grid over it."""

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from scipy.interpolate import RegularGridInterpolator
from scipy.ndimage import binary_dilation, grey_dilation

from palpate.errors import FloatArray
from palpate.sim import SceneObject

STEP = 1e-3
"""Distance of grid lines [m]: the rest lies within STEP^2 / (8 R) = 0.02 mm of the truth for a tip of R = 8 mm."""

MOST_LINES = 401
"""Along each side: of larger objects the grid is coarser."""

EXTENTS = (0.05, 0.1, 0.25, 0.5, 1.0, 2.0)
"""Half sides of the square that are tried [m], until the object lies inside."""

SURVEYED = 41
"""Grid lines along each side of those."""


@dataclass(frozen=True, slots=True, eq=False)
class TipSurface:
    """Heights of the middle of the tip.

    Where the tip meets nothing they go on level, a tip below the object; where nobody knows, they are NaN.

    Attributes:
        x: Grid lines, increasing, shape (n,) [m].
        y: Likewise, shape (m,) [m].
        z: Heights, shape (m, n) [m].
        met: Where the tip meets the object, shape (m, n).
        reach: How far beside its middle the tip may touch [m].
    """

    x: FloatArray
    y: FloatArray
    z: FloatArray
    met: np.ndarray[tuple[int, int], np.dtype[np.bool_]]
    reach: float

    @classmethod
    def of(cls, target: SceneObject, tip: tuple[float, ...]) -> Self:
        """Return it for a tip of one (radius) or three (semi-axes) half lengths [m]: a dilation."""
        half = tip if len(tip) == 3 else tip * 3
        room = _extent(target) + max(half) + 2.0 * STEP
        step = max(STEP, 2.0 * room / (MOST_LINES - 1))
        count = int(np.ceil(room / step))
        x: FloatArray = step * np.arange(-count, count + 1, dtype=np.float64)
        height = np.asarray(target.height(*np.meshgrid(x, x)))
        beside = target.bottom - 2.0 * max(half)
        height = np.where(np.isnan(height), beside - half[2], height)
        u, v = (step * np.arange(-int(h / step), int(h / step) + 1) / h for h in half[:2])
        inside = 1.0 - np.add.outer(v**2, u**2)
        cap = half[2] * np.sqrt(np.maximum(inside, 0.0))
        dilation: Any = grey_dilation  # whose stubs want whole numbers
        z: FloatArray = dilation(height, structure=cap, footprint=inside >= 0.0, mode="nearest")
        met = z > beside + 1e-9
        return cls(x, x, np.where(met, z, beside), met, max(half))

    @property
    def top(self) -> float:
        """Its largest height [m]."""
        return float(np.nanmax(self.z))

    def within(self, x: float, y: float) -> Self:
        """Return what is known of it only at most `x` and `y` [m] from the middle, less the tip's own reach."""
        reach = self.reach
        known = np.logical_and.outer(np.abs(self.y) <= y - reach, np.abs(self.x) <= x - reach)
        return replace(self, z=np.where(known, self.z, np.nan), met=self.met & known)

    def steepness(self, beside: float = np.nan) -> FloatArray:
        """Return the tangent of its slope, shape (m, n); `beside` the object and at its rim."""
        z = np.where(self.met, self.z, np.nan)
        slope_y, slope_x = np.gradient(z, self.y, self.x)
        slope = np.hypot(slope_x, slope_y)
        rim = binary_dilation(np.isfinite(self.z) & ~self.met)
        return np.asarray(np.where(np.isnan(slope) & rim, beside, slope))

    def at(self, points: FloatArray) -> FloatArray:
        """Return heights at places (n, 2), shape (n,) [m]; beside the grid those of its rim."""
        inside = np.clip(points, [self.x[0], self.y[0]], [self.x[-1], self.y[-1]])
        return np.asarray(RegularGridInterpolator((self.y, self.x), self.z)(inside[:, ::-1]))

    def meets(self, points: FloatArray) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Return whether the tip meets the object at places (n, 2), shape (n,)."""
        columns = np.rint((points[:, 0] - self.x[0]) / (self.x[1] - self.x[0])).astype(int)
        rows = np.rint((points[:, 1] - self.y[0]) / (self.y[1] - self.y[0])).astype(int)
        known = (columns >= 0) & (columns < len(self.x)) & (rows >= 0) & (rows < len(self.y))
        found = np.zeros(len(points), dtype=np.bool_)
        found[known] = self.met[rows[known], columns[known]]
        return found


def _extent(target: SceneObject) -> float:
    """Half side of a square about the origin in which the object lies, seen from above [m]."""
    for extent in EXTENTS[:-1]:
        along = np.linspace(-extent, extent, SURVEYED)
        known = np.isfinite(target.height(*np.meshgrid(along, along)))
        if known.any() and not (known[[0, -1]].any() or known[:, [0, -1]].any()):
            return extent
    return EXTENTS[-1]
