"""Whether multipliers prove that no forces hold a load, in exact arithmetic.

y . (G w + w_ext) is linear in the forces of each contact; within its limits the least of it is known in closed
form: with (g_n, g_1, g_2, g_3) = y . (columns of G), g_3 times e, it is f (g_n - mu |g_u|) at f_min or f_max. All
numbers are floats, so fractions; only |g_u| is no fraction, and is rounded up. Nothing of how y was found enters.
"""

import math
from fractions import Fraction

import numpy as np

from palpate.errors import FloatArray
from palpate.grasp.problem.cone_form import CoupledProgramme
from palpate.grasp.problem.contacts import GraspContacts
from palpate.grasp.problem.limits import CoupledLimits
from palpate.grasp.problem.scaled import ScaledGrasp
from palpate.grasp.solvers.conic import ConicSolution

__all__ = ["certified_reach", "limits_exclude_each_other", "proof_from"]

LARGEST_FORCES = 1e8
"""Sum of forces, in units of load or preload, for which a proof must hold where f_max is infinite: to rounding,
none is without doubt for all."""

_ROOT_BITS = 100
"""Binary places of |g_u|."""


def certified_reach(
    grasp: GraspContacts,
    wrench: FloatArray,
    y: FloatArray,
    implied: tuple[list[Fraction], Fraction] | None = None,
) -> float:
    """Return up to which normal force of contacts without a largest one y proves that the load is not held.

    Args:
        grasp: Contacts whose limits are cones.
        wrench: The load about the object's origin, shape (6,) [N, N m].
        y: Multipliers of wrenches about the object's origin, shape (6,).
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


def proof_from(
    grasp: GraspContacts,
    scaled: ScaledGrasp,
    wrench: FloatArray,
    limits: CoupledLimits,
    programme: CoupledProgramme,
    solution: ConicSolution,
) -> tuple[FloatArray | None, float | None]:
    """Return a unit certificate and its reach [N] from a solution's multipliers; None if they prove nothing.

    Args:
        grasp: Contacts whose limits are cones.
        scaled: The same contacts, scaled.
        wrench: The load about the object's origin, shape (6,) [N, N m].
        limits: Limits beyond those of the contacts.
        programme: The problem that was solved last by `solution`.
        solution: Infeasible, or the largest load factor.
    """
    turned = scaled.multiplier(solution.y[:6])
    length = float(np.linalg.norm(turned))
    if not 0.0 < length < math.inf:
        return None, None
    reach = _reach(grasp, wrench, limits, programme, solution, turned)
    return (turned / length, reach) if reach >= LARGEST_FORCES * programme.size else (None, None)


def limits_exclude_each_other(
    grasp: GraspContacts,
    wrench: FloatArray,
    limits: CoupledLimits,
    programme: CoupledProgramme,
    solution: ConicSolution,
) -> bool:
    """Return whether multipliers of limits alone prove that no forces keep them all, whatever the load."""
    return _reach(grasp, wrench, limits, programme, solution, np.zeros(6)) > 0.0


def _reach(
    grasp: GraspContacts,
    wrench: FloatArray,
    limits: CoupledLimits,
    programme: CoupledProgramme,
    solution: ConicSolution,
    y: FloatArray,
) -> float:
    by_equation, by_row = programme.weights
    unit = programme.size / (float(np.linalg.norm(y)) or 1.0)
    implied = limits.implied(solution.y[6:] * by_equation * unit, solution.z[programme.first :] * by_row * unit)
    return certified_reach(grasp, wrench, y * (unit / programme.size), implied)


def _root_above(square: Fraction) -> Fraction:
    """Return a fraction that is at least the square root, and hardly more."""
    if square == 0:
        return Fraction(0)
    scaled = (square.numerator << (2 * _ROOT_BITS)) * square.denominator
    return Fraction(math.isqrt(scaled) + 1, square.denominator << _ROOT_BITS)
