"""Whether multipliers prove that no forces hold a load, in exact arithmetic.

y . (G w + w_ext) is linear in the forces of each contact; within its limits the least of it is known in closed
form: with (g_n, g_1, g_2, g_3) = y . (columns of G), g_3 times e, it is f (g_n - mu |g_u|) at f_min or f_max. All
numbers are floats, so fractions; only |g_u| is no fraction, and is rounded up. Nothing of how y was found enters.
"""

import math
from fractions import Fraction

from palpate.errors import FloatArray
from palpate.grasp.contacts import GraspContacts

__all__ = ["certified_reach"]

_ROOT_BITS = 100
"""Binary places of |g_u|."""


def certified_reach(
    grasp: GraspContacts,
    wrench: FloatArray,
    y: FloatArray,
    actuators: FloatArray | None = None,
    implied: tuple[list[Fraction], Fraction] | None = None,
) -> float:
    """Return up to which normal force of contacts without a largest one y proves that the load is not held.

    Args:
        grasp: Contacts whose limits are cones.
        wrench: The load about the object's origin, shape (6,) [N, N m].
        y: Multipliers of wrenches about the object's origin, shape (6,).
        actuators: Multipliers of J w <= limit and -J w <= limit by turns, shape (n, 2 k); None for none.
        implied: a and b of a . w <= b, which holds within further limits for all forces w = (w_1, ..., w_n).

    Returns:
        The sum of such forces [N]: infinite if it needs no bound, 0 if y proves nothing.
    """
    if not all(map(math.isfinite, (*y.tolist(), *wrench.tolist()))):
        return 0.0
    p, q, r, u, v, w = map(Fraction, y.tolist())
    proven = sum((a * Fraction(b) for a, b in zip((p, q, r, u, v, w), wrench.tolist(), strict=True)), Fraction(0))
    short = Fraction(0)
    if implied is not None:
        proven -= implied[1]
    for i, (place, frame) in enumerate(zip(grasp.positions.tolist(), grasp.frames.tolist(), strict=True)):
        x, s, z = map(Fraction, place)
        # what a force there is worth
        worth = (p + v * z - w * s, q + w * x - u * z, r + u * s - v * x)
        axes = [[Fraction(row[k]) for row in frame] for k in range(3)]
        slope = [sum((a * b for a, b in zip(worth, axis, strict=True)), Fraction(0)) for axis in axes]
        slope.append(u * axes[0][0] + v * axes[0][1] + w * axes[0][2])
        if actuators is not None and grasp.actuator_map is not None and grasp.actuator_limit is not None:
            for k, (row, limit) in enumerate(
                zip(grasp.actuator_map[i].tolist(), grasp.actuator_limit[i].tolist(), strict=True)
            ):
                up, down = (Fraction(max(float(each), 0.0)) for each in actuators[i, 2 * k : 2 * k + 2])
                if up == down or math.isinf(limit):
                    continue
                slope = [a + (up - down) * Fraction(b) for a, b in zip(slope, row, strict=True)]
                proven -= (up + down) * Fraction(limit)
        if implied is not None:
            slope = [a + b for a, b in zip(slope, implied[0][4 * i : 4 * i + 4], strict=True)]
        slope[3] *= Fraction(float(grasp.spin_length[i]))
        least = slope[0] - Fraction(float(grasp.friction[i])) * _root_above(
            sum((g * g for g in slope[1:]), Fraction(0))
        )
        most = float(grasp.force_max[i])
        if least >= 0:
            proven += least * Fraction(float(grasp.force_min[i]))
        elif math.isinf(most):
            short = max(short, -least)
        else:
            proven += least * Fraction(most)
    if proven <= 0:
        return 0.0
    if short == 0:
        return math.inf
    reach = proven / short
    return float(reach) if reach < Fraction(10) ** 300 else math.inf


def _root_above(square: Fraction) -> Fraction:
    """Return a fraction that is at least the square root, and hardly more."""
    if square == 0:
        return Fraction(0)
    scaled = (square.numerator << (2 * _ROOT_BITS)) * square.denominator
    return Fraction(math.isqrt(scaled) + 1, square.denominator << _ROOT_BITS)
