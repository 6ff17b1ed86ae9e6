"""Own objectives and shared tendons, four contacts: time, warm, and how far IPOPT's forces are.

    python benchmarks/own_objective.py [--loads 200]

Processor time, so set OMP_NUM_THREADS=1; loads move by 1 % from one to the next. IPOPT solves the same by
`casadi.Opti`.
"""

import argparse
import sys
import time
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests"))

from palpate.grasp import GraspForceOptimizer
from support.coupled_grasps import CONVEX, LOAD, OTHERS, SHARED, ring
from support.opti_grasp import opti_forces


def main() -> None:
    """Measure all of them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--loads", type=int, default=200)
    count = parser.parse_args().loads
    table = Table("problem", "us, median", "us, 99 %", "solved", "objective, relative to IPOPT's", "forces [N]")
    for name, (objective, subject_to) in (CONVEX | OTHERS).items():
        optimizer = GraspForceOptimizer(ring(), objective, subject_to=subject_to, shared_actuators=SHARED)
        value, forces = opti_forces(ring(), LOAD, objective, subject_to, SHARED)
        found = optimizer.solve(LOAD)
        times, solved = [], 0
        for k in range(count):
            load = LOAD * (1.0 + 0.01 * np.sin(k + np.arange(6)))
            start = time.process_time()
            solved += optimizer.solve(load).status.name == "SOLVED"
            times.append(1e6 * (time.process_time() - start))
        table.add_row(
            name,
            f"{np.median(times):.0f}",
            f"{np.quantile(times, 0.99):.0f}",
            f"{solved} of {count}",
            f"{abs(found.objective - value) / abs(value):.0e}",
            f"{np.abs(found.forces - forces).max():.0e}",
        )
    Console().print(table)


if __name__ == "__main__":
    main()
