"""Judges of answers: the least effort to 18 digits, and the other objectives by clarabel at 1e-11.

The least effort comes from palpate's multipliers, refined in extended precision.

For any multipliers y of equilibrium the dual function is a lower bound of the effort, and each contact's
minimiser x(y) an upper one, as far as it is in balance. Both are computed here with numpy's long double, apart
from palpate's own code, and Newton's steps close the gap between them; only the steps' Hessian is palpate's,
which need not be exact. Clarabel at 1e-11 must agree.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from grasp_forces.cone_form import ClarabelDirect
from grasp_forces.ours import DualNewton
from grasp_forces.problem import WEIGHT, Answer, Ended, Load, Problem
from palpate.errors import FloatArray
from palpate.grasp import Objective
from palpate.grasp.solvers.dual_newton import evaluate

Long = np.longdouble
STEPS = 12
CLOSED = 1e-9
"""Gap between the bounds, over the effort, up to which they are a reference."""
AGREED = 1e-6
"""Largest difference to clarabel, which near the border of what can be held has no more digits."""


@dataclass(frozen=True, slots=True)
class Reference:
    """The least effort, how far it is bracketed, and by how much clarabel differs; relative, the last two."""

    effort: float
    gap: float
    clarabel: float


def least_effort(problem: Problem, load: Load) -> Reference:
    """Return the reference; its effort is NaN where it could not be found."""
    ours, check = DualNewton(problem), ClarabelDirect(problem, Objective.MIN_EFFORT, tolerance=1e-11)
    ours.solve(load, warm=False)
    check.solve(load, warm=False)
    best = min(
        (bracket(problem, load.scaled, start) for start in (ours.multipliers, check.multipliers)),
        key=lambda b: b[1],
    )
    known = check.answer()
    if known.ended is not Ended.SOLVED:
        return Reference(best[0] if best[1] <= CLOSED else np.nan, best[1], np.nan)
    effort = problem.effort(known.x)
    if best[1] <= CLOSED:
        return Reference(best[0], best[1], abs(effort - best[0]) / best[0])
    return Reference(effort, best[1], 0.0)


def bracket(problem: Problem, load: FloatArray, start: FloatArray) -> tuple[float, float]:
    """Return the lower bound from the best multipliers near a start, and the relative gap to the upper one."""
    columns, b = problem.columns.astype(Long), load.astype(Long)
    y = start.astype(Long)
    forces, gradient, hessian = np.zeros((len(problem), 4)), np.zeros(7), np.zeros((6, 6))
    best = (np.nan, np.inf)
    for _ in range(STEPS):
        value, left = dual(problem, columns, b, y)
        gap = float(np.abs(y @ left) / value) if value > 0 else np.inf
        if not np.isfinite(gap):
            break
        if gap < best[1]:
            best = float(value), gap
        if np.abs(left).max() <= 1e-18:
            break
        evaluate(problem.rows, load, WEIGHT, 0.0, load, y.astype(float), forces, gradient, hessian)
        full = np.tril(hessian) + np.tril(hessian, -1).T
        step = np.linalg.lstsq(full, left.astype(float), rcond=1e-15)[0]
        y = y + step
    return best


def dual(problem: Problem, columns: FloatArray, load: FloatArray, y: FloatArray) -> tuple[Long, FloatArray]:
    """Return the dual function at y and what the contacts' minimisers leave of equilibrium, (6,)."""
    eps, mu = Long(WEIGHT), problem.friction.astype(Long)
    lo, hi = problem.least.astype(Long), problem.most.astype(Long)
    g = (columns.T @ y).reshape(-1, 4)
    r = np.sqrt((g[:, 1:] ** 2).sum(axis=1))
    free = -g[:, 0] / 2
    on_cone = (mu * r - g[:, 0]) / 2 / (1 + eps * mu**2)
    f = np.clip(np.where(mu * free >= r / (2 * eps), free, on_cone), lo, hi)
    s = np.minimum(mu * f, r / (2 * eps))
    value = y @ load + (f**2 + eps * s**2 + g[:, 0] * f - r * s).sum()
    x = np.column_stack([f, -g[:, 1:] * (s / np.where(r > 0, r, 1))[:, None]])
    return value, columns @ x.ravel() + load


class Judge(Protocol):
    """Judges answers to the loads of one grasp."""

    def __call__(self, answer: Answer, load: Load) -> tuple[float, float]:
        """Return the objective's relative error, and the largest violation over the load's size."""
        ...


class EffortJudge:
    """min_effort: against 18 digits."""

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        self._known: dict[int, Reference] = {}

    def reference(self, load: Load) -> Reference:
        key = id(load)
        if key not in self._known:
            self._known[key] = least_effort(self._problem, load)
            if self._known[key].clarabel > AGREED:
                raise RuntimeError(f"two references disagree: {self._known[key]}")
        return self._known[key]

    def __call__(self, answer: Answer, load: Load) -> tuple[float, float]:
        known = self.reference(load).effort
        error = abs(self._problem.effort(answer.x) - known) / known
        return error, self._problem.violation(answer.x, load.scaled)


class ThetaJudge:
    """Margin, peak or load factor: against clarabel at 1e-11, over the larger of it and the load (or 1)."""

    def __init__(self, problem: Problem, objective: Objective) -> None:
        self._problem, self._objective = problem, objective
        self._exact = ClarabelDirect(problem, objective, tolerance=1e-11)
        self._known: dict[int, float] = {}

    def __call__(self, answer: Answer, load: Load) -> tuple[float, float]:
        key = id(load)
        if key not in self._known:
            self._exact.solve(load, warm=False)
            exact = self._exact.answer()
            # the last digits fail it now and then, which it says as "AlmostSolved"
            self._known[key] = exact.theta if exact.ended is not Ended.INFEASIBLE else np.nan
        known = self._known[key]
        factor = self._objective is Objective.LOAD_FACTOR
        error = abs(answer.theta - known) / max(abs(known), 1.0 if factor else float(np.linalg.norm(load.scaled)))
        held = (answer.theta if factor else 1.0) * load.scaled
        return error, self._problem.violation(answer.x, held)
