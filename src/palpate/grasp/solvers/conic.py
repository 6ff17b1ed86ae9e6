"""Conic problems: a convex quadratic under limits that couple any unknowns, in numbers of about one.

    least  x'P x / 2 + q'x   with   A x = b,   s = h - G x in blocks of cones

Clarabel solves them without a start, or proves that they have no solution. Newton's method on the optimality
conditions sharpens its solution to rounding, and solves a problem near the last one ten times faster.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import IntEnum
from itertools import groupby
from typing import Any

import clarabel
import numpy as np
from scipy import sparse

from palpate.errors import FloatArray
from palpate.grasp.solvers.conic_newton import NEARLY, newton_steps

__all__ = ["ConicOutcome", "ConicProgramme", "ConicSolution"]

NEWTON_STEPS = 10
"""Three to six are usual."""

TOLERANCE = 1e-10
"""Residuals and gap asked of clarabel."""


class ConicOutcome(IntEnum):
    """How it ended."""

    SOLVED = 1
    UNDECIDED = 0
    INFEASIBLE = -1
    UNBOUNDED = -2


@dataclass(frozen=True, slots=True, eq=False)
class ConicProgramme:
    """The problem, with numbers of about one.

    Attributes:
        P: Shape (N, N); positive semidefinite, unless Newton's method alone is asked.
        q: Shape (N,).
        A: Shape (e, N).
        b: Shape (e,).
        G: Shape (m, N).
        h: Shape (m,).
        blocks: Where blocks of rows of G begin, then m; blocks of one row are numbers >= 0.
    """

    P: FloatArray
    q: FloatArray
    A: FloatArray
    b: FloatArray
    G: FloatArray
    h: FloatArray
    blocks: Any

    def solve(self) -> ConicSolution:
        """Return the optimum, or a proof that there is none."""
        equations, m = self.b.size, self.h.size
        solver = clarabel.DefaultSolver(
            sparse.csc_matrix(np.triu(self.P)),
            self.q,
            sparse.csc_matrix(np.concatenate([self.A, self.G])),
            np.concatenate([self.b, self.h]),
            _cones(equations, np.diff(self.blocks).tolist()),
            _settings(),
        )
        found = solver.solve()
        outcome = _OUTCOMES.get(str(found.status), ConicOutcome.UNDECIDED)
        x, multipliers, s = np.array(found.x), np.array(found.z), np.array(found.s)[equations:]
        y, z = multipliers[:equations], multipliers[equations:]
        if outcome == ConicOutcome.INFEASIBLE:
            unit = -(self.b @ y + self.h @ z)
            return ConicSolution(outcome, x, y / unit, np.zeros(m), z / unit, found.iterations, math.inf)
        if outcome == ConicOutcome.UNBOUNDED:
            return ConicSolution(outcome, x / -(self.q @ x), y, s, z, found.iterations, math.inf)
        rough = ConicSolution(outcome, x, y, s, z, found.iterations, math.inf)
        sharp = self.near(rough)
        if sharp.outcome == ConicOutcome.SOLVED:
            return replace(sharp, iterations=found.iterations + sharp.iterations)
        return replace(rough, error=max(found.r_prim, found.r_dual) / TOLERANCE)

    def near(self, start: ConicSolution, steps: int = NEWTON_STEPS) -> ConicSolution:
        """Return where Newton's method comes from a start, s and z in cones and without work on each other.

        It is SOLVED if it meets the optimality conditions to 1e-10 of the sizes of what they consist of. Otherwise
        nothing is known of it.
        """
        x, y, r = start.x.copy(), start.y.copy(), start.s - start.z
        s, z = np.empty(r.size), np.empty(r.size)
        given = (self.P, self.q, self.A, self.b, self.G, self.h, self.blocks)
        try:
            error, used = newton_steps(*given, x, y, r, s, z, steps)
        except np.linalg.LinAlgError:  # singular, or not finite
            return replace(start, outcome=ConicOutcome.UNDECIDED, error=math.inf)
        outcome = ConicOutcome.SOLVED if error <= NEARLY else ConicOutcome.UNDECIDED
        return ConicSolution(outcome, x, y, s, z, used, error)


@dataclass(frozen=True, slots=True, eq=False)
class ConicSolution:
    """What was found.

    Attributes:
        outcome: How it ended.
        x: Shape (N,); if unbounded a direction in which the objective falls for ever.
        y: Multipliers of A x = b, shape (e,): P x + q + A'y + G'z = 0. If infeasible, with z, a proof: A'y + G'z =
            0 and b'y + h'z = -1.
        s: Shape (m,).
        z: Multipliers of s, shape (m,).
        iterations: How many.
        error: Residuals of Newton's method; of clarabel alone, over its tolerance.
            Infinite without a solution.
    """

    outcome: ConicOutcome
    x: FloatArray
    y: FloatArray
    s: FloatArray
    z: FloatArray
    iterations: int
    error: float


_OUTCOMES = {
    "Solved": ConicOutcome.SOLVED,
    "PrimalInfeasible": ConicOutcome.INFEASIBLE,
    "AlmostPrimalInfeasible": ConicOutcome.INFEASIBLE,
    "DualInfeasible": ConicOutcome.UNBOUNDED,
}


def _cones(equations: int, sizes: list[int]) -> list[Any]:
    """Return clarabel's cones: equations, then the blocks in their order."""
    cones: list[Any] = [clarabel.ZeroConeT(equations)]
    for size, blocks in groupby(sizes):
        count = len(list(blocks))
        cones += [clarabel.NonnegativeConeT(count)] if size == 1 else [clarabel.SecondOrderConeT(size)] * count
    return cones


def _settings() -> Any:
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_threads = 1
    settings.presolve_enable = False
    settings.tol_feas = settings.tol_gap_abs = settings.tol_gap_rel = TOLERANCE
    return settings
