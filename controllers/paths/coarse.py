"""The distance of rows that a surface as a whole asks for, judged from the rows felt so far."""

import math

import numpy as np

from palpate.controllers.paths.goal import GoalError
from palpate.controllers.paths.missed import TouchNoise, missed_around
from palpate.controllers.paths.row import Row
from palpate.errors import FloatArray

LADDER = tuple(2e-3 * 1.15**k for k in range(40))
"""Gaps tried [m]; between two of them the error's law of the fourth power is used."""

SIGNAL = 4.0
"""What rows miss is extrapolated from the gap at which it is this many times the goal: above noise."""

DETAIL = 3.0
"""Where more than this many medians would be missed there is a detail, for strokes of its own. A wave misses at
most 1.4 medians of itself, an ellipsoid's rim twice."""

RIM = 0.008
"""Wanted error over curvature gap^2, for the free sides of the field: between the ends of two rows a smooth map
goes on straight beyond the last contact, and errs by 0.02 curvature gap^2 (spheres of `benchmarks/active.py`:
0.15 mm at R 60 mm and 20 mm). Chosen there with `--tune`, less than half of it: what is wanted here is the goal
after a caution that interpolation needs, and this does not."""

BEND = 5e-3
"""Length over which curvature is taken [m]: normals of 0.13 degrees make it uncertain by 0.6 / m there."""


class CoarseGap:
    """Remembers what rows say about gaps: that does not change."""

    def __init__(self, noise: TouchNoise, stretch: float, spacing: float) -> None:
        """Take the noise of contacts, the stretches they are averaged over [m], and where gaps are tried [m]."""
        self._noise = noise
        self._stretch = stretch
        self._spacing = spacing
        self._missed: dict[tuple[int, float], FloatArray] = {}

    def wanted(self, rows: list[Row], error: float, measure: GoalError, widest: float) -> float:
        """Return the distance of rows at which the error [m] is expected, at most `widest` [m]."""
        if measure is GoalError.LARGEST:
            widest = min(widest, math.sqrt(error / (RIM * max(self._curvature(rows), 1e-6))))
        for gap in LADDER:
            typical = self.typical(rows, gap, measure)
            if typical > SIGNAL * error:
                return min(widest, gap * math.sqrt(math.sqrt(error / typical)))
        return widest

    def _curvature(self, rows: list[Row]) -> float:
        """Return the median curvature along the rows, over enough of them to stand out of noise [1/m]."""
        bends = [np.zeros(0)]
        for row in rows:
            step = max(round(BEND / self._stretch), 1)
            if len(row) > step:
                bends.append(np.abs(row.slope[step:] - row.slope[:-step]) / (row.u[step:] - row.u[:-step]))
        every = np.concatenate(bends)
        return float(np.median(every)) if len(every) else 0.0

    def typical(self, rows: list[Row], gap: float, measure: GoalError) -> float:
        """Return what rows this far apart miss between them where there is no detail [m]."""
        values = [self._along(k, row, gap) for k, row in enumerate(rows)]
        every = np.concatenate(values) if values else np.zeros(0)
        if not len(every):
            return 0.0
        usual = every[every <= DETAIL * np.median(every)]
        if measure is GoalError.RMS:
            return float(np.sqrt(np.mean(usual**2)))
        return float(np.quantile(usual, 0.95))

    def _along(self, index: int, row: Row, gap: float) -> FloatArray:
        key = (index, gap)
        if key not in self._missed:
            known = np.zeros(0)
            if len(row) > 1 and row.u[-1] - row.u[0] >= gap:
                at = np.arange(row.u[0] + 0.5 * gap, row.u[-1] - 0.5 * gap + self._spacing, self._spacing)
                known = missed_around(row, gap, at, self._noise.missed_variance(gap, self._stretch))
            self._missed[key] = known
        return self._missed[key]
