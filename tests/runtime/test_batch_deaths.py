"""Real processes, real signals: workers die and nothing is lost; the parent dies and nobody is left."""

import os
import signal
import struct
import subprocess
import sys
from pathlib import Path

import psutil
import pytest

from palpate.runtime.batch import BatchError, Failure, FailureKind, Success, quiet, results_of, run_batch
from palpate.runtime.batch import process as worker_process
from palpate.runtime.batch.pickling import packed
from palpate.runtime.batch.process import WorkerProcess
from palpate.runtime.batch.worker import Ready
from runtime.batch_work import Deadly, Toss, large, toss, walk
from support.waiting import until

pytestmark = pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no SIGKILL on this system")
TESTS = Path(__file__).parents[1]
PYTHONPATH = os.pathsep.join(filter(None, (str(TESTS), os.environ.get("PYTHONPATH"))))
PROCESS_TIMEOUT = 60.0
"""For a process to do what it should [s]."""


def attempts(folder, seed):
    """The processes that tried a case, in order."""
    return [int(path.name.split("-")[2]) for path in sorted(folder.glob(f"{seed}-*"))]


def workers():
    """This process's children, but for the one that watches over shared resources."""
    return [child for child in psutil.Process().children() if "resource_tracker" not in "".join(child.cmdline())]


def numbers(outcomes):
    """What does not depend on how sets of strings are ordered, which this process does otherwise."""
    return [outcome.result[1] for outcome in outcomes]


@pytest.mark.parametrize("processes", [pytest.param(1, marks=pytest.mark.slow), 2])
def test_a_case_whose_process_is_killed_is_run_again_once_in_another_and_nothing_is_lost(tmp_path, processes):
    cases = [Toss(seed, tmp_path, deaths=int(seed == 1)) for seed in range(4)]
    outcomes = run_batch(toss, cases, processes, quiet)
    assert all(isinstance(outcome, Success) for outcome in outcomes)
    assert numbers(outcomes) == [walk(seed)[1] for seed in range(4)]
    first, second = attempts(tmp_path, 1)
    assert first != second
    assert [len(attempts(tmp_path, seed)) for seed in range(4)] == [1, 2, 1, 1]
    assert workers() == []


@pytest.mark.slow
def test_a_case_that_always_kills_its_process_or_takes_too_long_fails_alone(tmp_path):
    cases = [Toss(i, tmp_path, 9 * (i == 1), pause=100.0 if i == 3 else 0.05) for i in range(5)]
    outcomes = run_batch(toss, cases, 2, quiet, longest=2.0)
    assert [type(outcome) for outcome in outcomes] == [Success, Failure, Success, Failure, Success]
    failure, late = (each for each in outcomes if isinstance(each, Failure))
    assert (failure.case, failure.kind, failure.traceback) == (cases[1], FailureKind.DIED, "")
    assert "SIGKILL" in failure.error
    assert "was busy with one case for more than 2 s" in late.error
    with pytest.raises(BatchError, match=r"seed=1.*ended its process, twice: .*SIGKILL"):
        results_of(outcomes)
    # no other case was disturbed
    assert [len(attempts(tmp_path, i)) for i in (0, 1, 2, 4)] == [1, 2, 1, 1]
    assert workers() == []


@pytest.mark.slow
def test_an_idle_worker_that_is_killed_costs_nothing(tmp_path):
    def kill_the_idle(progress):
        if progress.index == 1:
            os.kill(attempts(tmp_path, 1)[0], signal.SIGKILL)

    outcomes = run_batch(toss, [Toss(0, tmp_path, pause=1.0), Toss(1, tmp_path)], 2, kill_the_idle)
    assert numbers(outcomes) == [walk(seed)[1] for seed in range(2)]
    assert [len(attempts(tmp_path, seed)) for seed in range(2)] == [1, 1]


@pytest.mark.slow
def test_a_worker_killed_while_it_sends_its_result_is_found_too():
    """Half a result must neither be waited for nor be taken for one."""
    worker = WorkerProcess(packed("work", large))
    worker.start()
    until(lambda: isinstance(worker.receive(), Ready))
    assert worker.begin(0, packed("case", 7))
    until(lambda: unread(worker) > 10_000)  # it has begun to send, and cannot end before somebody reads
    worker.kill()
    until(lambda: worker.receive() is None)
    assert worker.bury() == "ended by SIGKILL"


