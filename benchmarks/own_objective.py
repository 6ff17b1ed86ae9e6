"""Own objectives and shared tendons, four contacts: time, warm, and how far IPOPT's forces are.

    python benchmarks/own_objective.py [--loads 200] [--anywhere 100] [--seed 1]

Processor time, so set OMP_NUM_THREADS=1. First table: loads move by 1 % from one to the next. Second: every grasp
and load is new, contacts up to 20 degrees and every component of the load up to 30 % aside, solved cold. IPOPT
solves the same by `casadi.Opti`, what was left undecided from five starts. "Worse": its objective is smaller by
more than 1e-7 of it; where there are several local optima, either may find the better one.

Exit code 1 if anything is left undecided for which IPOPT finds forces, or convex ones are worse.
"""

import time
from argparse import ArgumentParser, Namespace
from collections import Counter
from collections.abc import Iterator, Sequence

import numpy as np
from harness.campaign import Listing, start, tracked

from palpate.grasp import GraspForceOptimizer, SolveStatus
from support.coupled_grasps import CONVEX, LOAD, OTHERS, SHARED, ring
from support.opti_grasp import opti_forces

PROBLEMS = CONVEX | OTHERS
STATUSES = (SolveStatus.SOLVED, SolveStatus.INFEASIBLE, SolveStatus.MAX_ITERATIONS)
TIMES = ("us, median", "us, 99 %")
STARTS = 5


def moving(options: Namespace) -> Iterator[Listing]:
    """Measure loads that move."""
    rows = []
    for name, (objective, subject_to) in PROBLEMS.items():
        optimizer = GraspForceOptimizer(ring(), objective, subject_to=subject_to, shared_actuators=SHARED)
        value, forces = opti_forces(ring(), LOAD, objective, subject_to, SHARED)
        found = optimizer.solve(LOAD)
        times, solved = [], 0
        for k in range(options.loads):
            load = LOAD * (1.0 + 0.01 * np.sin(k + np.arange(6)))
            begun = time.process_time()
            solved += optimizer.solve(load).status is SolveStatus.SOLVED
            times.append(1e6 * (time.process_time() - begun))
        error = f"{abs(found.objective - value) / abs(value):.0e}"
        apart = f"{np.abs(found.forces - forces).max():.0e}"
        rows.append((name, *quantiles(times), f"{solved} of {options.loads}", error, apart))
    yield Listing(
        "Loads that move", ("problem", *TIMES, "solved", "objective - IPOPT's, relative", "forces [N]"), rows
    )


def quantiles(times: Sequence[float]) -> list[str]:
    """Return median and 99 %."""
    return [f"{np.quantile(times, share):.0f}" for share in (0.5, 0.99)]


def anywhere(options: Namespace) -> Iterator[Listing]:
    """Try grasps and loads that have nothing to do with each other; `missed`: IPOPT alone finds forces."""
    rng, rows, right = np.random.default_rng(options.seed), [], True
    for name, (objective, subject_to) in PROBLEMS.items():
        optimizer = GraspForceOptimizer(ring(), objective, subject_to=subject_to, shared_actuators=SHARED)
        counts, times = Counter[object](), []
        for _ in tracked(range(options.anywhere), options.anywhere, name):
            grasp = ring(aslant=0.2 + rng.uniform(-0.35, 0.35))
            load = LOAD * (1.0 + rng.uniform(-0.3, 0.3, 6))
            optimizer.update(grasp)
            begun = time.process_time()
            found = optimizer.solve(load, warm_start=False)
            times.append(1e6 * (time.process_time() - begun))
            counts[found.status] += 1
            tries = {SolveStatus.SOLVED: 1, SolveStatus.MAX_ITERATIONS: STARTS}.get(found.status, 0)
            values = []
            for k in range(tries):
                begin = None if k == 0 else rng.uniform(0.0, 2.0, (4, 4)) * [1.0, 0.1, 0.1, 0.0]
                try:
                    values.append(opti_forces(grasp, load, objective, subject_to, SHARED, begin)[0])
                except RuntimeError:  # it gives up
                    continue
            if not values:
                continue
            if found.status is SolveStatus.MAX_ITERATIONS:
                counts["missed"] += 1
                continue
            ahead = (values[0] - found.objective) / abs(values[0])
            counts["compared"] += 1
            counts["better"] += ahead > 1e-7
            counts["worse"] += ahead < -1e-7
        right &= not counts["missed"] and not (name in CONVEX and counts["worse"])
        shown = (*STATUSES, "missed", "compared", "better", "worse")
        rows.append((name, *(counts[each] for each in shown), *quantiles(times)))
    heads = ("solved", "proven infeasible", "undecided", "IPOPT finds forces", "compared", "better", "worse")
    yield Listing("Anywhere", ("problem", *heads, *TIMES), rows, right)


def add_options(parser: ArgumentParser) -> None:
    """Add numbers of loads and the seed."""
    parser.add_argument("--loads", type=int, default=200, help="loads of the first table (%(default)s)")
    parser.add_argument("--anywhere", type=int, default=100, help="loads of the second table (%(default)s)")
    parser.add_argument("--seed", type=int, default=1)


if __name__ == "__main__":
    start(__doc__, {"moving": moving, "anywhere": anywhere}, add_options)
