"""The hard families: what each solver says, and whether it is true."""

import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from grasp_forces.judges import EffortJudge
from grasp_forces.methods import Method
from grasp_forces.problem import Answer, Ended, Load, Problem
from support.grasp_families import Instance

CLOSE, KEPT = 1e-4, 1e-6
"""Relative error of the objective, and violation over the load, up to which a general solver's answer counts as
right; palpate's own is held to the tighter figures besides."""


class Verdict(Enum):
    """What became of an instance."""

    RIGHT = "right"
    VIOLATES = "called solved, but limits or equilibrium violated"
    WORSE = "called solved, but not the best"
    FALSELY_INFEASIBLE = "falsely called infeasible"
    UNDECIDED = "undecided"
    CERTIFIED = "infeasible and called so"
    WRONGLY_SOLVED = "infeasible, called solved"
    OPEN = "infeasible, undecided"


@dataclass(slots=True)
class Score:
    """Of one solver on all hard instances that it was given."""

    verdicts: Counter[Verdict] = field(default_factory=Counter)
    error: float = 0.0
    violation: float = 0.0
    evaluations: int = 0
    slowest: float = 0.0

    @property
    def feasible(self) -> int:
        return sum(
            self.verdicts[each]
            for each in (
                Verdict.RIGHT,
                Verdict.VIOLATES,
                Verdict.WORSE,
                Verdict.FALSELY_INFEASIBLE,
                Verdict.UNDECIDED,
            )
        )

    @property
    def infeasible(self) -> int:
        return sum(self.verdicts.values()) - self.feasible


def scores(methods: Sequence[Method], instances: Sequence[Instance], done: Callable[[], None]) -> dict[str, Score]:
    """Return all scores by name."""
    found = {method.name: Score() for method in methods}
    for k, each in enumerate(instances):
        problem = Problem.of(each.grasp, each.load)
        load = problem.load(each.load)
        judge = EffortJudge(problem)
        for method in methods:
            # every family and factor gets its share: neither divides the stride
            if k % method.every == k // 10 % method.every:
                _score(found[method.name], method, problem, load, judge, feasible=each.factor > 1.0)
        done()
    return found


def _score(
    score: Score, method: Method, problem: Problem, load: Load, judge: EffortJudge, *, feasible: bool
) -> None:
    solver = method.prepare(problem)
    started = time.thread_time()
    solver.solve(load, warm=False)
    score.slowest = max(score.slowest, time.thread_time() - started)
    answer = solver.answer()
    score.evaluations = max(score.evaluations, answer.evaluations)
    if not feasible:
        kinds = {Ended.SOLVED: Verdict.WRONGLY_SOLVED, Ended.INFEASIBLE: Verdict.CERTIFIED}
        score.verdicts[kinds.get(answer.ended, Verdict.OPEN)] += 1
        return
    verdict, error, violation = _of_feasible(answer, load, judge)
    score.verdicts[verdict] += 1
    if answer.ended is Ended.SOLVED:
        score.error, score.violation = max(score.error, error), max(score.violation, violation)


def _of_feasible(answer: Answer, load: Load, judge: EffortJudge) -> tuple[Verdict, float, float]:
    if answer.ended is Ended.INFEASIBLE:
        return Verdict.FALSELY_INFEASIBLE, np.nan, np.nan
    if answer.ended is Ended.UNDECIDED:
        return Verdict.UNDECIDED, np.nan, np.nan
    error, violation = judge(answer, load)
    if not violation <= KEPT:
        return Verdict.VIOLATES, error, violation
    return (Verdict.RIGHT if error <= CLOSE else Verdict.WORSE), error, violation
