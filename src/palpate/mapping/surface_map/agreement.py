"""Cross-validation of the model between rows, and the factor by which its deviations are wrong.

Likelihoods look at neighbours along the path and hardly see how far noise keeps: with a correlation length of
half or twice the truth (and its variance, fitted to it) they fit, while a row errs by up to 1.2 or 0.65 times
what is claimed. A row's noise, though, is not that of the rows beside it. So each row is left out of a patch, its
height predicted from the others, and the miss compared with what the model expects of it. In the notation of
Rasmussen & Williams (2006), eq. 5.12, for a group g of the data: the miss is B a_g with B = (K^-1)_gg^-1 and
a = K^-1 y, and its covariance is B.

Only what passes the middle of a patch is compared: there the patch speaks, and there a miss is made of noise and
of the bend of the surface in the same parts as the map's error. (Means over whole rows see hardly anything but
the noise, and widened the band of a box with rounded edges until it held 0.999.)

Rows far apart say less: without one of them a gap of twice their distance is to be bridged, and what is expected
of a miss is then mostly what is not known of the surface there. A calm surface crosses such a gap with smaller
misses than any prior that is wide enough elsewhere; that says nothing of the noise, so it does not narrow
deviations. Where misses over such gaps are larger than expected, they widen.
"""

import itertools
import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.linalg.lapack import dtrtrs

from palpate.errors import FloatArray

BoolArray = npt.NDArray[np.bool_]

ROW_GAP = 3.0
"""Stretches of one row follow one another; where the path between two is longer than so many median steps, it has
left the patch and come back."""

MIN_IN_ROW = 3
"""Stretches that make a row: fewer are its end, at the rim of a patch."""

MIN_OTHERS = 6
"""Stretches that must be left to predict a row from: as many as a quadratic surface has coefficients."""

LARGEST_SQUARE = 9.0
"""A miss counts for three deviations at most, where most rows miss as expected: a step or an edge tells of the
surface, not of noise. Where most rows miss by more, for three of theirs: then it is the model that is wrong."""

MEDIAN_SQUARE = 0.4549
"""Median of the square of a standard normal variable (chi^2 of one degree of freedom)."""

MIN_OWN_SHARE = 0.5
"""A row is well predicted where its own noise is at least so much of the variance that is expected of its miss:
the others then know its place as well as it does itself. Rows 1 mm apart show 0.76 to 0.95, 6 mm apart mostly less
than 0.35 (`benchmarks/surface_maps.py`'s shapes and a torus of 60 and 25 mm)."""

PRIOR_ROWS = 10.0
"""Rows by which the model is believed beforehand: two or three patches."""

SMALLEST, LARGEST = 0.5, 6.0
"""Limits of `Agreement.factor`: contacts without noise have no size. Rows 2 mm apart over facets
as wide miss by up to 5 times what a smooth surface would."""


@dataclass(frozen=True, slots=True)
class Agreement:
    """How far rows are off the prediction from their neighbours.

    Attributes:
        near: Squared misses of rows that were well predicted, in units of what was expected.
        far: Those of rows that were predicted over gaps too wide to tell of their noise.
    """

    near: tuple[float, ...] = ()
    far: tuple[float, ...] = ()

    @classmethod
    def of(
        cls,
        path: FloatArray,
        middle: BoolArray,
        noise: FloatArray,
        lower: FloatArray,
        weights: FloatArray,
        widened: float,
    ) -> "Agreement":
        """Return that of one patch.

        Args:
            path: Where its n stretches lie along the path, increasing, shape (n,) [m].
            middle: Which of them pass the middle of the patch, shape (n,).
            noise: Covariance of what errs in their heights, shape (n, n).
            lower: Cholesky factor of the covariance of their heights and slopes, shape (3 n, 3 n).
            weights: Inverse of that covariance times the data, shape (3 n,).
            widened: Factor on variances that is claimed already.
        """
        n = len(path)
        ends = [0, *row_starts(path), n]
        if len(ends) == 2 or not middle.any():
            return cls()
        squares: tuple[list[float], list[float]] = [], []
        for i, j in itertools.pairwise(ends):
            passing = middle[i:j].astype(np.float64)
            if j - i < MIN_IN_ROW or n - (j - i) < MIN_OTHERS or not passing.any():
                continue
            # heights only: slopes of the row itself say nothing about its mean height
            half, _ = dtrtrs(lower, np.eye(3 * n, j - i, -i), lower=1)
            # with w = B 1 over what passes: the sum of misses w.a, its variance 1.w
            w = np.linalg.solve(half.T @ half, passing)
            expected = float(w @ passing)
            far = float(passing @ noise[i:j, i:j] @ passing) < MIN_OWN_SHARE * expected
            squares[far].append(float(w @ weights[i:j]) ** 2 / (expected * widened))
        near, beyond = squares
        return cls(tuple(near), tuple(beyond))

    @classmethod
    def pooled(cls, several: Iterable["Agreement"]) -> "Agreement":
        """Return that of several patches together."""
        listed = list(several)
        return cls(
            tuple(itertools.chain.from_iterable(each.near for each in listed)),
            tuple(itertools.chain.from_iterable(each.far for each in listed)),
        )

    @property
    def factor(self) -> float:
        """By which deviations that the model claims are to be multiplied; 1 while nothing is known."""
        square = PRIOR_ROWS + _sum(self.near) + max(_sum(self.far), float(len(self.far)))
        factor = math.sqrt(square / (PRIOR_ROWS + len(self.near) + len(self.far)))
        return min(max(factor, SMALLEST), LARGEST)


def _sum(squares: tuple[float, ...]) -> float:
    """Return the sum of squared misses, none of them counted for more than `LARGEST_SQUARE` says."""
    if not squares:
        return 0.0
    usual = max(1.0, float(np.median(squares)) / MEDIAN_SQUARE)
    return float(np.minimum(squares, LARGEST_SQUARE * usual).sum())


def row_starts(path: FloatArray) -> list[int]:
    """Return where rows begin among stretches that lie at `path` (n,) [m], increasing; the first is left out."""
    steps = np.diff(path)
    if not len(steps):
        return []
    return [int(each) + 1 for each in np.flatnonzero(steps > ROW_GAP * float(np.median(steps)))]
