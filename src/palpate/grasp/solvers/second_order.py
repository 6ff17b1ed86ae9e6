"""Whether a stationary point over cones is a local optimum: the second-order condition on what is free to move."""

from __future__ import annotations

import numpy as np

from palpate.errors import FloatArray
from palpate.grasp.solvers.conic import ConicProgramme, ConicSolution

__all__ = ["descent_within"]

NEGATIVE = 1e-7
"""Curvature, over the largest, below which it is negative."""


def descent_within(
    base: ConicProgramme,
    solution: ConicSolution,
    curvature: FloatArray,
    jacobian: FloatArray,
    multipliers: FloatArray,
) -> FloatArray | None:
    """Return a unit direction in which a stationary point falls, shape (N,); None if there is none.

    Limits with a multiplier above their slack are taken to hold; a cone that is touched away from its apex bends
    by z0 / |s1| across (Bonnans & Ramirez 2005, "Perturbation analysis of second-order cone programming").

    Args:
        base: Limits that are convex; its blocks are the last of the solution's.
        solution: The convex problem at the point.
        curvature: The Lagrangian's Hessian without cones, shape (N, N).
        jacobian: Of further limits, shape (k, N).
        multipliers: Of these.
    """
    s, z = solution.s[-len(base.h) :], solution.z[-len(base.h) :]
    held, bent = [base.A, jacobian[np.abs(multipliers) > NEGATIVE]], curvature.copy()
    for first, end in zip(base.blocks[:-1], base.blocks[1:], strict=True):
        rows = base.G[first:end]
        if end == first + 1:
            if z[first] > s[first]:
                held.append(rows)
        elif z[first] > NEGATIVE and s[first] > NEGATIVE:
            if np.linalg.norm(z[first + 1 : end]) < 0.5 * z[first]:
                continue
            held.append(z[None, first:end] @ rows)
            length = float(np.linalg.norm(s[first + 1 : end]))
            across = rows[1:] - np.outer(s[first + 1 : end], s[first + 1 : end] @ rows[1:]) / length**2
            bent += z[first] / length * across.T @ across
        elif z[first] > s[first]:
            held.append(rows)
    fixed = np.concatenate(held)
    _, values, directions = np.linalg.svd(fixed)
    free = directions[int((values > 1e-9 * values.max(initial=1.0)).sum()) :].T
    if not free.shape[1]:
        return None
    values, vectors = np.linalg.eigh(free.T @ bent @ free)
    if values[0] >= -NEGATIVE * max(float(np.abs(bent).max()), 1.0):
        return None
    return np.asarray(free @ vectors[:, 0])
