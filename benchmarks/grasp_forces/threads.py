"""Several threads that solve at once, with one optimizer or with one each."""

import copy
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable

import numpy as np

from palpate.errors import ConcurrentUseError, FloatArray
from palpate.grasp import GraspContacts, GraspForceOptimizer

EQUAL, OTHER, NAMED, WORSE = "equal digits", "other digits", ConcurrentUseError.__name__, "other errors"
LOADS = 16
SWITCH = 1e-5
"""[s] between turns of threads, for as many collisions as can be."""

PAUSE = 2e-5
"""[s] before a thread that was refused asks again."""


def loads_of(rng: np.random.Generator) -> FloatArray:
    """Loads that are held, and some that are not, shape (LOADS, 6) [N, N m]."""
    loads = rng.standard_normal((LOADS, 6)) * [1.0, 1.0, 1.0, 0.005, 0.005, 0.005]
    loads[::4] *= 1e3
    return np.asarray(loads)


def solved_by_threads(
    grasp: GraspContacts, objective: str, loads: FloatArray, threads: int, solves: int, *, shared: bool
) -> Counter[str]:
    """Return how often each thread's forces were those of one thread alone, or which error it got.

    A thread that is refused asks again, so that each gets `solves` answers.
    """
    one = GraspForceOptimizer(grasp, objective)
    expected = [one.solve(load, warm_start=False).forces for load in loads]

    def solve(made: Callable[[], GraspForceOptimizer], counts: Counter[str]) -> None:
        optimizer = made()
        begin.wait()
        for k in range(solves):
            while True:  # until it gets an answer
                try:
                    forces = optimizer.solve(loads[k % LOADS], warm_start=False).forces
                    counts[EQUAL if (forces == expected[k % LOADS]).all() else OTHER] += 1
                except ConcurrentUseError:
                    counts[NAMED] += 1
                    time.sleep(PAUSE)
                    continue
                except Exception as error:
                    counts[f"{WORSE}: {error!r}"] += 1
                break

    ways: list[Callable[[], GraspForceOptimizer]] = [
        (lambda: one),
        (lambda: copy.copy(one)),
        (lambda: GraspForceOptimizer(grasp, objective)),
    ]
    begin, found = threading.Barrier(threads), [Counter[str]() for _ in range(threads)]
    running = [
        threading.Thread(target=solve, args=(ways[0 if shared else 1 + k % 2], counts))
        for k, counts in enumerate(found)
    ]
    before = sys.getswitchinterval()
    sys.setswitchinterval(SWITCH)
    try:
        for each in running:
            each.start()
        for each in running:
            each.join()
    finally:
        sys.setswitchinterval(before)
    return sum(found, Counter())
