"""Whether what is claimed of grasp forces is true: hard grasps, any scale, preloads, motion, boundary; threads.

    python benchmarks/grasp_claims.py [--instances 100000] [--solves 10000] [--seed 1]

Every result of min_effort is judged at 50 digits. SOLVED is false if forces leave more than 1e-8 of load or
preload, are beyond a limit by more than 1e-9, are not numbers, or where clarabel bears less than the load;
INFEASIBLE where it bears more; a certificate unless it proves what it says up to its reach. Of what is undecided
it is told how near it is, at most, to loads that are held and to such as are not. Then four threads solve at once,
with one optimizer of each objective and with one each: forces must equal those of one thread, digit for digit, or
the error be the one for it. Five minutes.

Exit code 1 if any claim is false, or something is undecided that is farther than 1e-10 from the boundary.
"""

import argparse
import sys
from collections import Counter
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests"))

from grasp_forces.claimed import CLAIMED, Family
from grasp_forces.exact_claims import Claim, from_boundary, judged
from grasp_forces.threads import EQUAL, NAMED, loads_of, solved_by_threads

from palpate.grasp import GraspForceOptimizer, Objective, SolveStatus
from support.grasp_families import paired

UNDECIDED_WITHIN = 1e-10
THREADS = 4
WRONG = (Claim.FALSE_SOLVED, Claim.FALSE_INFEASIBLE, Claim.FALSE_CERTIFICATE, Claim.INVALID)


def tried(
    name: str, family: Family, count: int, rng: np.random.Generator, console: Console
) -> tuple[list[str], bool]:
    """Return a row of the table, and whether all claims of a family are true."""
    counts, reasons, farthest, optimizers = Counter[object](), Counter[str](), 0.0, {}
    for each in track(family(count, rng), total=count, description=name, console=console):
        n = len(each.grasp)
        if n not in optimizers:
            optimizers[n] = GraspForceOptimizer(each.grasp)
        optimizers[n].update(each.grasp)
        result = optimizers[n].solve(each.load, warm_start=each.warm)
        verdict = judged(each.grasp, each.load, result, each.factor)
        counts[result.status] += 1
        counts[verdict.claim] += 1
        if verdict.claim in WRONG:
            reasons[f"{verdict.claim.value}: {verdict.why}"] += 1
        if verdict.claim is Claim.UNDECIDED:
            farthest = max(farthest, from_boundary(each.grasp, each.load))
    for why, often in reasons.most_common(10):
        console.print(f"{name}, {often} times: {why}", style="red")
    told = [counts[each] for each in (SolveStatus.SOLVED, SolveStatus.INFEASIBLE, *WRONG, Claim.UNDECIDED)]
    nearest = f"{farthest:.0e}" if counts[Claim.UNDECIDED] else ""
    row = [name, str(sum(counts[each] for each in SolveStatus)), *map(str, told), nearest]
    return row, not reasons and farthest <= UNDECIDED_WITHIN


def threaded(solves: int, rng: np.random.Generator, console: Console) -> bool:
    """Try all objectives with one optimizer and one each; whether all is right."""
    table = Table("four threads", "optimizer", "asked", EQUAL, NAMED, "anything else")
    grasp, loads, right = paired(5, 0.0, 50.0), loads_of(rng), True
    for objective in Objective:
        for shared in (True, False):
            counts = solved_by_threads(grasp, objective.value, loads, THREADS, solves, shared=shared)
            wrong = {each: often for each, often in counts.items() if each not in (EQUAL, NAMED)}
            right &= not wrong and (shared or not counts[NAMED])
            told = (str(counts.total()), str(counts[EQUAL]), str(counts[NAMED]), str(wrong or "none"))
            table.add_row(objective.value, "one" if shared else "one each", *told)
    console.print(table)
    return right


def main() -> int:
    """Try them all."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--instances", type=int, default=100_000)
    parser.add_argument("--solves", type=int, default=10_000, help="of each thread (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    console, right = Console(width=140), True
    heads = ("solved", "infeasible", *(each.value for each in WRONG), "undecided", "at most so far")
    table = Table("judged at 50 digits", "instances", *heads)
    for k, (name, (family, share)) in enumerate(CLAIMED.items()):
        rng = np.random.default_rng([asked.seed, k])
        row, true = tried(name, family, max(1, round(share * asked.instances)), rng, console)
        table.add_row(*row)
        right &= true
    console.print(table)
    right &= threaded(asked.solves, np.random.default_rng(asked.seed), console)
    return int(not right)


if __name__ == "__main__":
    sys.exit(main())
