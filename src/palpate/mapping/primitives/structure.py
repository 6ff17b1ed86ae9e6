"""Whether residuals are noise, or have the shape of something that the fit has missed."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import KDTree

from palpate.errors import FloatArray

IndexArray = npt.NDArray[np.intp]

NEIGHBOURS = 6
"""Neighbours in space that a residual is compared with."""

NOT_NOISE = 0.5
"""Share of the mean square of residuals that neighbours have in common, from which on most of it is shape. A row
pushed out as a whole, or a sensor a little off, stays below."""

SIGMAS = 5.0
"""Standard deviations of that share under noise alone that count as chance."""

LAG = 3.0
"""Contacts closer along the path than so many correlation lengths share their noise, and are not compared."""


@dataclass(frozen=True, slots=True)
class Structure:
    """How much of the residuals neighbours have in common: about 0 for noise, near 1 for a shape that was missed.

    Attributes:
        of_distance: Of distances.
        of_tilt: Of normals.
        limit: What noise stays below.
    """

    of_distance: float
    of_tilt: float
    limit: float

    @property
    def is_shape(self) -> bool:
        """Whether the residuals are not noise."""
        return max(self.of_distance, self.of_tilt) > self.limit


def residual_structure(
    points: FloatArray, distance: FloatArray, tilt: FloatArray, correlation_points: float
) -> Structure:
    """Return the share that residuals of neighbours in space, but not along the path, have in common.

    Moran's I ("Notes on continuous stochastic phenomena", 1950): the mean product of neighbours over the mean
    square. No size of the noise enters.

    Args:
        points: Shape (n, 3), in the order they were felt.
        distance: Residual distances, shape (n,).
        tilt: Residual normals, shape (n, 3).
        correlation_points: Over how many points of the path errors are alike.
    """
    count = len(points)
    lag = LAG * correlation_points if correlation_points > 1.0 else 0.0
    wanted = min(count, 1 + NEIGHBOURS + 2 * math.ceil(lag))
    near = np.asarray(KDTree(points).query(points, wanted)[1]).reshape(count, -1)
    i = np.repeat(np.arange(count), near.shape[1])
    j = near.ravel()
    apart = np.abs(i - j) > lag
    apart &= i != j
    # the nearest few of those that are left
    rank = np.cumsum(apart.reshape(near.shape), axis=1).ravel()
    apart &= rank <= NEIGHBOURS
    i, j = i[apart], j[apart]
    if not len(i):
        return Structure(0.0, 0.0, 1.0)
    # each pair counted about twice; a correlation over c points leaves 1 / c of them
    chance = SIGMAS * math.sqrt(2.0 * correlation_points / len(i))
    return Structure(
        of_distance=_common(distance[:, np.newaxis], i, j),
        of_tilt=_common(tilt, i, j),
        limit=min(max(NOT_NOISE, chance), 0.95),
    )


def _common(residual: FloatArray, i: IndexArray, j: IndexArray) -> float:
    product = (residual[i] * residual[j]).sum()
    square = 0.5 * ((residual[i] ** 2).sum() + (residual[j] ** 2).sum())
    return float(product / square) if square > 0.0 else 0.0
