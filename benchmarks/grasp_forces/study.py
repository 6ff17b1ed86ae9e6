"""Speed of grasp-force solvers against their error: palpate's own and all others that are installed.

    python benchmarks/grasp.py [least-effort | hard | objectives ...] [--quick] [--picture FILE]

least-effort: 2 to 1000 contacts, cold and warm along loads that move 0.1 to 1 % a period. hard: slippery, sticky,
antipodal, parallel, coincident, in-line and large-e grasps under loads of known factors. objectives: max_margin,
min_peak and load_factor against clarabel. Errors are against 18 digits (least effort) or clarabel at 1e-11. Times
are processor time, solvers in turns: trust ratios. Warm, for clarabel and cvxpy: workspace kept. About four
minutes; --quick takes one. Exit status 1: a figure asked for was not reached.
"""

import os
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from itertools import cycle, islice

import numpy as np
from harness.command import start
from harness.study import Check, Effort, Errors, Row, Study
from harness.tables import grid
from harness.timing import Timed, Timing, rounds

from grasp_forces.hard import FEASIBLE, INFEASIBLE, Verdict, scores
from grasp_forces.judges import EffortJudge, Judge, ThetaJudge
from grasp_forces.methods import CLARABEL, METHODS, NEWTON, OPTIMIZER, SLSQP, GraspMethod, of_objective
from grasp_forces.problem import Ended, Load, Problem, Solver
from grasp_forces.trajectories import Trajectory, trajectory
from palpate.grasp import Objective
from support.grasp_families import instances

SIZES = (2, 3, 4, 5, 10, 100, 1000)
PERIODS, BLOCK = 500, 20
"""Loads of a trajectory, and loads that a solver of microseconds takes in one turn."""

QUANTITIES = (("error of the objective", ""), ("violation", ""), ("evaluations", ""))
MOST_EVALUATIONS, BALANCED, GAP = 60, 1e-9, 1e-8

WARM = {2: 0.033, 4: 0.025, 10: 0.013, 100: 0.006}
"""Largest share of clarabel's time that warm Newton steps may take, by number of contacts."""

NOISE = 1.25
"""Factor by which ratios of few microseconds differ from run to run on shared cores."""

OTHER_SIZES, OTHERS = (2, 4, 10, 100), 13.0
"""Numbers of contacts for max_margin and min_peak, and how many times as long as clarabel alone, its workspace kept,
they may take. Clarabel solves them, its workspace is made anew for each load: 2.7 to 13 were measured."""

HARD_SEED = 80_000
"""Seed on which nothing was tuned."""


@contextmanager
def silent() -> Iterator[None]:
    """Drop what solvers written in C print to standard output."""
    sys.stdout.flush()
    kept, nothing = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nothing, 1)
        yield
    finally:
        os.dup2(kept, 1)
        for each in (kept, nothing):
            os.close(each)


# ------------------------------------------------------------------------------------------------ one grasp size


def size_rows(
    case: str, methods: Sequence[GraspMethod], n: int, effort: Effort, judge: Callable[[Problem], Judge]
) -> list[Row]:
    """Measure grasps of n contacts: a row per method, warm and cold; ratios are to clarabel's warm time."""
    effort.tell(case)
    times = dict[tuple[str, bool], list[Timing]]()
    errors: dict[str, list[tuple[float, float, float]]] = {method.name: [] for method in methods}
    for k in range(effort.of(3, 1)):
        path = trajectory(n, effort.of(PERIODS, 100), np.random.default_rng([effort.seed, n, k]))
        judging, runs = judge(path.problem), dict[tuple[str, bool], Timed]()
        with silent():
            for method in sorted(methods, key=lambda each: each.name != CLARABEL.name):
                errors[method.name] += along(method, path, effort.of(5, 3), judging)
                for warm in (True, False):
                    runs[method.name, warm] = turn(method.prepare(path.problem), path.loads, warm=warm)
            for key, timing in rounds(runs, effort.of(6, 3)).items():
                times.setdefault(key, []).append(timing)
    rows = []
    for method in methods:
        found = tuple(Errors.of(each) for each in zip(*errors[method.name], strict=True))
        for warm, name in ((True, method.name), (False, f"{method.name}, cold")):
            seconds, ratios = (
                tuple(value for timing in times[method.name, warm] for value in getattr(timing, what))
                for what in ("seconds", "ratios")
            )
            timing = Timing(seconds, ratios)
            rows.append(Row(case, name, timing.median, found, method.name, timing.ratio, drawn=warm))
    return rows


