"""The hard families: the answer of each solver, and whether it is true."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from grasp_forces.judges import EffortJudge
from grasp_forces.methods import GraspMethod
from grasp_forces.problem import Answer, Ended, Load, Problem
from support.grasp_families import Instance

CLOSE, KEPT = 1e-4, 1e-6
"""Relative error of the objective, and violation over the load, up to which a general solver's answer counts as
right; palpate's own must also meet tighter figures."""


class Verdict(Enum):
    """Outcome of an instance."""

    RIGHT = "right"
    VIOLATES = "called solved, but limits or equilibrium violated"
    WORSE = "called solved, but not the best"
    FALSELY_INFEASIBLE = "falsely called infeasible"
    UNDECIDED = "undecided"
    CERTIFIED = "infeasible and called so"
    WRONGLY_SOLVED = "infeasible, called solved"
    OPEN = "infeasible, undecided"


FEASIBLE, INFEASIBLE = tuple(Verdict)[:5], tuple(Verdict)[5:]


@dataclass(slots=True)
class Score:
    """Verdicts on one solver, and the worst of the answers that it called solved."""

    verdicts: Counter[Verdict] = field(default_factory=Counter)
    error: float = 0.0
    violation: float = 0.0
    evaluations: int = 0

    def total(self, kinds: Sequence[Verdict]) -> int:
        """Return the number of verdicts of these kinds."""
        return sum(self.verdicts[each] for each in kinds)


def scores(methods: Sequence[GraspMethod], instances: Sequence[Instance]) -> dict[str, Score]:
    """Return all scores by name."""
    found = {method.name: Score() for method in methods}
    for k, each in enumerate(instances):
        problem = Problem.of(each.grasp, each.load)
        load, judge = problem.load(each.load), EffortJudge(problem)
        for method in methods:
            # every family and factor gets its share: neither divides the stride
            if k % method.every == k // 10 % method.every:
                solver = method.prepare(problem)
                solver.solve(load, warm=False)
                _count(found[method.name], solver.answer(), load, judge, feasible=each.factor > 1.0)
    return found


def _count(score: Score, answer: Answer, load: Load, judge: EffortJudge, *, feasible: bool) -> None:
    score.evaluations = max(score.evaluations, answer.evaluations)
    if not feasible:
        kinds = {Ended.SOLVED: Verdict.WRONGLY_SOLVED, Ended.INFEASIBLE: Verdict.CERTIFIED}
        score.verdicts[kinds.get(answer.ended, Verdict.OPEN)] += 1
    elif answer.ended is not Ended.SOLVED:
        infeasible = answer.ended is Ended.INFEASIBLE
        score.verdicts[Verdict.FALSELY_INFEASIBLE if infeasible else Verdict.UNDECIDED] += 1
    else:
        error, violation = judge(answer, load)
        right = Verdict.RIGHT if error <= CLOSE else Verdict.WORSE
        score.verdicts[right if violation <= KEPT else Verdict.VIOLATES] += 1
        # a NaN must stay: it misses every limit
        score.error, score.violation = np.maximum((score.error, score.violation), (error, violation))
