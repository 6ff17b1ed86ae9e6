"""The least effort that holds a load, from newtons and metres to newtons and metres in one compiled call."""

import math
from enum import IntEnum
from typing import Any

import numpy as np

from palpate.compiling import njit
from palpate.errors import FloatArray
from palpate.grasp.problem.scaled import ScaledGrasp, scale_load
from palpate.grasp.solvers.dual_newton import FARKAS, LO, ROW, descend

__all__ = ["LeastEffort", "Outcome", "least_violation"]

MIN_WEIGHT = 1e-10
"""Least weight of effort against the square of what is left, both over the load's."""

NO_LESS = 0.999
"""Ends where a tenth of the weight leaves more than this share of what was left."""

WEIGHT_STEP = 0.1
"""From one weight to the next: each is within a few Newton steps of the last."""

EVALUATIONS_PER_WEIGHT = 40
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
        descend(rows, load, effort_weight, kappa, origin, 1e-6 * kappa, EVALUATIONS_PER_WEIGHT, y, forces, work)
        # the gradient is kappa y - (A x + b): what is left follows without another sum
        residual = kappa * y - work[12, :6]
        size, before = float(np.linalg.norm(residual)), best
        if size < best:
            best, kept, left = size, forces.copy(), residual
        if not size < NO_LESS * before:
            break
        kappa *= WEIGHT_STEP
    return kept, left


TOLERANCE = 1e-11
"""Largest entry of A x + b, over the load, at which it counts as solved."""

ENOUGH = 1e-9
"""The same where rounding keeps from going on."""

GAP = 1e-9
"""The gap that then may be between the objective and its lower bound, over the objective."""

MAX_EVALUATIONS = 60
"""Evaluations: of what is not solved by then, a hundredth ever is."""


class Outcome(IntEnum):
    """What `LeastEffort.solve` returns."""

    SOLVED = 1
    UNDECIDED = 0
    INFEASIBLE = -1


@njit(cache=True, error_model="numpy")
def _solve(
    rows: Any,
    center: Any,
    length: float,
    wrench: Any,
    eps: float,
    y: Any,
    scaled: Any,
    forces: Any,
    work: Any,
    out: Any,
) -> tuple[int, int]:
    """Solve; fill y (scaled), forces (n, 4) [N, N m], and `out`: residual, objective, load's size, margins."""
    n = rows.shape[0]
    load = work[15]
    cx, cy, cz = center[0], center[1], center[2]
    size = scale_load(rows, center, length, wrench, load)
    out[7] = size
    for i in range(n):
        for k in range(LO):
            scaled[i, k] = rows[i, k]
        for k in range(LO, ROW):
            scaled[i, k] = rows[i, k] / size
    used, left = descend(scaled, load, eps, 0.0, load, TOLERANCE, MAX_EVALUATIONS, y, forces, work)
    effort = 0.0
    rx, ry, rz, mx, my, mz = wrench[0], wrench[1], wrench[2], wrench[3], wrench[4], wrench[5]
    for i in range(n):
        u1, u2, u3 = forces[i, 1] * size, forces[i, 2] * size, forces[i, 3] * size
        f = forces[i, 0] * size + rows[i, 16]
        effort += f * f + eps * (u1 * u1 + u2 * u2 + u3 * u3)
        spin = u3 * rows[i, 12] * length
        forces[i, 0], forces[i, 1], forces[i, 2], forces[i, 3] = f, u1, u2, spin
        px, py, pz = rows[i, 0] * length + cx, rows[i, 1] * length + cy, rows[i, 2] * length + cz
        fx = f * rows[i, 3] + u1 * rows[i, 6] + u2 * rows[i, 9]
        fy = f * rows[i, 4] + u1 * rows[i, 7] + u2 * rows[i, 10]
        fz = f * rows[i, 5] + u1 * rows[i, 8] + u2 * rows[i, 11]
        rx += fx
        ry += fy
        rz += fz
        mx += py * fz - pz * fy + spin * rows[i, 3]
        my += pz * fx - px * fz + spin * rows[i, 4]
        mz += px * fy - py * fx + spin * rows[i, 5]
        out[8 + i] = rows[i, 13] * f - math.sqrt(u1 * u1 + u2 * u2 + u3 * u3)
    out[0], out[1], out[2], out[3], out[4], out[5] = rx, ry, rz, mx, my, mz
    out[6] = effort
    gap = 0.0  # the primal less the dual objective
    for k in range(6):
        gap += y[k] * work[12, k]
    if used > 0 or (left <= ENOUGH and abs(gap) <= GAP * (effort / size / size)):
        return 1, abs(used)
    return (-1 if work[12, FARKAS] > 0.0 else 0), abs(used)


class LeastEffort:
    """Dual semismooth Newton steps for one grasp, warm from one load to the next.

    Attributes:
        y: Multipliers of equilibrium, scaled, shape (6,): the next start.
        out: Of the last solution: residual (6,) [N, N m], objective [N^2], unit of force [N], margins (n,) [N].
    """

    def __init__(self, scaled: ScaledGrasp, effort_weight: float) -> None:
        """Take a grasp whose limits are cones, and eps."""
        n = len(scaled.rows)
        self._weight = effort_weight
        self._scaled = np.zeros_like(scaled.rows)
        self._work = np.zeros((16, 7))
        self.y = np.zeros(6)
        self.out = np.zeros(8 + n)
        self.update(scaled)

    def __len__(self) -> int:
        """Number of contacts."""
        return len(self._scaled)

    def update(self, scaled: ScaledGrasp) -> None:
        """Take the same number of contacts, moved."""
        self._grasp = scaled

    def solve(self, wrench: FloatArray, forces: FloatArray) -> tuple[int, int]:
        """Fill forces (n, 4) [N, N, N, N m]; return the outcome and how many evaluations it took.

        Args:
            wrench: What else acts on the object, about its origin, shape (6,) [N, N m].
            forces: Array for the result.
        """
        grasp = self._grasp
        return _solve(
            grasp.rows,
            grasp.center,
            grasp.length,
            wrench,
            self._weight,
            self.y,
            self._scaled,
            forces,
            self._work,
            self.out,
        )
