"""A batch of independent runs: order, equal bits, failures that stay alone, what does not pickle, the bar."""

import ast
import io
import os
import subprocess
import sys
import threading
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from palpate.errors import InvalidValueError
from palpate.runtime.batch import (
    BatchError,
    BatchProgress,
    Failure,
    FailureKind,
    Success,
    batch_bar,
    quiet,
    results_of,
    run_batch,
)
from runtime.batch_work import Grumpy, Toss, leave, surroundings, toss, unsendable, walk

TESTS = Path(__file__).parents[1]
PYTHONPATH = os.pathsep.join(filter(None, (str(TESTS), os.environ.get("PYTHONPATH"))))


@pytest.mark.slow
def test_any_number_of_processes_gives_the_numbers_of_a_plain_loop_in_the_order_of_the_cases():
    # later cases end sooner: what comes first is not what was first
    cases = [Toss(seed, pause=0.02 * (6 - seed)) for seed in range(7)]
    found = {n: run_batch(toss, cases, n, quiet) for n in (1, 2, 4)}
    one, two, four = (repr(results_of(outcomes)) for outcomes in found.values())
    assert one == two == four
    # sets of strings are in another order in every process that does not say otherwise, also in this one
    assert [numbers for _, numbers in results_of(found[2])] == [walk(case.seed)[1] for case in cases]
    for outcomes in found.values():
        for outcome, case in zip(outcomes, cases, strict=True):
            assert isinstance(outcome, Success)
            assert outcome.case is case
            assert outcome.duration >= case.pause


@pytest.mark.slow
def test_a_case_that_raises_is_reported_with_its_traceback_and_the_others_go_on():
    cases = [Toss(0), Toss(1, error="nothing there"), Toss(2)]
    reported = []
    outcomes = run_batch(toss, cases, 2, reported.append)
    assert [type(outcome) for outcome in outcomes] == [Success, Failure, Success]
    failure = outcomes[1]
    assert isinstance(failure, Failure)
    assert failure.case is cases[1]
    assert failure.kind is FailureKind.RAISED
    assert failure.error == "LookupError: nothing there"
    # from the work on, and not from what called it
    assert failure.traceback.count("File ") == 1
    assert "batch_work.py" in failure.traceback
    assert "raise LookupError(case.error)" in failure.traceback
    with pytest.raises(BatchError, match=r"1 of 3 cases failed; .*seed=1(.|\n)*LookupError: nothing there"):
        results_of(outcomes)
    ended = [progress for progress in reported if progress.index is not None]
    assert sorted(progress.index for progress in ended) == [0, 1, 2]
    assert all(progress.outcome is outcomes[progress.index] for progress in ended)
    assert [progress.done for progress in ended] == [1, 2, 3]
    assert (reported[-1].cases, reported[-1].done, reported[-1].failed) == (3, 3, 1)


@pytest.mark.slow
def test_work_that_asks_to_end_the_interpreter_ends_its_case():
    failures = run_batch(leave, [True, False], 1, quiet)
    for failure, error in zip(failures, ["SystemExit: 3", "KeyboardInterrupt"], strict=True):
        assert isinstance(failure, Failure)
        assert (failure.kind, failure.error) == (FailureKind.RAISED, error)


@pytest.mark.slow
def test_what_is_defined_on_the_spot_travels_along():
    offset, prepared = 10, []

    @dataclass(frozen=True)
    class Local:
        number: int

    outcomes = run_batch(
        lambda case: Local(case.number + offset),
        [Local(1), Local(2)],
        2,
        quiet,
        lambda: prepared.append(os.getpid()),
    )
    assert results_of(outcomes) == [Local(11), Local(12)]
    assert prepared == [os.getpid()]


