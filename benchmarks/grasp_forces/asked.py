"""The figures asked for, and what was got."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from grasp_forces.hard import Score, Verdict
from grasp_forces.methods import CLARABEL, NEWTON, OPTIMIZER, SIZES
from grasp_forces.timing import Timing, exponent
from palpate.grasp import Objective

Times = dict[int, dict[str, Timing]]
"""By number of contacts, then by name."""

MOST_EVALUATIONS = 60
BALANCED, GAP = 1e-9, 1e-8
WARM = {2: 0.033, 4: 0.025, 10: 0.013, 100: 0.006}
"""Of clarabel's time, that warm Newton steps may take at n contacts."""

NOISE = 1.25
"""By which ratios of few microseconds differ from run to run on shared cores."""

PARTS = {2: 0.8, 4: 0.6, 10: 0.45, 100: 0.3}
"""Of clarabel's time, that max_margin and min_peak may take at n contacts."""


@dataclass(frozen=True, slots=True)
class Figure:
    """What was asked for, at most, and what was got."""

    name: str
    limit: float
    got: float
    unit: str = ""

    @property
    def kept(self) -> bool:
        return self.got <= self.limit


def effort_figures(times: Times) -> list[Figure]:
    """Return those of min_effort along trajectories."""
    figures = []
    for n in SIZES:
        limit = NOISE * WARM.get(n, 0.1)
        if n in times and n <= 100:
            ours, clarabel = times[n][NEWTON.name], times[n][CLARABEL.name]
            ratio = ours.median(warm=True) / clarabel.median(warm=True)
            figures.append(Figure(f"warm Newton over clarabel direct, n = {n}", limit, ratio))
    small = [n for n in times if n <= 10]
    tails = [1e6 * times[n][NEWTON.name].p99() for n in small]
    figures.append(Figure("warm Newton, p99, n <= 10", 100.0, max(tails), "us"))
    most = max(timing[NEWTON.name].evaluations for timing in times.values())
    figures.append(Figure("evaluations along trajectories", MOST_EVALUATIONS, most))
    sizes = [n for n in sorted(times) if n >= 100]
    if len(sizes) > 1:
        medians = np.array([times[n][NEWTON.name].median(warm=True) for n in sizes])
        figures.append(Figure(f"exponent of time in n, {sizes[-2]} to {sizes[-1]}", 1.1, exponent(sizes, medians)))
    if 4 in times:
        python = 1e6 * times[4][OPTIMIZER.name].median(warm=True)
        figures.append(Figure("from Python with result, n = 4", 25.0, python, "us"))
    # what the Newton steps alone leave undecided clarabel solves: only their answers must be right
    figures.extend(exactness(NEWTON.name, [timing[NEWTON.name] for timing in times.values()])[1:])
    figures.extend(exactness(OPTIMIZER.name, [timing[OPTIMIZER.name] for timing in times.values()]))
    return figures


def exactness(name: str, timings: Sequence[Timing]) -> list[Figure]:
    """Return that all was solved, to which gap and which violation."""
    return [
        Figure(f"{name}: loads unsolved", 0, sum(each.unsolved for each in timings)),
        Figure(f"{name}: error of the objective", GAP, float(np.max([each.error for each in timings]))),
        Figure(f"{name}: violation", BALANCED, float(np.max([each.violation for each in timings]))),
    ]


def hard_figures(scores: dict[str, Score]) -> list[Figure]:
    """Return those of the hard families: of the optimiser, and of the Newton steps alone what they call solved."""
    score, newton = scores[OPTIMIZER.name], scores[NEWTON.name]
    kinds = score.verdicts
    return [
        Figure("hard and feasible, not solved", 0, score.feasible - kinds[Verdict.RIGHT]),
        Figure("hard and feasible, called infeasible", 0, kinds[Verdict.FALSELY_INFEASIBLE]),
        Figure("hard and infeasible, not certified", 0, score.infeasible - kinds[Verdict.CERTIFIED]),
        Figure("hard: error of the objective", GAP, score.error),
        Figure("hard: violation", BALANCED, score.violation),
        Figure("hard: evaluations of Newton alone", MOST_EVALUATIONS, newton.evaluations),
        Figure(
            "hard: wrong answers of Newton alone",
            0,
            sum(
                newton.verdicts[each]
                for each in (
                    Verdict.VIOLATES,
                    Verdict.WORSE,
                    Verdict.FALSELY_INFEASIBLE,
                    Verdict.WRONGLY_SOLVED,
                )
            ),
        ),
    ]


def other_figures(times: dict[Objective, Times]) -> list[Figure]:
    """Return those of the other objectives; no ratio is asked of the load factor."""
    figures = []
    for objective, by_size in times.items():
        for n, timings in by_size.items():
            ours, clarabel = timings[OPTIMIZER.name].median(warm=True), timings[CLARABEL.name].median(warm=True)
            if objective is not Objective.LOAD_FACTOR:
                figures.append(
                    Figure(f"{objective.value} over clarabel direct, n = {n}", PARTS[n], ours / clarabel)
                )
        figures.extend(exactness(objective.value, [timings[OPTIMIZER.name] for timings in by_size.values()]))
    return figures
