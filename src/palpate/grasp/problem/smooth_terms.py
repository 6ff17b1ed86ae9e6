"""Own objectives and limits that are not convex, or not known to be: compiled, with their derivatives."""

from __future__ import annotations

from typing import Any

import casadi
import numpy as np

from palpate.errors import FloatArray
from palpate.grasp.solvers.compiled import Compiled, in_place

__all__ = ["SmoothTerms"]

SX = casadi.SX


class SmoothTerms:
    """What is not convex, or not known to be: an objective, equations and limits <= 0, with derivatives.

    Attributes:
        count: How many equations and limits.
        is_equation: Which of them are = 0, shape (count,).
        names: What a message calls them.
        has_objective: Whether the objective is among it; otherwise that is 0.
    """

    def __init__(
        self, w: Any, objective: Any | None, terms: list[tuple[Any, bool, str]], names: tuple[str, ...]
    ) -> None:
        """Derive and compile."""
        self.count, self.names, self.has_objective = len(terms), names, objective is not None
        self.is_equation = np.array([equation for _, equation, _ in terms], dtype=bool)
        f = SX(0) if objective is None else objective
        g = casadi.vertcat(SX(0, 1), *[term for term, _, _ in terms])
        multipliers = SX.sym("multipliers", self.count)
        lagrangian = f + casadi.dot(multipliers, g)
        wanted = [f, casadi.gradient(f, w), g, casadi.jacobian(g, w), casadi.hessian(lagrangian, w)[0]]
        once: Any = casadi.cse([casadi.densify(each) for each in wanted])
        (function,) = Compiled().prepare([casadi.Function("own_terms", [w, multipliers], once)])
        n = w.numel()
        self._given = np.zeros(n), np.zeros(self.count)
        # CasADi's matrices are column-major
        shapes: list[tuple[int, ...]] = [(1,), (n,), (self.count,), (n, self.count), (n, n)]
        self._found = [np.zeros(shape) for shape in shapes]
        self._call = in_place(function, list(self._given), self._found)

    def __call__(
        self, w: FloatArray, multipliers: FloatArray
    ) -> tuple[float, FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return value and gradient of the objective, the terms, their Jacobian, and the Lagrangian's Hessian.

        Args:
            w: Shape (4 n,).
            multipliers: Shape (count,).
        """
        self._given[0][:], self._given[1][:] = w, multipliers
        self._call()
        f, slope, g, jacobian, hessian = self._found
        return float(f[0]), slope.copy(), g.copy(), jacobian.T.copy(), hessian.copy()
