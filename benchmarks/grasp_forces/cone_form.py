"""The problem as a cone programme, and solvers that take it: clarabel, ecos, scs.

minimise x'P x / 2 + q'x    with    A x + s = b,   s = 0, >= 0, or in second-order cones of (room, u1, u2, u3)
"""

from dataclasses import dataclass
from typing import Any

import clarabel
import numpy as np
from scipy import sparse

from grasp_forces.problem import WEIGHT, Answer, Ended, Load, Problem
from palpate.errors import FloatArray
from palpate.grasp import Objective

TOLERANCE = 1e-8
"""Of every solver that takes one: the gap asked of palpate."""


@dataclass(frozen=True, slots=True, eq=False)
class ConeForm:
    """One objective of one grasp; unknowns are x, and theta where the objective has one.

    Attributes:
        quadratic: Diagonal of P.
        linear: q.
        matrix: A: six equations, then the limits >= 0, then four rows for each cone.
        right: b; the first six are minus the load, or zero where theta multiplies it.
        rows: Number of limits.
    """

    quadratic: FloatArray
    linear: FloatArray
    matrix: FloatArray
    right: FloatArray
    rows: int

    @classmethod
    def of(cls, problem: Problem, objective: Objective) -> "ConeForm":
        n = len(problem)
        has_theta = objective is not Objective.MIN_EFFORT
        size = 4 * n + has_theta
        normal = np.zeros((n, size))
        normal[np.arange(n), 4 * np.arange(n)] = 1.0
        bounded = np.isfinite(problem.most)
        limits, right = [-normal, normal[bounded]], [-problem.least, problem.most[bounded]]
        if objective is Objective.MIN_PEAK:
            peak = normal.copy()
            peak[:, -1] = -1.0
            limits.append(peak)
            right.append(np.zeros(n))
        cones = np.zeros((4 * n, size))
        cones[np.arange(4 * n), np.arange(4 * n)] = -1.0
        cones[4 * np.arange(n), 4 * np.arange(n)] = -problem.friction
        if objective is Objective.MAX_MARGIN:
            cones[::4, -1] = 1.0
        equations = np.zeros((6, size))
        equations[:, : 4 * n] = problem.columns
        linear, quadratic = np.zeros(size), np.zeros(size)
        if has_theta:
            linear[-1] = 1.0 if objective is Objective.MIN_PEAK else -1.0
        else:
            quadratic[:] = np.tile([2.0, *[2.0 * WEIGHT] * 3], n)
        rows = sum(len(each) for each in right)
        return cls(
            quadratic,
            linear,
            np.vstack([equations, *limits, cones]),
            np.concatenate([np.zeros(6), *right, np.zeros(4 * n)]),
            rows,
        )


class ClarabelDirect:
    """Clarabel by its own interface; warm means that its workspace is kept (it has no warm start)."""

    STATUS = ({"Solved"}, {"PrimalInfeasible"})

    def __init__(self, problem: Problem, objective: Objective, tolerance: float = TOLERANCE) -> None:
        self._form, self._n = ConeForm.of(problem, objective), len(problem)
        self._scales_load = objective is Objective.LOAD_FACTOR
        self._how = clarabel.DefaultSettings()
        self._how.verbose = False
        self._how.max_threads = 1
        # problems whose data change must not be presolved: data updates are refused then
        self._how.presolve_enable = False
        self._how.tol_gap_abs = self._how.tol_gap_rel = self._how.tol_feas = tolerance
        self._quadratic = sparse.diags(self._form.quadratic, format="csc")
        full = self._form.matrix.copy()
        if self._scales_load:
            full[:6, -1] = 1.0
        self._matrix = sparse.csc_matrix(full)
        kinds = [clarabel.ZeroConeT(6), clarabel.NonnegativeConeT(self._form.rows)]
        self._kinds = kinds + [clarabel.SecondOrderConeT(4)] * self._n
        self._right = self._form.right.copy()
        self._solver: Any = None
        self._found: Any = None

    def solve(self, load: Load, *, warm: bool) -> None:
        if self._scales_load:
            last = self._matrix.indptr[-2]
            self._matrix.data[last : last + 6] = load.scaled
        else:
            self._right[:6] = -load.scaled
        if not warm or self._solver is None:
            self._solver = clarabel.DefaultSolver(
                self._quadratic, self._form.linear, self._matrix, self._right, self._kinds, self._how
            )
        elif self._scales_load:
            self._solver.update(A=self._matrix.data)
        else:
            self._solver.update(b=self._right)
        self._found = self._solver.solve()

    @property
    def multipliers(self) -> FloatArray:
        """Of equilibrium, shape (6,)."""
        return np.array(self._found.z[:6])

    def answer(self) -> Answer:
        x, status = np.array(self._found.x), str(self._found.status)
        theta = float(x[-1]) if len(x) % 4 else 0.0
        return Answer(_ended(status, *self.STATUS), x[: 4 * self._n].reshape(-1, 4), theta, self._found.iterations)