def turn(solver: Solver, loads: Sequence[Load], *, warm: bool) -> Timed:
    """Return the timed way to and fro along a trajectory; slow solvers take one load at a time."""
    one = Timed(lambda: solver.solve(loads[0], warm=warm), clock=time.thread_time)
    one.warm_up()
    way, count = cycle((*loads, *reversed(loads))), BLOCK if one.calls > 1 else 1
    return Timed(lambda: _through(solver, islice(way, count), warm), count, time.thread_time)


def _through(solver: Solver, loads: Iterable[Load], warm: bool) -> None:
    for load in loads:
        solver.solve(load, warm=warm)


def along(method: GraspMethod, path: Trajectory, count: int, judge: Judge) -> list[tuple[float, float, float]]:
    """Return error, violation and evaluations under the first loads, warm and cold; NaN if undecided."""
    solver, found = method.prepare(path.problem), []
    for warm in (True, False):
        for load in path.loads[:count]:
            solver.solve(load, warm=warm)
            answer = solver.answer()
            solved = answer.ended is Ended.SOLVED
            found.append((*(judge(answer, load) if solved else (np.nan, np.nan)), float(answer.evaluations)))
    return found


# ------------------------------------------------------------------------------------------------------- parts


def compared(sizes: Sequence[int], methods: Sequence[GraspMethod], effort: Effort) -> Study:
    """Measure the least effort of grasps of these sizes, without figures asked for."""
    able = [method for method in methods if method.installed]
    rows = [
        row
        for n in sizes
        for row in size_rows(f"n = {n}", [m for m in able if m.most_contacts >= n], n, effort, EffortJudge)
    ]
    missing = ", ".join(str(method.package) for method in methods if not method.installed)
    about = "Time per load, warm or cold; error of the effort and violation of limits or equilibrium, relative."
    about += f" Left out, not installed (pip install ...): {missing}." if missing else ""
    return Study("Least forces of a grasp", about, "time per load", "s", QUANTITIES, tuple(rows), pictured=1)


def few(effort: Effort) -> Study:
    """Measure three to five contacts and few methods, for the report of all topics."""
    return compared((3, 4, 5), (OPTIMIZER, CLARABEL, SLSQP), effort)


def least_effort(effort: Effort, sizes: Sequence[int] = SIZES, methods: Sequence[GraspMethod] = METHODS) -> Study:
    """Measure the least effort, and judge palpate's figures."""
    study = compared(sizes, methods, effort)
    rows = {(row.case, row.method): row for row in study.rows}
    newton = {n: rows[f"n = {n}", NEWTON.name] for n in sizes}
    checks = [
        Check.at_most(f"warm Newton over clarabel direct, n = {n}", NOISE * WARM.get(n, 0.1), row.ratio.median)
        for n, row in newton.items()
        if n <= 100 and row.ratio
    ]
    tails = [tail(n, effort) for n in sizes if n <= 10]
    checks.append(Check.at_most("warm Newton, 99 % of periods, n <= 10, us", 100.0, 1e6 * max(tails)))
    if {100, 1000} <= newton.keys():
        exponent = float(np.log10(newton[1000].cost / newton[100].cost))
        checks.append(Check.at_most("exponent of time in n, 100 to 1000", 1.1, exponent))
    if 4 in newton:
        got = 1e6 * rows["n = 4", OPTIMIZER.name].cost
        checks.append(Check.at_most("from Python with result, n = 4, us", 25.0, got))
    most = max(row.errors[2].largest for row in newton.values())
    checks.append(Check.at_most("evaluations along trajectories", MOST_EVALUATIONS, most))
    # clarabel solves the loads that Newton steps alone leave undecided: only their answers must be right
    checks += exactness(NEWTON.name, list(newton.values()))[1:]
    checks += exactness(OPTIMIZER.name, [rows[f"n = {n}", OPTIMIZER.name] for n in sizes])
    return replace(study, checks=tuple(checks))


