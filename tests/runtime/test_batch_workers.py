"""Workers that several batches share: started once, and started anew where one that is old could do otherwise."""

import os
import signal
import time

import pytest

from palpate.errors import InvalidValueError
from palpate.runtime.batch import Success, Workers, quiet, results_of, run_batch
from runtime.batch_work import Grumpy, Toss, counted, pid, toss, walk
from runtime.test_batch_deaths import workers

pytestmark = pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no SIGKILL on this system")


def pids(shared, cases=4):
    """Who has done some cases."""
    return set(results_of(run_batch(pid, [0.05] * cases, shared, quiet)))


@pytest.mark.slow
def test_batches_with_other_work_are_done_by_the_same_processes_and_none_is_left():
    with Workers(2) as shared:
        pids(shared)
        first = {each.pid for each in workers()}  # one of them may not have had a case yet
        found = results_of(run_batch(toss, [Toss(seed) for seed in range(3)], shared, quiet))
        assert [numbers for _, numbers in found] == [walk(seed)[1] for seed in range(3)]
        assert pids(shared) <= first
        assert len(workers()) == len(first) <= 2
    assert workers() == []


@pytest.mark.slow
@pytest.mark.parametrize("changed", ["folder", "environment", "path"])
def test_a_worker_that_was_started_elsewhere_is_not_taken(changed, tmp_path, monkeypatch):
    with Workers(1) as shared:
        before = pids(shared)
        match changed:
            case "folder":
                monkeypatch.chdir(tmp_path)
            case "environment":
                monkeypatch.setenv("PALPATE_TEST", "other")
            case _:
                monkeypatch.syspath_prepend(tmp_path)
        assert not before & pids(shared)
        assert len(workers()) == 1


@pytest.mark.slow
def test_loaded_modules_stay_and_a_module_that_was_edited_is_imported_anew(tmp_path, monkeypatch):
    file = tmp_path / "edited_work.py"
    file.write_text("def work(case):\n    return 1\n")
    monkeypatch.syspath_prepend(tmp_path)
    import edited_work  # type: ignore[import-not-found]

    with Workers(1) as shared:
        before = pids(shared)
        assert results_of(run_batch(edited_work.work, [0], shared, quiet)) == [1]
        assert results_of(run_batch(counted, [0, 0], shared, quiet)) == [1, 2]
        assert results_of(run_batch(counted, [0], shared, quiet)) == [3]
        assert pids(shared) == before
        time.sleep(0.05)  # file systems keep time in steps
        file.write_text("def work(case):\n    return 2222\n")
        assert results_of(run_batch(edited_work.work, [0], shared, quiet)) == [2222]


@pytest.mark.slow
def test_workers_are_replaced_after_an_abandoned_batch_or_when_they_were_killed():
    def stop(progress):
        raise KeyError("seen enough")

    with Workers(2) as shared:
        before = pids(shared)
        with pytest.raises(KeyError, match="seen enough"):
            run_batch(toss, [Toss(0, pause=100.0)] * 2, shared, stop)
        assert workers() == []
        with pytest.raises(InvalidValueError, match="cannot be loaded in another process"):
            run_batch(Grumpy(), [0], shared, quiet)
        new = pids(shared)
        assert not before & new
        for each in new:
            os.kill(each, signal.SIGKILL)
        assert all(isinstance(each, Success) for each in run_batch(toss, [Toss(0), Toss(1)], shared, quiet))
