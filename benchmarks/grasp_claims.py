"""Whether what is claimed of grasp forces is true: hard grasps, preloads to 1e15 times the load, loads to 1e300.

    python benchmarks/grasp_claims.py [--instances 100000] [--seed 1]

Loads of known factors (clarabel's) on the hard families of the tests; every third in an optimizer that moves from
one to the next, warm; every third scaled by up to 1e250; and opposite pairs of fingers that press with 1 to
1e15 times the load. SOLVED is false if equilibrium is off by more than 1e-8 of load or preload, or a limit by more
than 1e-9; INFEASIBLE if the load's factor is above 1; undecided must be within 1e-3 of 1. Certificates are
checked with 50 digits, one in ten. Exit code 1 if any claim is false.
"""

import argparse
import math
import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path

import mpmath
import numpy as np
from rich.console import Console
from rich.progress import track

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests"))

from palpate.grasp import GraspContacts, GraspForceOptimizer, GraspForces, SolveStatus
from support.grasp_families import FAMILIES, instances, least_value, paired

LOAD = np.array([0.3, -1.0, 0.5, 0.004, 0.002, -0.006])


def false_claim(
    grasp: GraspContacts, load: np.ndarray, result: GraspForces, factor: float, *, digits: bool
) -> str:
    """Return what is false of a result; nothing if all is true."""
    length = float(np.linalg.norm(grasp.positions - grasp.positions.mean(axis=0), axis=1).max())
    size = max(float(np.abs(load[:3]).max()), float(np.abs(load[3:]).max()) / length, float(grasp.force_min.max()))
    if result.status is SolveStatus.SOLVED:
        if not np.isfinite(result.forces).all() or math.isnan(result.objective):
            return "SOLVED without forces"
        with np.errstate(over="ignore"):
            left = (grasp.grasp_map @ (result.forces / size).ravel()) + load / size
            scaled = replace(grasp, force_min=grasp.force_min / size, force_max=grasp.force_max / size)
            room = scaled.margins(result.forces / size)
        off = max(float(np.abs(left[:3]).max()), float(np.abs(left[3:]).max()) / length)
        largest = max(1.0, float(result.forces[:, 0].max() / size))
        low = float((grasp.force_min - result.forces[:, 0]).max() / size)
        high = float((result.forces[:, 0] - grasp.force_max).max() / size)
        if off > 1e-8 or max(-float(room.min()), low, high) > 1e-9 * largest:
            return f"SOLVED: equilibrium off by {off:.1e}, limits by {max(-float(room.min()), low, high):.1e}"
        return "" if factor > 1.0 - 1e-6 else f"SOLVED at factor {factor}"
    if result.status is SolveStatus.INFEASIBLE:
        if factor > 1.0:
            return f"INFEASIBLE at factor {factor}"
        if result.certificate is None or result.reach is None:
            return "INFEASIBLE without a certificate"
        reach = mpmath.mpf(min(result.reach, 1e300)) * mpmath.mpf("0.999")
        return "" if not digits or least_value(grasp, load, result.certificate, reach) > 0 else "false certificate"
    return "" if abs(factor - 1.0) < 1e-3 else f"undecided at factor {factor}"


def main() -> int:
    """Try them all."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--instances", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    rng, statuses, wrong = np.random.default_rng(asked.seed), Counter[str](), Counter[str]()
    pairs = asked.instances // 5
    moving: dict[int, GraspForceOptimizer] = {}
    hard = instances(asked.seed, max(1, (asked.instances - pairs) // (10 * len(FAMILIES))))
    for k, each in enumerate(track(hard, total=asked.instances - pairs, description="hard families")):
        grasp, load = each.grasp, each.load
        if k % 3 == 1:
            scale = 10.0 ** rng.uniform(-90.0, 250.0)
            grasp, load = replace(grasp, force_max=grasp.force_max * scale), load * scale
        optimizer = moving.get(len(grasp)) or moving.setdefault(len(grasp), GraspForceOptimizer(grasp))
        optimizer.update(grasp)
        result = optimizer.solve(load, warm_start=k % 3 == 2)
        statuses[result.status.value] += 1
        wrong[false_claim(grasp, load, result, each.factor, digits=k % 10 == 0)] += 1
    for _ in track(range(pairs), description="preloads"):
        grasp = paired(int(rng.integers(2**32)), 10.0, 1e3)
        load = LOAD / np.linalg.norm(LOAD) * 10.0 ** rng.uniform(-14.0, 1.0)
        optimizer = moving.get(len(grasp)) or moving.setdefault(len(grasp), GraspForceOptimizer(grasp))
        optimizer.update(grasp)
        result = optimizer.solve(load, warm_start=False)
        statuses["preloaded, " + result.status.value] += 1
        wrong[false_claim(grasp, load, result, 2.0, digits=False)] += 1
    console = Console()
    console.print(f"{sum(wrong.values())} instances: {dict(statuses)}")
    del wrong[""]
    for claim, count in wrong.most_common(20):
        console.print(f"FALSE, {count} times: {claim}", style="red")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