def tail(n: int, effort: Effort) -> float:
    """Return the time that 99 % of warm Newton solves of a trajectory do not exceed [s]."""
    path = trajectory(n, effort.of(PERIODS, 100), np.random.default_rng([effort.seed, n, 0]))
    solver, taken = NEWTON.prepare(path.problem), []
    for load in path.loads:
        started = time.thread_time()
        solver.solve(load, warm=True)
        taken.append(time.thread_time() - started)
    return float(np.quantile(taken[1:], 0.99))


def exactness(name: str, rows: Sequence[Row]) -> list[Check]:
    """Return that all was solved, to which gap and which violation."""
    error, violation = (float(np.max([row.errors[k].largest for row in rows])) for k in (0, 1))
    return [
        Check.at_most(f"{name}: share of loads unsolved", 0, max(row.errors[0].silent for row in rows)),
        Check.at_most(f"{name}: error of the objective", GAP, error),
        Check.at_most(f"{name}: violation", BALANCED, violation),
    ]


def hard(effort: Effort, methods: Sequence[GraspMethod] = METHODS) -> Study:
    """Count right and wrong answers on the hard families."""
    able = [method for method in methods if method.installed]
    with silent():
        found = scores(able, list(instances(HARD_SEED, effort.of(14, 1))))
    heads = ("right", "violating", "not the best", "falsely infeasible", "undecided", "of feasible")
    heads += ("certified", 'wrongly "solved"', "undecided", "of infeasible")
    table = grid("Hard grasps", "solver", *heads)
    for name, score in found.items():
        counts = [score.verdicts[each] for each in Verdict]
        counts.insert(len(FEASIBLE), score.total(FEASIBLE))
        table.add_row(name, *map(str, (*counts, score.total(INFEASIBLE))))
    score, newton = found[OPTIMIZER.name], found[NEWTON.name]
    wrong = (Verdict.VIOLATES, Verdict.WORSE, Verdict.FALSELY_INFEASIBLE, Verdict.WRONGLY_SOLVED)
    checks = (
        Check.at_most("feasible, not solved", 0, score.total(FEASIBLE) - score.verdicts[Verdict.RIGHT]),
        Check.at_most("feasible, called infeasible", 0, score.verdicts[Verdict.FALSELY_INFEASIBLE]),
        Check.at_most("infeasible, not certified", 0, score.total(INFEASIBLE) - score.verdicts[Verdict.CERTIFIED]),
        Check.at_most("error of the objective", GAP, score.error),
        Check.at_most("violation", BALANCED, score.violation),
        Check.at_most("evaluations of Newton alone", MOST_EVALUATIONS, newton.evaluations),
        Check.at_most("wrong answers of Newton alone", 0, newton.total(wrong)),
    )
    about = (
        "Right: objective within 1e-4, violation within 1e-6. Loads: 0.2 to 0.9999 (feasible) or "
        "1.001 to 2 times (infeasible) the largest that can be held. Slow solvers get every fifth or twentieth."
    )
    return Study("Hard grasps", about, checks=checks, tables=(table,))


def objectives(effort: Effort, sizes: Sequence[int] = OTHER_SIZES) -> Study:
    """Measure the other objectives against clarabel; no ratio is asked of the load factor."""
    rows, checks = list[Row](), list[Check]()
    for objective in (Objective.MAX_MARGIN, Objective.MIN_PEAK, Objective.LOAD_FACTOR):
        judge, ours = partial(ThetaJudge, objective=objective), list[Row]()
        for n in sizes:
            found = size_rows(f"{objective.value}, n = {n}", of_objective(objective), n, effort, judge)
            rows += found
            ours.append(next(row for row in found if row.method == OPTIMIZER.name))
            ratio = ours[-1].ratio
            if objective is not Objective.LOAD_FACTOR and ratio:
                checks.append(
                    Check.at_most(f"{ours[-1].case}, over clarabel direct", NOISE * OTHERS, ratio.median)
                )
        checks += exactness(objective.value, ours)
    return Study("Other objectives", "", "time per load", "s", QUANTITIES, tuple(rows), tuple(checks), pictured=1)


PARTS = {"least-effort": least_effort, "hard": hard, "objectives": objectives}


def main() -> None:
    """Run as a script."""
    start(__doc__, PARTS)
