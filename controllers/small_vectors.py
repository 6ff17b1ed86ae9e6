"""Vectors of three in compiled code: as `palpate.spatial` has them, and with the same bits."""

import math
from collections.abc import Callable
from typing import cast

from palpate import spatial
from palpate.compiling import njit
from palpate.spatial import Vector

dot = cast("Callable[[Vector, Vector], float]", njit(spatial.dot))
add_scaled = cast("Callable[[Vector, float, Vector], Vector]", njit(spatial.add_scaled))

SPLITTER = 2.0**27 + 1.0
"""Cuts a double into halves of 26 bits, whose products are exact (Veltkamp 1968)."""


@njit(cache=True)
def length(x: float, y: float, z: float) -> float:
    """Return the Euclidean length, rounded as `math.hypot` does.

    The sum of the squares is kept to twice the precision (Dekker 1971, Numer. Math. 18, 224-242) and the root
    corrected by what is left. Without it the last bit would differ from that of Python's own, one time in four.
    """
    total, rest = 0.0, 0.0
    for value in (x, y, z):
        square = value * value
        upper = SPLITTER * value
        upper -= upper - value
        lower = value - upper
        missing = ((upper * upper - square) + 2.0 * upper * lower) + lower * lower
        before = total
        total = before + square
        back = total - before
        rest += ((before - (total - back)) + (square - back)) + missing
    root = math.sqrt(total)
    if root == 0.0:
        return root
    upper = SPLITTER * root
    upper -= upper - root
    lower = root - upper
    left = ((total - upper * upper) - 2.0 * upper * lower) - lower * lower
    return root + (left + rest) / (2.0 * root)


@njit(cache=True)
def unit(a: Vector) -> Vector:
    """Return a / |a|.

    Raises:
        ZeroDivisionError: a is zero and has no direction.
    """
    factor = 1.0 / length(a[0], a[1], a[2])
    return (factor * a[0], factor * a[1], factor * a[2])
