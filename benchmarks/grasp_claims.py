"""Whether claims about grasp forces are true: hard grasps, any scale, preloads, motion, boundary; threads.

    python benchmarks/grasp_claims.py [claims | threads] [--instances 100000] [--solves 10000] [--seed 1]

claims: every result of min_effort is judged at 50 digits. SOLVED is false if forces leave more than 1e-8 of load
or preload, exceed a limit by more than 1e-9, are not numbers, or if clarabel bears less; INFEASIBLE if it bears
more; a certificate unless it proves its claim up to its reach. Of an undecided load the table gives the largest
distance to loads that are held and to loads that are not. threads: four threads solve at once, with one
optimizer of each objective and with one each; forces must equal those of one thread, digit for digit, or the
error be `ConcurrentUseError`. Five minutes.

Exit code 1 if any claim is false, or something is undecided that is farther than 1e-10 from the boundary.
"""

from argparse import ArgumentParser, Namespace
from collections import Counter
from collections.abc import Iterator
from itertools import chain

import numpy as np
from grasp_forces.claimed import CLAIMED, Family
from grasp_forces.exact_claims import Claim, from_boundary, judged
from grasp_forces.threads import EQUAL, NAMED, loads_of, solved_by_threads
from harness.campaign import Listing, start, tracked

from palpate.grasp import GraspForceOptimizer, Objective, SolveStatus
from support.grasp_families import paired

UNDECIDED_WITHIN = 1e-10
THREADS = 4
WRONG = (Claim.FALSE_SOLVED, Claim.FALSE_INFEASIBLE, Claim.FALSE_CERTIFICATE, Claim.INVALID)
SHOWN = (SolveStatus.SOLVED, SolveStatus.INFEASIBLE, *WRONG, Claim.UNDECIDED)


def tried(name: str, family: Family, count: int, rng: np.random.Generator) -> tuple[list[object], list[str], bool]:
    """Return a row of the table, false claims, and whether all claims of a family are true."""
    counts, reasons, farthest, optimizers = Counter[object](), Counter[str](), 0.0, {}
    for each in tracked(family(count, rng), count, name):
        n = len(each.grasp)
        if n not in optimizers:
            optimizers[n] = GraspForceOptimizer(each.grasp)
        optimizers[n].update(each.grasp)
        result = optimizers[n].solve(each.load, warm_start=each.warm)
        verdict = judged(each.grasp, each.load, result, each.factor)
        counts.update((result.status, verdict.claim))
        if verdict.claim in WRONG:
            reasons[f"{verdict.claim.value}: {verdict.why}"] += 1
        if verdict.claim is Claim.UNDECIDED:
            farthest = max(farthest, from_boundary(each.grasp, each.load))
    nearest = f"{farthest:.0e}" if counts[Claim.UNDECIDED] else ""
    row = [name, sum(counts[each] for each in SolveStatus), *(counts[each] for each in SHOWN), nearest]
    notes = [f"{name}, {often} times: {why}" for why, often in reasons.most_common(10)]
    return row, notes, not reasons and farthest <= UNDECIDED_WITHIN


def claims(options: Namespace) -> Iterator[Listing]:
    """Judge all families."""
    found = []
    for k, (name, (family, share)) in enumerate(CLAIMED.items()):
        count = max(1, round(share * options.instances))
        found.append(tried(name, family, count, np.random.default_rng([options.seed, k])))
    rows, notes, right = zip(*found, strict=True)
    heads = ("judged at 50 digits", "instances", *(each.value for each in SHOWN), "at most so far")
    yield Listing("Claims", heads, rows, all(right), list(chain.from_iterable(notes)))


def threads(options: Namespace) -> Iterator[Listing]:
    """Try all objectives with one optimizer and one each."""
    loads, rows, right = loads_of(np.random.default_rng(options.seed)), [], True
    for objective in Objective:
        for shared in (True, False):
            counts = solved_by_threads(
                paired(5, 0.0, 50.0), objective.value, loads, THREADS, options.solves, shared=shared
            )
            wrong = {each: often for each, often in counts.items() if each not in (EQUAL, NAMED)}
            right &= not wrong and (shared or not counts[NAMED])
            told = (counts.total(), counts[EQUAL], counts[NAMED], wrong or "none")
            rows.append((objective.value, "one" if shared else "one each", *told))
    yield Listing("Four threads", ("objective", "optimizer", "solves", EQUAL, NAMED, "anything else"), rows, right)


def add_options(parser: ArgumentParser) -> None:
    """Add numbers of loads and the seed."""
    parser.add_argument("--instances", type=int, default=100_000, help="loads of `claims` (%(default)s)")
    parser.add_argument("--solves", type=int, default=10_000, help="of each thread (%(default)s)")
    parser.add_argument("--seed", type=int, default=1)


if __name__ == "__main__":
    start(__doc__, {"claims": claims, "threads": threads}, add_options)
