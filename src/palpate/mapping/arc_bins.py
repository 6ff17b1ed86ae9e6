"""Cutting the path of a finger into short stretches, without bridging gaps or rounding edges."""

import math

import numpy as np
import numpy.typing as npt

from palpate.compiling import njit
from palpate.errors import FloatArray

IndexArray = npt.NDArray[np.intp]
BoolArray = npt.NDArray[np.bool_]

LARGEST_TURN = math.radians(30.0)
"""How far normals may turn within one stretch [rad]. On a smooth surface a stretch turns by spacing / R, a
few degrees; at an edge the normal jumps while the finger hardly moves, and a mean over it would round the
edge off. It also keeps the mean of the unit normals longer than cos(30 degrees), so that it has a
direction."""


def stretch_starts(
    time: FloatArray, position: FloatArray, normal: FloatArray, spacing: float, longest_pause: float
) -> IndexArray:
    """Return where each stretch begins: consecutive contacts that stay within `spacing` of their first one.

    The distance is taken from the first contact of the stretch instead of being summed from step to step,
    since noise would lengthen a sum: a finger at rest would fill one stretch after the other. A jump, a pause
    in time and a turn of the normal by more than `LARGEST_TURN` end a stretch too.

    Args:
        time: When each contact was felt, not decreasing, shape (n,) [s].
        position: Points on the surface in path order, shape (n, 3) [m].
        normal: Unit normals there, shape (n, 3).
        spacing: Length of a stretch [m].
        longest_pause: Longest time between neighbours of one stretch [s].

    Returns:
        Index of the first contact of each stretch, increasing, shape (m,); empty if n is 0.
    """
    if len(time) == 0:
        return np.zeros(0, dtype=np.intp)
    paused = np.diff(time, prepend=time[0]) > longest_pause
    return np.flatnonzero(_begins(np.hstack([position, normal]), paused, spacing, math.cos(LARGEST_TURN)))


@njit(cache=True)
def _begins(contacts: FloatArray, paused: BoolArray, spacing: float, cos_turn: float) -> BoolArray:
    """Return which contacts, rows of position and normal, begin a stretch: each depends on the one before."""
    begins = np.zeros(len(contacts), np.bool_)
    first = 0
    for i in range(len(contacts)):
        square = cos = 0.0
        for k in range(3):
            step = contacts[i, k] - contacts[first, k]
            square += step * step
            cos += contacts[i, 3 + k] * contacts[first, 3 + k]
        if i == 0 or paused[i] or math.sqrt(square) >= spacing or cos < cos_turn:
            begins[i], first = True, i
    return begins


def stretch_means(values: FloatArray, starts: IndexArray) -> FloatArray:
    """Return the mean of `values` (n, ...) over each stretch, shape (m, ...)."""
    counts = np.diff(np.append(starts, len(values)))
    sums = np.add.reduceat(values, starts, axis=0)
    return np.asarray(sums / counts.reshape(-1, *(1,) * (values.ndim - 1)), dtype=np.float64)
