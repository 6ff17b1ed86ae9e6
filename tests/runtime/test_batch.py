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
from runtime.batch_work import Grumpy, Toss, surroundings, toss, walk

TESTS = Path(__file__).parents[1]
PYTHONPATH = os.pathsep.join(filter(None, (str(TESTS), os.environ.get("PYTHONPATH"))))


@pytest.mark.slow
def test_any_number_of_processes_gives_the_numbers_of_a_plain_loop_in_the_order_of_the_cases():
    # later cases end sooner: the order of the results is not the order of completion
    cases = [Toss(seed, pause=0.02 * (6 - seed)) for seed in range(7)]
    found = {n: run_batch(toss, cases, n, quiet) for n in (1, 2, 4)}
    assert len({repr(results_of(outcomes)) for outcomes in found.values()}) == 1
    # sets of strings are ordered differently in every process that does not fix its hash seed, also in this one
    assert [numbers for _, numbers in results_of(found[2])] == [walk(case.seed)[1] for case in cases]
    for outcome, case in zip([*found[1], *found[2], *found[4]], cases * 3, strict=True):
        assert isinstance(outcome, Success)
        assert outcome.case is case
        assert outcome.duration >= case.pause
    assert run_batch(toss, [], 4) == []  # no cases need no process


@pytest.mark.slow
def test_a_case_that_fails_is_reported_and_the_others_go_on():
    """Work that raises, asks to end the interpreter, or returns something that does not pickle."""
    errors = [LookupError("nothing there"), SystemExit(3), KeyboardInterrupt()]
    cases = [Toss(0), *(Toss(i, error=error) for i, error in enumerate(errors, 1)), Toss(4, loose=True), Toss(5)]
    reported = []
    outcomes = run_batch(toss, cases, 2, reported.append)
    assert [type(outcome) for outcome in outcomes] == [Success, *[Failure] * 4, Success]
    assert all(outcome.case is case for outcome, case in zip(outcomes, cases, strict=True))
    raised, *_, loose = failures = [each for each in outcomes if isinstance(each, Failure)]
    assert [failure.error for failure in failures[:3]] == [
        "LookupError: nothing there",
        "SystemExit: 3",
        "KeyboardInterrupt",
    ]
    assert {failure.kind for failure in failures[:3]} == {FailureKind.RAISED}
    # the traceback begins at the work, not at its caller
    assert raised.traceback.count("File ") == 1
    assert "batch_work.py" in raised.traceback
    assert "raise case.error" in raised.traceback
    assert "result['lock'][0] = <unlocked" in loose.error
    assert "a lock does not pickle" in loose.error
    with pytest.raises(BatchError, match=r"4 of 6 cases failed; .*seed=1(.|\n)*LookupError: nothing there"):
        results_of(outcomes)
    ended = [progress for progress in reported if progress.index is not None]
    assert sorted(progress.index for progress in ended) == list(range(6))
    assert all(progress.outcome is outcomes[progress.index] for progress in ended)
    assert [progress.done for progress in ended] == [1, 2, 3, 4, 5, 6]
    assert (reported[-1].cases, reported[-1].done, reported[-1].failed) == (6, 6, 4)


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


@dataclass
class Scene:
    """Has a part that cannot travel."""

    name: str
    part: object


class Loose:
    def __init__(self, part):
        self.name, self.part = "x", part


LOCK = threading.Lock()


@pytest.mark.parametrize(
    ("work", "cases", "named"),
    [
        (toss, [1, LOCK], r"cases\[1\] = <unlocked.*a lock does not pickle"),
        (toss, [1, Scene("x", {"a": [0, LOCK]})], r"cases\[1\]\.part\['a'\]\[1\] = <unlocked"),
        (toss, [Loose((LOCK,))], r"cases\[0\]\.part\[0\] = <unlocked"),
        ((lambda lock: lambda case: lock)(LOCK), [1], "work, lock = <unlocked"),
        (partial(toss, key=LOCK), [1], r"work\.keywords\['key'\] = <unlocked"),
        (Scene("x", LOCK).__eq__, [1], r"work\.__self__\.part = <unlocked"),
        pytest.param(
            Grumpy(),
            range(3),
            r"work cannot be loaded in another process(.|\n)*not at home",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_work_and_cases_that_cannot_travel_are_refused_by_the_name_of_their_part(work, cases, named):
    with pytest.raises(InvalidValueError, match=named):
        run_batch(work, cases, 2, quiet)


class Screen(io.StringIO):
    """A terminal."""

    def isatty(self):
        return True


def shown(elapsed, terminal=True):
    screen = Screen() if terminal else io.StringIO()
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
