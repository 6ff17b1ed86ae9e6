"""Time per call, solvers in turns, cold and warm along trajectories.

Times are the thread's own processor time, so that whoever else has the core is not counted, less the clock's own
cost. Solvers take turns every few periods: their ratios are those of one machine at one time.
"""

import gc
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from grasp_forces.judges import Judge
from grasp_forces.methods import Method
from grasp_forces.problem import Ended, Load, Problem, Solver
from grasp_forces.trajectories import trajectory
from palpate.errors import FloatArray

BLOCK = 20
"""Periods before the next solver's turn."""


SLOW_CALL = 0.5
"""Seconds after which a first call is taken for slow, not for one that compiles."""


@dataclass(frozen=True, slots=True)
class Effort:
    """How much is measured.

    Attributes:
        grasps: Of each size.
        periods: Of each trajectory.
        seconds: That one solver may take of each trajectory, warm; cold it may take a fifth.
        per_family: Hard grasps of each family, each under ten loads.
    """

    grasps: int
    periods: int
    seconds: float
    per_family: int


@dataclass(slots=True)
class Timing:
    """What one solver took and how well it did, at one size."""

    cold: list[float] = field(default_factory=list)
    warm: list[float] = field(default_factory=list)
    errors: list[float] = field(default_factory=list)
    violations: list[float] = field(default_factory=list)
    evaluations: int = 0
    unsolved: int = 0
    judged: int = 0

    @property
    def error(self) -> float:
        """Largest relative error of the objective; NaN if nothing was solved."""
        return max(self.errors, default=np.nan)

    @property
    def violation(self) -> float:
        return max(self.violations, default=np.nan)

    def median(self, *, warm: bool) -> float:
        return float(np.median(self.warm if warm else self.cold))

    def p99(self) -> float:
        return float(np.quantile(self.warm, 0.99))


def clock_cost() -> float:
    """Return what two readings of the clock take [s]."""
    taken = []
    for _ in range(2000):
        started = time.thread_time_ns()
        taken.append(time.thread_time_ns() - started)
    return 1e-9 * float(np.median(taken))


def measure(
    methods: Sequence[Method],
    n: int,
    effort: Effort,
    judge: Callable[[Problem], Judge],
    done: Callable[[], None],
    seed: int = 0,
) -> dict[str, Timing]:
    """Time solvers at one size; results by name."""
    found = {method.name: Timing() for method in methods}
    cost = clock_cost()
    gc.disable()
    try:
        for k in range(effort.grasps):
            path = trajectory(n, effort.periods, np.random.default_rng([seed, n, k]))
            solvers = {method.name: method.prepare(path.problem) for method in methods}
            pace = {name: _first(solver, path.loads) for name, solver in solvers.items()}
            judging = judge(path.problem)
            for warm, seconds in ((True, effort.seconds), (False, 0.2 * effort.seconds)):
                counts = {name: int(np.clip(seconds / taken, 2, effort.periods)) for name, taken in pace.items()}
                for start in range(0, effort.periods, BLOCK):
                    for name, solver in solvers.items():
                        block = path.loads[start : min(start + BLOCK, counts[name])]
                        if block:
                            _timed(solver, block, found[name], cost, warm=warm)
                            _judged(solver, block[-1], judging, found[name])
                gc.collect()
            done()
    finally:
        gc.enable()
    return found


def _first(solver: Solver, loads: Sequence[Load]) -> float:
    """Return what a call takes; the first may compile."""
    taken = SLOW_CALL
    for _ in range(2):
        started = time.thread_time()
        solver.solve(loads[0], warm=False)
        taken = max(time.thread_time() - started, 1e-7)
        if taken > SLOW_CALL:
            break
    return taken


def _timed(solver: Solver, loads: Sequence[Load], timing: Timing, cost: float, *, warm: bool) -> None:
    clock, solve, taken = time.thread_time_ns, solver.solve, []
    for load in loads:
        started = clock()
        solve(load, warm=warm)
        taken.append(clock() - started)
    (timing.warm if warm else timing.cold).extend(max(1e-9 * each - cost, 1e-9) for each in taken)


def _judged(solver: Solver, load: Load, judge: Judge, timing: Timing) -> None:
    answer = solver.answer()
    timing.judged += 1
    timing.evaluations = max(timing.evaluations, answer.evaluations)
    if answer.ended is not Ended.SOLVED:
        timing.unsolved += 1
        return
    error, violation = judge(answer, load)
    timing.errors.append(error)
    timing.violations.append(violation)


def exponent(sizes: Sequence[int], seconds: FloatArray) -> float:
    """Return the exponent of time in n, by the two largest sizes."""
    return float(np.log(seconds[-1] / seconds[-2]) / np.log(sizes[-1] / sizes[-2]))
