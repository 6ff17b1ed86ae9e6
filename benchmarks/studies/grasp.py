"""Least forces of a grasp: palpate's optimiser and general solvers, against the least effort to 18 digits."""

from collections.abc import Callable
from functools import partial

import numpy as np
from grasp_forces.judges import EffortJudge
from grasp_forces.methods import CLARABEL, OPTIMIZER
from grasp_forces.problem import Ended, Problem, Solver
from grasp_forces.slsqp import Slsqp
from grasp_forces.trajectories import Trajectory, trajectory
from harness.study import Effort, Errors, Row, Study
from harness.timing import Timed, rounds

METHODS: dict[str, tuple[Callable[[Problem], Solver], bool]] = {
    "palpate, from the last load": (OPTIMIZER.prepare, True),
    "palpate, afresh": (OPTIMIZER.prepare, False),
    "clarabel": (CLARABEL.prepare, False),
    "scipy SLSQP": (Slsqp, False),
}
"""Each with whether it starts from its last forces."""

LOADS = 4
"""Of each grasp, one after the other as in a control loop."""

ABOUT = (
    "Three, four and five soft fingers; loads of 0.1 to 10 N that change by up to 1 %. The error is the larger "
    "of two: by how much friction, equilibrium or the sign of a normal force is violated, over the load; and by "
    "how much the effort differs from the least, relatively. More solvers, larger grasps, loads that nothing "
    "holds: python benchmarks/grasp.py."
)


def measure(effort: Effort) -> Study:
    """Measure grasp forces."""
    rng, rows = np.random.default_rng(effort.seed), list[Row]()
    for fingers in (3, 4, 5):
        effort.tell(f"grasp: {fingers} fingers")
        rows += _rows(fingers, effort, rng)
    quantities = (("violation or excess effort, relative", ""),)
    return Study("Least forces of a grasp", ABOUT, "time per load", "s", quantities, tuple(rows))


def _rows(fingers: int, effort: Effort, rng: np.random.Generator) -> list[Row]:
    errors: dict[str, list[float]] = {name: [] for name in METHODS}
    for _ in range(effort.of(30, 5)):
        path = trajectory(fingers, LOADS, rng)
        judge = EffortJudge(path.problem)
        for name in METHODS:
            errors[name] += _errors(name, path, judge)
    # the last grasp is timed: palpate's optimisers of one size are one, which knows one grasp at a time
    runs = {
        name: Timed(partial(_through, name, prepare(path.problem), path), LOADS)
        for name, (prepare, _) in METHODS.items()
    }
    timed = rounds(runs, effort.of(15, 5))
    return [
        Row(f"{fingers} fingers", name, timed[name].least, (Errors.of(each),), ratio=timed[name].ratio)
        for name, each in errors.items()
    ]


def _through(name: str, solver: Solver, path: Trajectory) -> None:
    warm = METHODS[name][1]
    for load in path.loads:
        solver.solve(load, warm=warm)


def _errors(name: str, path: Trajectory, judge: EffortJudge) -> list[float]:
    prepare, warm = METHODS[name]
    solver = prepare(path.problem)
    errors = []
    for load in path.loads:
        solver.solve(load, warm=warm)
        answer = solver.answer()
        errors.append(max(judge(answer, load)) if answer.ended is Ended.SOLVED else np.nan)
    return errors
