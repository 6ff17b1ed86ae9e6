"""palpate's own solvers: the parts alone, and the optimiser from Python with its result object."""

import numpy as np

from grasp_forces.problem import WEIGHT, Answer, Ended, Load, Problem
from palpate.errors import FloatArray
from palpate.grasp import GraspForceOptimizer, GraspForces, Objective, SolveStatus
from palpate.grasp.solvers.least_effort import LeastEffort, Outcome

ENDED = {
    Outcome.SOLVED: Ended.SOLVED,
    Outcome.INFEASIBLE: Ended.INFEASIBLE,
    Outcome.UNDECIDED: Ended.UNDECIDED,
    SolveStatus.SOLVED: Ended.SOLVED,
    SolveStatus.INFEASIBLE: Ended.INFEASIBLE,
    SolveStatus.MAX_ITERATIONS: Ended.UNDECIDED,
    SolveStatus.INVALID: Ended.UNDECIDED,
}


class DualNewton:
    """The dual Newton steps alone, into arrays that are there."""

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        self._newton = LeastEffort(problem.scaling, WEIGHT)
        self._forces = np.zeros((len(problem), 4))
        self._outcome, self._used = 0, 0

    def solve(self, load: Load, *, warm: bool) -> None:
        if not warm:
            self._newton.y[:] = 0.0
        self._outcome, self._used = self._newton.solve(load.wrench, self._forces)

    @property
    def multipliers(self) -> FloatArray:
        """Of equilibrium, in the problem's units, shape (6,)."""
        return self._newton.y * (self._newton.out[7] / self._problem.unit)

    def answer(self) -> Answer:
        x = self._problem.from_newtons(self._forces)
        return Answer(ENDED[Outcome(self._outcome)], x, evaluations=self._used)


class Optimizer:
    """`GraspForceOptimizer`, from newtons to a result object."""

    def __init__(self, problem: Problem, objective: Objective) -> None:
        self._problem = problem
        self._optimizer = GraspForceOptimizer(problem.grasp, objective, WEIGHT)
        self._found: GraspForces | None = None

    def solve(self, load: Load, *, warm: bool) -> GraspForces:
        self._found = self._optimizer.solve(load.wrench, warm)
        return self._found

    def answer(self) -> Answer:
        assert self._found is not None
        found, objective = self._found, self._optimizer.objective
        theta = 0.0 if objective is Objective.MIN_EFFORT else found.objective
        if objective in (Objective.MAX_MARGIN, Objective.MIN_PEAK):
            theta /= self._problem.unit
        return Answer(ENDED[found.status], self._problem.from_newtons(found.forces), theta, found.iterations)
