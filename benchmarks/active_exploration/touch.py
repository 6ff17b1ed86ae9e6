"""Contacts along a path, with the errors of a tip that feels: 500 Hz, 20 mm/s."""

import math
from itertools import pairwise

import numpy as np
from scipy.signal import lfilter

from active_exploration.shapes import Shape

HEIGHT_SD, CORRELATION, NORMAL_SD = 0.03, 1.0, math.radians(0.5)
STEP = 20.0 / 500.0
STRETCH = 15  # contacts, 0.6 mm
HEIGHT_VARIANCE = HEIGHT_SD**2 * 2.0 * CORRELATION / (STRETCH * STEP)  # effective number, as independent
SLOPE_VARIANCE = NORMAL_SD**2 / STRETCH


def feel(shape: Shape, corners: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Contacts along a polygon, columns x, y, z, dz/dx, dz/dy."""
    pieces = []
    for a, b in pairwise(corners):
        n = max(int(np.linalg.norm(b - a) / STEP), 2)
        pieces.append(a + ((np.arange(n) + 0.5) / n)[:, None] * (b - a))
    xy = np.concatenate(pieces)
    keep = math.exp(-STEP / CORRELATION)
    white = rng.normal(size=len(xy)) * math.sqrt(1 - keep * keep)
    white[0] = rng.normal()
    z, zx, zy = shape(*xy.T)
    tilt = NORMAL_SD * rng.normal(size=(2, len(xy)))
    slant = np.sqrt(1 + zx**2 + zy**2)
    z = z + HEIGHT_SD * slant * lfilter([1.0], [1.0, -keep], white)
    return np.column_stack([xy, z, zx + slant * tilt[0], zy + slant * tilt[1]])


def means(contacts: np.ndarray) -> np.ndarray:
    """Means over stretches, shape (5, n)."""
    size = min(STRETCH, len(contacts))
    n = len(contacts) // size
    return contacts[: n * size].reshape(n, size, 5).mean(axis=1).T
