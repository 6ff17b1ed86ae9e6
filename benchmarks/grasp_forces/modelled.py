"""cvxpy with parameters: the problem compiled once, clarabel behind it."""

from typing import Any

import numpy as np

from grasp_forces.cone_form import TOLERANCE
from grasp_forces.problem import WEIGHT, Answer, Ended, Load, Problem


class Cvxpy:
    """cvxpy, load as a parameter; warm means that the compiled problem is kept."""

    def __init__(self, problem: Problem) -> None:
        import cvxpy

        self._cvxpy, self._problem = cvxpy, problem
        self._built: Any = None

    def _build(self) -> Any:
        cvxpy, problem = self._cvxpy, self._problem
        n = len(problem)
        x, load = cvxpy.Variable((n, 4)), cvxpy.Parameter(6)
        limits = [problem.columns @ cvxpy.vec(x, order="C") + load == 0]
        limits += [cvxpy.SOC(problem.friction[i] * x[i, 0], x[i, 1:]) for i in range(n)]
        limits.append(x[:, 0] >= problem.least)
        bounded = np.flatnonzero(np.isfinite(problem.most))
        if len(bounded):
            limits.append(x[bounded, 0] <= problem.most[bounded])
        effort = cvxpy.sum_squares(x[:, 0]) + WEIGHT * cvxpy.sum_squares(x[:, 1:])
        return cvxpy.Problem(cvxpy.Minimize(effort), limits), x, load

    def solve(self, load: Load, *, warm: bool) -> None:
        if self._built is None:
            self._built = self._build()
        model, _, parameter = self._built
        parameter.value = load.scaled
        how = {"tol_gap_abs": TOLERANCE, "tol_gap_rel": TOLERANCE, "tol_feas": TOLERANCE}
        try:
            model.solve(solver="CLARABEL", warm_start=warm, max_threads=1, **how)
        except self._cvxpy.error.SolverError:
            model._status = "solver_error"

    def answer(self) -> Answer:
        model, x, _ = self._built
        ended = {"optimal": Ended.SOLVED, "infeasible": Ended.INFEASIBLE}.get(model.status, Ended.UNDECIDED)
        found = np.full((len(self._problem), 4), np.nan) if x.value is None else np.array(x.value)
        return Answer(ended, found)
