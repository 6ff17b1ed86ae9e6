"""Solvers of nonlinear programmes: those of CasADi's wheel and scipy's SLSQP, most with rounded cones.

One CasADi programme is built for a number of contacts, with the grasp and its load as parameters.
"""

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import casadi
import numpy as np
from scipy.optimize import minimize

from grasp_forces.problem import WEIGHT, Answer, Ended, Load, Problem
from palpate.errors import FloatArray

ROUND = 1e-6
"""Friction is taken for sqrt(u'u + ROUND^2), over the load: the norm's corner gets a slope, and the limit is
stricter. With squared cones, which have no slope at the apex, most of these solvers fail on easy grasps."""

MOST = 100
"""Iterations of sqpmethod."""

QUIET: dict[str, Any] = {"print_time": False, "error_on_fail": False}
IPOPT: dict[str, Any] = QUIET | {
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.tol": 1e-8,
    "ipopt.max_iter": 300,
}
SQP: dict[str, Any] = QUIET | {
    "show_eval_warnings": False,
    "print_header": False,
    "print_iteration": False,
    "print_status": False,
    "max_iter": MOST,
}


def rounded(friction: Any, f: Any, u2: Any) -> Any:
    """Return what must be at least 0, u2 being u'u of each contact."""
    return friction * f - casadi.sqrt(u2 + ROUND**2)


def squared(friction: Any, f: Any, u2: Any) -> Any:
    """Return the same without a root; not concave, and without slope at the apex."""
    return (friction * f) ** 2 - u2


@dataclass(frozen=True, slots=True, eq=False)
class Setting:
    """A plugin of CasADi's nlpsol, its options, and how a cone is put to it."""

    plugin: str
    options: dict[str, Any]
    cone: Callable[[Any, Any, Any], Any] = rounded


def _sqp(plugin: str, **options: Any) -> Setting:
    return Setting("sqpmethod", SQP | {"qpsol": plugin, "qpsol_options": QUIET | options})


IPOPT_KEPT = Setting("ipopt", IPOPT | {"ipopt.bound_relax_factor": 0.0})
IPOPT_SQUARED = Setting("ipopt", IPOPT_KEPT.options, squared)
IPOPT_DEFAULT = Setting("ipopt", IPOPT)
FATROP = Setting("fatrop", QUIET | {"fatrop.print_level": 0, "fatrop.tol": 1e-8})
SQP_QRQP = _sqp("qrqp", print_iter=False, print_header=False)
SQP_OSQP = _sqp("osqp", osqp={"verbose": False, "eps_abs": 1e-8, "eps_rel": 1e-8})
SQP_QPOASES = _sqp("qpoases", printLevel="none")
SQP_DAQP = _sqp("daqp")


class Nlp:
    """A nonlinear programme; warm from its last solution and multipliers."""

    def __init__(self, problem: Problem, setting: Setting) -> None:
        n = len(problem)
        self._solver = _nonlinear(n, setting)
        self._grasp = np.concatenate([problem.columns.ravel(order="F"), problem.friction])
        # pressing straight in by half the load each
        self._start = np.tile([0.5, 0.0, 0.0, 0.0], n)
        self._lbx, self._ubx = np.full(4 * n, -np.inf), np.full(4 * n, np.inf)
        self._lbx[::4], self._ubx[::4] = problem.least, problem.most
        self._ubg = np.concatenate([np.zeros(6), np.full(n, np.inf)])
        self._found: Any = None

    def solve(self, load: Load, *, warm: bool) -> None:
        last = self._found if warm else None
        before = {"x0": self._start} if last is None else _again(last)
        try:
            self._found = self._solver(
                p=np.concatenate([self._grasp, load.scaled]),
                lbx=self._lbx,
                ubx=self._ubx,
                lbg=0.0,
                ubg=self._ubg,
                **before,
            )
            self._failed = False
        except RuntimeError:
            self._found, self._failed = None, True

    def answer(self) -> Answer:
        if self._failed:
            return Answer(Ended.UNDECIDED, np.full((len(self._start) // 4, 4), np.nan))
        told = self._solver.stats()
        word = str(told.get("return_status", "")).lower()
        ended = Ended.SOLVED if told["success"] else Ended.UNDECIDED
        if "infeasible" in word and not told["success"]:
            ended = Ended.INFEASIBLE
        return Answer(ended, np.array(self._found["x"]).reshape(-1, 4), evaluations=told.get("iter_count", 0))


def _again(last: Any) -> dict[str, Any]:
    return {"x0": last["x"], "lam_x0": last["lam_x"], "lam_g0": last["lam_g"]}


@lru_cache(maxsize=64)
def _nonlinear(n: int, setting: Setting) -> Any:
    x, columns = casadi.SX.sym("x", 4 * n), casadi.SX.sym("columns", 6, 4 * n)
    friction, load = casadi.SX.sym("friction", n), casadi.SX.sym("load", 6)
    rows = casadi.reshape(x, 4, n)
    f, u = rows[0, :].T, rows[1:, :]
    stated = {
        "x": x,
        "p": casadi.vertcat(casadi.vec(columns), friction, load),
        "f": casadi.sumsqr(f) + WEIGHT * casadi.sumsqr(u),
        "g": casadi.vertcat(columns @ x + load, setting.cone(friction, f, casadi.sum1(u**2).T)),
    }
    return casadi.nlpsol("grasp", setting.plugin, stated, setting.options)


class SuperScs:
    """superscs through CasADi; it misreads quadratic objectives, so it is given the root of the effort."""

    def __init__(self, problem: Problem) -> None:
        n = len(problem)
        x, t, load = casadi.SX.sym("x", 4 * n), casadi.SX.sym("t"), casadi.SX.sym("load", 6)
        root = casadi.DM(np.tile([1.0, *[np.sqrt(WEIGHT)] * 3], n))
        cones = [casadi.soc(x[4 * i + 1 : 4 * i + 4], problem.friction[i] * x[4 * i]) for i in range(n)]
        cones.append(casadi.soc(root * x, t))
        stated = {
            "x": casadi.vertcat(x, t),
            "p": load,
            "f": t,
            "g": casadi.DM(problem.columns) @ x + load,
            "h": casadi.diagcat(*cones),
        }
        how = {"superscs": {"eps": 1e-8, "verbose": 0, "max_iters": 5000}} | QUIET
        self._solver = casadi.qpsol("grasp", "superscs", stated, how)
        self._lbx, self._ubx = np.full(4 * n + 1, -np.inf), np.full(4 * n + 1, np.inf)
        self._lbx[:-1:4], self._ubx[:-1:4] = problem.least, problem.most
        self._found: Any = None

    def solve(self, load: Load, *, warm: bool) -> None:
        self._found = self._solver(p=load.scaled, lbx=self._lbx, ubx=self._ubx, lbg=0.0, ubg=0.0)

    def answer(self) -> Answer:
        told = self._solver.stats()
        ended = Ended.SOLVED if told["success"] else Ended.UNDECIDED
        if "infeasible" in str(told.get("return_status", "")).lower():
            ended = Ended.INFEASIBLE
        found: FloatArray = np.array(self._found["x"]).ravel()[:-1]
        return Answer(ended, found.reshape(-1, 4))


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
