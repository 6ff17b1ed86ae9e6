"""Simulations do not see one another: next to each other in a process, or in different processes."""

import hashlib
from itertools import zip_longest

import pytest

from palpate.runtime.batch import quiet, results_of, run_batch
from runtime.simulated_backends import BACKENDS, NOISELESS, Run, digest, steps

SEEDS = (3, 4)
PERIODS = {kind: 1200 if "hand" in kind else 500 for kind in BACKENDS}
"""A hand closes for 0.9 s."""
RUNS = [Run(kind, seed, PERIODS[kind]) for kind in BACKENDS for seed in SEEDS]


@pytest.fixture(scope="module")
def alone():
    """What each run says by itself, in this process."""
    return {run: digest(run) for run in RUNS}


@pytest.mark.slow
def test_the_runs_compared_here_touch_something_and_depend_on_the_seed(alone):
    assert all(touched for _, touched in alone.values())
    for kind in BACKENDS:
        one, other = (alone[Run(kind, seed, PERIODS[kind])] for seed in SEEDS)
        assert (one == other) is (kind == NOISELESS)


@pytest.mark.slow
def test_each_back_end_gives_the_same_run_bit_for_bit_in_another_process(alone):
    """New interpreters, not forks: nothing is shared but the code and the seed."""
    assert results_of(run_batch(digest, RUNS, 2, quiet)) == list(alone.values())


def interleaved(runs):
    """What each of several runs says that are stepped in turns."""
    said = [[] for _ in runs]
    for periods in zip_longest(*map(steps, runs)):
        for told, period in zip(said, periods, strict=True):
            if period is not None:
                told.append(repr(period))
    return said


@pytest.mark.slow
def test_all_back_ends_at_once_do_not_disturb_one_another(alone):
    said = ["\n".join(periods) for periods in interleaved(RUNS)]
    assert [hashlib.sha256(text.encode()).hexdigest() for text in said] == [told for told, _ in alone.values()]
