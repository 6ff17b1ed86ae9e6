"""Whether anything about contacts is impossible: all checks at once, compiled, for every period."""

from typing import Any

from palpate.compiling import njit
from palpate.errors import ORTHONORMAL_TOLERANCE
from palpate.friction.limit_surface import LARGEST_LOAD_EXPONENT

__all__ = ["has_fault"]

FRICTION, SPIN_LENGTH, LEAST, MOST, LOAD_EXPONENT, NORM_EXPONENT, NUMBERS = range(7)
"""Rows of what each contact has as one number; how many there are."""

FINITE = 1.7976931348623157e308
"""The largest float: what is above is infinite, and nothing that is not a number is below."""


@njit(cache=True, error_model="numpy")
def has_fault(positions: Any, frames: Any, each: Any) -> bool:
    """Return whether contacts need to be looked at more closely: any of them cannot be.

    Args:
        positions: Shape (n, 3).
        frames: Shape (n, 3, 3).
        each: mu, c, f_min, f_max, gamma and p of each contact, shape (6, n).
    """
    for i in range(positions.shape[0]):
        for k in range(3):
            if not abs(positions[i, k]) <= FINITE:
                return True
        r = frames[i]
        for a in range(3):
            for b in range(a, 3):
                product = r[0, a] * r[0, b] + r[1, a] * r[1, b] + r[2, a] * r[2, b]
                if not abs(product - (1.0 if a == b else 0.0)) <= ORTHONORMAL_TOLERANCE:
                    return True
        x = r[1, 0] * r[2, 1] - r[2, 0] * r[1, 1]
        y = r[2, 0] * r[0, 1] - r[0, 0] * r[2, 1]
        z = r[0, 0] * r[1, 1] - r[1, 0] * r[0, 1]
        if not x * r[0, 2] + y * r[1, 2] + z * r[2, 2] > 0.0:
            return True
        if not (0.0 < each[FRICTION, i] <= FINITE and 0.0 < each[SPIN_LENGTH, i] <= FINITE):
            return True
        if not (0.0 <= each[LEAST, i] <= FINITE and each[LEAST, i] <= each[MOST, i]):
            return True
        if not (0.0 <= each[LOAD_EXPONENT, i] <= LARGEST_LOAD_EXPONENT and 1.0 <= each[NORM_EXPONENT, i] <= 2.0):
            return True
    return False
