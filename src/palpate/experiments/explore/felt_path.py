"""The finger's path over a surface as it is drawn: with few points, no outlier lost, above what it ran over."""

from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray
from palpate.mapping import TouchCloud

MOST_POINTS = 4000
"""Of a path: more than pixels can resolve."""

BROKEN, LEAST_GAP = 4.0, 0.02
"""The path is broken where neighbours are further apart than this many median distances, and than this share of
the extent."""

LIFT = 0.003
"""Of the extent: the path is drawn so far outside the surface, or either would cover the other here and there."""


@dataclass(frozen=True, slots=True, eq=False)
class FeltPath:
    """A path with NaN in each gap.

    Attributes:
        points: Shape (n, 3) [m].
        error: Of largest size around each, shape (n,) [m].
    """

    points: FloatArray
    error: FloatArray


def felt_path(cloud: TouchCloud, error: FloatArray, *, lift: float = LIFT, dots: bool = False) -> FeltPath:
    """Return the means of at most `MOST_POINTS` stretches of contacts, each with the largest of their errors.

    Args:
        cloud: Of at least one contact.
        error: Of each, shape (n,) [m]; NaN where nobody knows.
        lift: How far outside the surface, of the extent.
        dots: Whether single points are drawn, which need no gaps.
    """
    starts = np.arange(0, len(cloud), -(-len(cloud) // MOST_POINTS))
    count = np.diff(starts, append=len(cloud))[:, np.newaxis]
    position, normal = (np.add.reduceat(each, starts) / count for each in (cloud.position, cloud.normal))
    low, high = np.minimum.reduceat(error, starts), np.maximum.reduceat(error, starts)
    largest = np.where(high > -low, high, low)
    extent = float(np.ptp(cloud.position, axis=0).max())
    points = position + lift * extent * normal
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    if dots or not len(steps):
        return FeltPath(points, largest)
    gaps = np.flatnonzero(steps > max(BROKEN * float(np.median(steps)), LEAST_GAP * extent)) + 1
    return FeltPath(np.insert(points, gaps, np.nan, axis=0), np.insert(largest, gaps, np.nan))
