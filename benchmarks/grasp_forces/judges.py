"""How far an answer is from the best one, and from the limits."""

from typing import Protocol

import numpy as np

from grasp_forces.cone_form import ClarabelDirect
from grasp_forces.problem import Answer, Ended, Load, Problem
from grasp_forces.reference import AGREED, Reference, least_effort
from palpate.grasp import Objective


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