def unread(worker):
    """Bytes that wait in its pipe."""
    import fcntl
    import termios

    return struct.unpack("i", fcntl.ioctl(worker.pipe.fileno(), termios.FIONREAD, bytes(4)))[0]


@pytest.mark.slow
def test_a_worker_that_is_stopped_is_replaced_and_its_case_done_again(tmp_path, monkeypatch):
    monkeypatch.setattr(worker_process, "MOST_SILENT", 5.0)
    stopped = []

    def stop(progress):
        if progress.done == 2 and attempts(tmp_path, 2) and not stopped:
            stopped.append(attempts(tmp_path, 2)[0])
            os.kill(stopped[0], signal.SIGSTOP)

    outcomes = run_batch(toss, [Toss(seed, tmp_path, pause=float(seed == 2)) for seed in range(3)], 1, stop)
    assert numbers(outcomes) == [walk(seed)[1] for seed in range(3)]
    assert [len(attempts(tmp_path, seed)) for seed in range(3)] == [1, 1, 2]
    assert workers() == []


def test_a_parent_that_was_stopped_itself_finds_nobody_late(monkeypatch):
    clock = iter([0.0, 0.1, 3600.0, 3600.2])
    monkeypatch.setattr(worker_process.time, "monotonic", lambda: next(clock))
    time, seen = worker_process.ParentTime(most=1.0), []
    for _ in range(3):
        time.look()
        seen.append(time.now)
    assert seen == pytest.approx([0.1, 1.1, 1.3])


@pytest.mark.slow
def test_workers_that_all_die_at_once_are_given_up():
    with pytest.raises(BatchError, match=r"workers died before they did anything; the last ended by SIGKILL"):
        run_batch(Deadly(), range(3), 1, quiet)
    assert workers() == []


@pytest.mark.slow
def test_an_exception_of_the_one_who_watches_ends_the_workers_at_once(tmp_path, monkeypatch):
    """All are killed before any is waited for."""
    done = []
    for name in ("kill", "bury"):
        method = getattr(WorkerProcess, name)
        monkeypatch.setattr(
            WorkerProcess, name, lambda self, name=name, method=method: done.append(name) or method(self)
        )

    def stop(progress):
        if progress.done:
            raise KeyError("seen enough")

    with pytest.raises(KeyError, match="seen enough"):
        run_batch(toss, [Toss(0, tmp_path), Toss(1, tmp_path, pause=100.0)], 2, stop)
    assert done == ["kill", "kill", "bury", "bury"]
    assert workers() == []


def members(group):
    """Processes of a group that still live."""
    found = []
    for process in psutil.process_iter(["status"]):
        try:
            if os.getpgid(process.pid) == group and process.info["status"] != psutil.STATUS_ZOMBIE:
                found.append(process)
        except ProcessLookupError:
            continue
    return found


@pytest.mark.parametrize(
    ("how", "when"),
    [
        (signal.SIGINT, "at work"),
        (signal.SIGKILL, "at work"),
        pytest.param(signal.SIGTERM, "at work", marks=pytest.mark.slow),
        pytest.param(signal.SIGINT, "starting", marks=pytest.mark.slow),
        pytest.param(signal.SIGTERM, "starting", marks=pytest.mark.slow),
        pytest.param(signal.SIGKILL, "starting", marks=pytest.mark.slow),
    ],
)
def test_no_worker_outlives_its_parent(tmp_path, how, when):
    """Ctrl-C reaches everybody in the terminal, the others the parent only."""
    program = subprocess.Popen(
        [sys.executable, "-m", "runtime.batch_process", str(tmp_path)],
        env=os.environ | {"PYTHONPATH": PYTHONPATH},
        cwd=TESTS,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        if when == "at work":
            until(lambda: attempts(tmp_path, 0) and attempts(tmp_path, 1))
        else:
            until(lambda: len(members(program.pid)) >= 3)
        (os.killpg if how is signal.SIGINT else os.kill)(program.pid, how)
        _, message = program.communicate(timeout=PROCESS_TIMEOUT)  # ends when nobody holds standard error any more
        assert program.returncode == -how
        until(lambda: members(program.pid) == [])
        if how is signal.SIGINT:
            # the parent's, and nobody else's
            assert message.count("Traceback") == 1
            assert message.rstrip().endswith("KeyboardInterrupt")
        if when == "at work":
            assert len(list(tmp_path.iterdir())) == 2
    finally:
        for process in members(program.pid):
            process.kill()