class Ecos:
    """ecos: it takes linear objectives only, so the square root of the effort is what it makes least."""

    def __init__(self, problem: Problem) -> None:
        import ecos

        self._solve, self._n = ecos.solve, len(problem)
        form = ConeForm.of(problem, Objective.MIN_EFFORT)
        size = 4 * self._n
        wide = np.pad(form.matrix, ((0, 0), (0, 1)))
        effort = np.zeros((size + 1, size + 1))
        effort[0, -1] = -1.0
        effort[1:, :-1] = -np.diag(np.sqrt(0.5 * form.quadratic))
        self._equations = sparse.csc_matrix(wide[:6])
        self._limits = sparse.csc_matrix(np.vstack([wide[6:], effort]))
        self._right = np.concatenate([form.right[6:], np.zeros(size + 1)])
        self._cones = {"l": form.rows, "q": [4] * self._n + [size + 1]}
        self._cost = np.eye(size + 1)[-1].copy()
        self._found: Any = None

    def solve(self, load: Load, *, warm: bool) -> None:
        self._found = self._solve(
            self._cost,
            self._limits,
            self._right,
            self._cones,
            self._equations,
            -load.scaled,
            verbose=False,
            abstol=TOLERANCE,
            reltol=TOLERANCE,
            feastol=TOLERANCE,
        )

    def answer(self) -> Answer:
        info = self._found["info"]
        ended = {0: Ended.SOLVED, 1: Ended.INFEASIBLE}.get(info["exitFlag"], Ended.UNDECIDED)
        return Answer(ended, self._found["x"][:-1].reshape(-1, 4), evaluations=info["iter"])


class Scs:
    """scs, a splitting method of first order; warm from its last solution."""

    STATUS = ({"solved"}, {"infeasible"})

    def __init__(self, problem: Problem) -> None:
        import scs

        form = ConeForm.of(problem, Objective.MIN_EFFORT)
        self._right, self._n = form.right.copy(), len(problem)
        data = {
            "P": sparse.diags(form.quadratic, format="csc"),
            "A": sparse.csc_matrix(form.matrix),
            "b": self._right,
            "c": form.linear,
        }
        cone = {"z": 6, "l": form.rows, "q": [4] * self._n}
        how: Any = {"verbose": False, "eps_abs": TOLERANCE, "eps_rel": TOLERANCE, "max_iters": 20_000}
        self._solver = scs.SCS(data, cone, **how)
        self._found: Any = None

    def solve(self, load: Load, *, warm: bool) -> None:
        self._right[:6] = -load.scaled
        self._solver.update(b=self._right)
        self._found = self._solver.solve(warm_start=warm)

    def answer(self) -> Answer:
        info = self._found["info"]
        x = self._found["x"].reshape(-1, 4)
        return Answer(_ended(info["status"], *self.STATUS), x, evaluations=info["iter"])


def _ended(status: str, solved: set[str], infeasible: set[str]) -> Ended:
    if status in solved:
        return Ended.SOLVED
    return Ended.INFEASIBLE if status in infeasible else Ended.UNDECIDED
