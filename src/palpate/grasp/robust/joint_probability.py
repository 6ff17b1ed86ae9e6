"""How many standard deviations keep several correlated margins above zero together."""

import math
from typing import Any

import numpy as np

from palpate.compiling import njit

NODES, WEIGHTS = np.polynomial.legendre.leggauss(16)
"""For Owen's function: its integrand is smooth; 16 points leave 1e-9."""

NEWTON_STEPS = 30
"""Never reached: it takes about 6."""


@njit(cache=True, error_model="numpy")
def owen(h: float, a: float) -> float:
    """Return Owen's T(h, a) = 1 / 2 pi int_0^atan(a) exp(-h^2 / 2 cos^2 x) dx (Owen 1956), a >= 0."""
    end = math.atan(a)
    total = 0.0
    for k in range(NODES.shape[0]):
        c = math.cos(0.5 * end * (1.0 + NODES[k]))
        total += WEIGHTS[k] * math.exp(-0.5 * h * h / (c * c))
    return 0.5 * end * total / (2.0 * math.pi)


@njit(cache=True, error_model="numpy")
def failing(beta: float, ratios: Any) -> float:
    """Return an upper bound of the probability that any of n normal variables exceeds beta.

    Hunter's bound (1976): sum of P_i less those of pairs along the tree of largest correlations. For equal limits
    P_ij = P - 2 T(beta, sqrt((1 - r) / (1 + r))), so it is P + 2 sum T: P if all are one, n P if they are
    opposite.
    """
    out = 0.5 * math.erfc(beta / math.sqrt(2.0))
    for k in range(ratios.shape[0]):
        out += 2.0 * owen(beta, ratios[k])
    return out


@njit(cache=True, error_model="numpy")
def _falling(beta: float, ratios: Any) -> float:
    """Return the slope of `failing`: dT/dh = -exp(-h^2 / 2) erf(a h / sqrt 2) / sqrt(8 pi)."""
    slope = -1.0
    for k in range(ratios.shape[0]):
        slope -= math.erf(ratios[k] * beta / math.sqrt(2.0))
    return slope * math.exp(-0.5 * beta * beta) / math.sqrt(2.0 * math.pi)


@njit(cache=True, error_model="numpy")
def tree_ratios(covariance: Any) -> Any:
    """Return sqrt((1 - r) / (1 + r)) along the tree of largest correlations, shape (n - 1,): Prim's algorithm."""
    n = covariance.shape[0]
    ratios = np.zeros(max(n - 1, 0))
    joined = np.zeros(n, np.bool_)
    closest = np.full(n, -2.0)
    at = 0
    for k in range(n - 1):
        joined[at] = True
        best = -3.0
        following = at
        for j in range(n):
            if joined[j]:
                continue
            both = covariance[at, at] * covariance[j, j]
            r = covariance[at, j] / math.sqrt(both) if both > 0.0 else 0.0
            closest[j] = max(closest[j], min(r, 1.0))
            if closest[j] > best:
                best, following = closest[j], j
        ratios[k] = math.sqrt(max(1.0 - best, 0.0) / max(1.0 + best, 1e-12))
        at = following
    return ratios


@njit(cache=True, error_model="numpy")
def joint_deviations(covariance: Any, failures: float) -> float:
    """Return beta such that all of n normal variables stay above -beta standard deviations.

    Args:
        covariance: (n, n).
        failures: Largest probability that one does not.
    """
    ratios = tree_ratios(covariance)
    # Newton's method on the logarithm, which is concave: from above it stays above
    beta = 4.0
    for _ in range(NEWTON_STEPS):
        p = failing(beta, ratios)
        step = p * math.log(p / failures) / -_falling(beta, ratios)
        beta += step
        if abs(step) < 1e-7:
            break
    return beta
