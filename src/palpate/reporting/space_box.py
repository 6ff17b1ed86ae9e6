"""The box that a panel in space shows."""

import numpy as np

from palpate.errors import FloatArray
from palpate.reporting.figure import Space
from palpate.reporting.solids import places

ROOM, FLATTEST = 0.04, 0.12
"""Around what a space shows, and its least height, of its largest extent."""

LEAST = 1e-6
"""Extent of a point [m]."""


def space_box(space: Space) -> FloatArray:
    """Return along each axis the ends of all that is ever shown, shape (3, 2) [m]: no step changes the scale."""
    points = np.concatenate([np.zeros((0, 3)), *map(places, space.marks)])
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        return np.array([[-1e-3, 1e-3]] * 3)
    low, high = points.min(axis=0), points.max(axis=0)
    largest = max(float((high - low).max()), LEAST)
    half = np.maximum(0.5 * (high - low) + ROOM * largest, 0.5 * FLATTEST * largest)
    middle = 0.5 * (low + high)
    return np.column_stack([middle - half, middle + half])
