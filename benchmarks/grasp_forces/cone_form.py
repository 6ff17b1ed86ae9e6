"""The problem as a cone programme, and convex solvers: clarabel, ecos, scs, cvxpy, and daqp on facets.

minimise x'P x / 2 + q'x    with    A x + s = b,   s = 0, >= 0, or in second-order cones of (room, u1, u2, u3)
"""

from dataclasses import dataclass
from typing import Any

import clarabel
import numpy as np
from scipy import sparse
from scipy.spatial import ConvexHull

from grasp_forces.problem import WEIGHT, Answer, Ended, Load, Problem
from palpate.errors import FloatArray
from palpate.grasp import Objective

TOLERANCE = 1e-8
"""Tolerance of every solver that takes one: the gap asked of palpate."""

FACETS, RELAX, STEP = 16, 2000, 0.05
"""Facets of a cone, and iterations and step in which their normals spread evenly."""

EQUATION = 5
"""Code of daqp for a row that always holds with equality."""


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


def directions(count: int = FACETS) -> FloatArray:
    """Return unit vectors that repel each other, shape (count, 3): the facets' normals."""
    k = np.arange(count) + 0.5
    z, angle = 1.0 - 2.0 * k / count, np.pi * (1.0 + 5.0**0.5) * k
    out = np.column_stack([np.sqrt(1.0 - z * z) * np.cos(angle), np.sqrt(1.0 - z * z) * np.sin(angle), z])
    for _ in range(RELAX):
        apart = out[:, None] - out
        cube = (apart**2).sum(axis=2) ** 1.5 + np.eye(count)
        out += STEP / count * (apart / cube[..., None]).sum(axis=1)
        out /= np.linalg.norm(out, axis=1)[:, None]
    return out


def inner_radius(facets: FloatArray) -> float:
    """Return the distance of the facets at which the polytope's vertices lie on the unit sphere."""
    # the polytope's vertices are the hull's faces turned inside out
    return float(-ConvexHull(facets).equations[:, 3].max())


NORMALS = directions()
RADIUS = inner_radius(NORMALS)


class FacetsDaqp:
    """daqp on 16 facets a.u <= RADIUS mu f a contact, inside the cone; warm from its last active set."""

    def __init__(self, problem: Problem) -> None:
        import daqp

        n = len(problem)
        self._n = n
        facets = np.hstack([np.full((FACETS, 1), -RADIUS), NORMALS])
        blocks = np.zeros((n, FACETS, n, 4))
        for i in range(n):
            blocks[i, :, i] = facets * [problem.friction[i], 1.0, 1.0, 1.0]
        self._rows = np.ascontiguousarray(np.vstack([problem.columns, blocks.reshape(-1, 4 * n)]))
        large = 1e30  # daqp's infinity
        bounds = np.full((2, 4 * n), large)
        bounds[0, ::4], bounds[1, ::4] = np.minimum(problem.most, large), -problem.least
        self._upper = np.concatenate([bounds[0], np.zeros(6), np.zeros(FACETS * n)])
        self._lower = np.concatenate([-bounds[1], np.zeros(6), np.full(FACETS * n, -large)])
        self._sense = np.zeros(len(self._upper), np.int32)
        self._sense[4 * n : 4 * n + 6] = EQUATION
        self._quadratic = np.diag(np.tile([2.0, *[2.0 * WEIGHT] * 3], n))
        self._kind, self._model, self._found = daqp.Model, None, None

    _model: Any
    _found: Any

    def solve(self, load: Load, *, warm: bool) -> None:
        n = self._n
        self._upper[4 * n : 4 * n + 6] = self._lower[4 * n : 4 * n + 6] = -load.scaled
        if not warm or self._model is None:
            self._model = self._kind()
            linear = np.zeros(4 * n)
            self._model.setup(self._quadratic, linear, self._rows, self._upper, self._lower, self._sense)
        else:
            self._model.update(bupper=self._upper, blower=self._lower)
        self._found = self._model.solve()

    def answer(self) -> Answer:
        x, _, flag, info = self._found
        ended = {1: Ended.SOLVED, -1: Ended.INFEASIBLE}.get(flag, Ended.UNDECIDED)
        return Answer(ended, np.array(x).reshape(-1, 4), evaluations=info.get("iterations", 0))
