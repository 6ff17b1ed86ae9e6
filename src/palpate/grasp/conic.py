"""Conic problems: a convex quadratic under limits that couple any unknowns, in numbers of about one.

    least  x'P x / 2 + q'x   with   A x = b,   s = h - G x in blocks of cones

From nowhere an interior point solves them, or proves that nothing does; from a point nearby Newton's method on the
optimality conditions, ten times faster, and to rounding.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Any

import numpy as np

from palpate.errors import FloatArray
from palpate.grasp.conic_equations import columns_of
from palpate.grasp.conic_interior import solve_conic
from palpate.grasp.conic_newton import NEARLY, newton_steps

__all__ = ["ConicOutcome", "ConicProgramme", "ConicSolution"]

NEWTON_STEPS = 10
"""Three to six are usual."""


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
        x, y = np.zeros(self.q.size), np.zeros(self.b.size)
        s, z = np.zeros(self.h.size), np.zeros(self.h.size)
        columns, where = columns_of(self.G, self.blocks)
        given = (self.P, self.q, self.A, self.b, self.G, self.h, self.blocks, columns, where)
        outcome, iterations, error = solve_conic(*given, x, y, s, z)
        return ConicSolution(ConicOutcome(outcome), x, y, s, z, iterations, error)

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
        error: Residuals and gap of the interior point over their tolerances; of Newton's method, residuals.
    """

    outcome: ConicOutcome
    x: FloatArray
    y: FloatArray
    s: FloatArray
    z: FloatArray
    iterations: int
    error: float
