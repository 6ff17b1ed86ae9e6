"""scipy's SLSQP on rounded cones, with all derivatives."""

import warnings
from typing import Any

import numpy as np
from scipy.optimize import minimize

from grasp_forces.casadi_solvers import ROUND
from grasp_forces.problem import WEIGHT, Answer, Ended, Load, Problem
from palpate.errors import FloatArray


class Slsqp:
    """SLSQP; warm from its last solution."""

    def __init__(self, problem: Problem) -> None:
        n = len(problem)
        self._columns, self._mu = problem.columns, problem.friction
        self._weights = np.tile([1.0, *[WEIGHT] * 3], n)
        most = [None if not np.isfinite(value) else value for value in problem.most.tolist()]
        self._bounds = [pair for low, high in zip(problem.least.tolist(), most, strict=True)
                        for pair in ((low, high), *[(None, None)] * 3)]  # fmt: skip
        self._start = np.tile([0.5, 0.0, 0.0, 0.0], n)
        self._where = np.arange(n)
        self._found: Any = None

    def _cones(self, x: FloatArray) -> FloatArray:
        rows = x.reshape(-1, 4)
        return self._mu * rows[:, 0] - np.sqrt((rows[:, 1:] ** 2).sum(axis=1) + ROUND**2)

    def _cone_slopes(self, x: FloatArray) -> FloatArray:
        rows = x.reshape(-1, 4)
        used = np.sqrt((rows[:, 1:] ** 2).sum(axis=1) + ROUND**2)
        out = np.zeros((len(rows), *rows.shape))
        out[self._where, self._where] = np.column_stack([self._mu, -rows[:, 1:] / used[:, None]])
        return out.reshape(len(rows), -1)

    def solve(self, load: Load, *, warm: bool) -> None:
        start = self._start if self._found is None or not warm else self._found.x
        columns, weights = self._columns, self._weights
        limits = [
            {"type": "eq", "fun": lambda x: columns @ x + load.scaled, "jac": lambda x: columns},
            {"type": "ineq", "fun": self._cones, "jac": self._cone_slopes},
        ]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            self._found = minimize(
                lambda x: float(weights @ (x * x)),
                start,
                jac=lambda x: 2.0 * weights * x,
                bounds=self._bounds,
                constraints=limits,
                method="SLSQP",
                options={"ftol": 1e-12, "maxiter": 200},
            )

    def answer(self) -> Answer:
        found = self._found
        ended = Ended.SOLVED if found.success else Ended.UNDECIDED
        if found.status == 4:  # "Inequality constraints incompatible"
            ended = Ended.INFEASIBLE
        return Answer(ended, found.x.reshape(-1, 4), evaluations=found.nit)