@pytest.mark.slow
def test_workers_are_one_thread_deaf_to_ctrl_c_and_no_more_than_cases():
    found = results_of(run_batch(surroundings, range(2), 7, quiet))
    for reported, numba_threads, threads, deaf, _ in found:
        assert set(reported) == {"1"}
        # the one that works, and the one that listens
        assert (numba_threads, threads, deaf) == (1, 2, True)
    assert os.getpid() not in {pid for *_, pid in found}
    assert len({pid for *_, pid in found}) <= 2


def test_no_cases_need_no_process():
    assert run_batch(toss, [], 4) == []


@dataclass
class Scene:
    """Has a part that cannot travel."""

    name: str
    part: object


class Loose:
    def __init__(self, part):
        self.name, self.part = "x", part


@pytest.mark.parametrize(
    ("cases", "named"),
    [
        ([1, threading.Lock()], r"cases\[1\] = <unlocked"),
        ([1, Scene("x", {"a": [0, threading.Lock()]})], r"cases\[1\]\.part\['a'\]\[1\] = <unlocked"),
        ([Loose((threading.Lock(),))], r"cases\[0\]\.part\[0\] = <unlocked"),
    ],
)
def test_a_case_that_does_not_pickle_is_refused_by_the_name_of_its_part(cases, named):
    with pytest.raises(InvalidValueError, match=named + r".*a lock does not pickle"):
        run_batch(toss, cases, 1, quiet)


def test_work_that_does_not_pickle_is_refused_by_the_name_of_its_part():
    lock = threading.Lock()
    with pytest.raises(InvalidValueError, match=r"work, lock = <unlocked"):
        run_batch(lambda case: lock, [1], 1, quiet)
    with pytest.raises(InvalidValueError, match=r"work\.keywords\['key'\] = <unlocked"):
        run_batch(partial(toss, key=lock), [1], 1, quiet)
    with pytest.raises(InvalidValueError, match=r"work\.__self__\.part = <unlocked"):
        run_batch(Scene("x", lock).__eq__, [1], 1, quiet)


@pytest.mark.slow
def test_a_result_that_does_not_pickle_fails_its_case_by_the_name_of_its_part():
    outcomes = run_batch(unsendable, range(3), 1, quiet)
    assert [isinstance(outcome, Success) for outcome in outcomes] == [True, False, True]
    failure = outcomes[1]
    assert isinstance(failure, Failure)
    assert "result['lock'][0] = <unlocked" in failure.error
    assert "a lock does not pickle" in failure.error


@pytest.mark.slow
def test_work_that_cannot_be_loaded_elsewhere_is_refused():
    with pytest.raises(InvalidValueError, match=r"work cannot be loaded in another process(.|\n)*not at home"):
        run_batch(Grumpy(), range(3), 2, quiet)


def shown(elapsed, terminal=True):
    screen = io.StringIO()
    console = Console(file=screen, force_terminal=terminal, width=100)
    with batch_bar(console) as show:
        for done, time in enumerate(np.linspace(0.0, elapsed, 5)):
            show(BatchProgress(4, done, min(done, 1), float(time)))
    return screen.getvalue()


def test_a_bar_shows_from_two_seconds_on_and_only_on_a_terminal():
    assert shown(1.9) == ""
    assert shown(8.0, terminal=False) == ""
    assert "4/4" in shown(8.0)
    assert "1 failed" in shown(8.0)


@pytest.mark.slow
def test_a_kernel_that_was_prepared_is_compiled_by_no_worker(tmp_path):
    """The folder of compiled code is empty at the beginning."""

    def compiled(*arguments):
        environment = os.environ | {"PYTHONPATH": PYTHONPATH, "NUMBA_CACHE_DIR": str(tmp_path / str(arguments))}
        program = [sys.executable, "-m", "runtime.batch_kernel", *arguments]
        printed = subprocess.run(program, env=environment, capture_output=True, text=True, check=True).stdout
        found = ast.literal_eval(printed)
        assert [answer for answer, *_ in found] == [0.0, 2.0, 4.0, 6.0]
        return sum(misses for *_, misses in found)

    assert compiled() > 0  # or this test could not tell
    assert compiled("prepare") == 0
