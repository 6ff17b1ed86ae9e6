"""The p-norm of two lengths, p >= 1, and its normals: the shape of a limit surface at one normal force."""

import math


def p_norm(a: float, b: float, p: float) -> float:
    """Return |(a, b)|_p of a, b >= 0, without overflow."""
    if p == 2.0:
        return math.hypot(a, b)
    if p == 1.0:
        return a + b
    small, large = (a, b) if a < b else (b, a)
    if large == 0.0 or large == math.inf:
        return large + small  # not `large`: what is not a number compares as the smaller
    return large * float((1.0 + (small / large) ** p) ** (1.0 / p))


def dual_point(a: float, b: float, p: float) -> tuple[float, float]:
    """Return the point x, y >= 0 of the unit p-norm whose normal points along (a, b), a and b >= 0.

    For p = 1 that is a corner of the diamond, or, if its whole edge faces that direction, the middle of the edge.
    Without direction it is (0, 0).
    """
    largest = max(a, b)
    if largest == 0.0:
        return 0.0, 0.0
    if p == 2.0:
        length = math.hypot(a, b)
        return a / length, b / length
    if p == 1.0:
        return (1.0, 0.0) if a > b else (0.0, 1.0) if a < b else (0.5, 0.5)
    # the normal is (x, y)^(p-1)
    x, y = (a / largest) ** (1.0 / (p - 1.0)), (b / largest) ** (1.0 / (p - 1.0))
    length = p_norm(x, y, p)
    return x / length, y / length
