"""Forces within all limits that leave least of a load, for a load that nothing holds."""

import numpy as np

from palpate.errors import FloatArray
from palpate.grasp.solvers.dual_newton import descend

__all__ = ["least_violation"]

MIN_WEIGHT = 1e-10
"""Least weight of effort against the square of what is left, both over the load's."""

NO_LESS = 0.999
"""Ends where a tenth of the weight leaves more than this share of what was left."""

STEP = 0.1
"""From one weight to the next: each is within a few Newton steps of the last."""

MAX_EVALUATIONS = 40
"""Evaluations at each weight; they take 3 to 10, up to 30 where contacts are without a largest force."""


def least_violation(rows: FloatArray, load: FloatArray, effort_weight: float) -> tuple[FloatArray, FloatArray]:
    """Return scaled forces (n, 4) and what they leave of the load, (6,).

    min |A x + b|^2 / 2 + kappa sum f^2 + eps |u|^2 over cones and bounds, kappa falling from 1. Its dual has a
    quadratic term, so that every step exists, whatever the grasp.

    Args:
        rows: Contacts, shape (n, ROW), all scaled.
        load: Scaled, shape (6,).
        effort_weight: eps.
    """
    y, forces, work, origin = np.zeros(6), np.zeros((len(rows), 4)), np.zeros((16, 7)), np.zeros(6)
    kappa = 1.0
    best = np.inf
    kept, left = forces.copy(), y
    while kappa >= 0.99 * MIN_WEIGHT:
        descend(rows, load, effort_weight, kappa, origin, 1e-6 * kappa, MAX_EVALUATIONS, y, forces, work)
        # the gradient is kappa y - (A x + b): what is left follows without another sum
        residual = kappa * y - work[12, :6]
        size, before = float(np.linalg.norm(residual)), best
        if size < best:
            best, kept, left = size, forces.copy(), residual
        if not size < NO_LESS * before:
            break
        kappa *= STEP
    return kept, left
