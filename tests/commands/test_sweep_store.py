"""The folder of a sweep: whatever kills its writer, what is finished is there, whole, and nothing else is."""

import itertools
import os
import signal
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.commands.sweep.record import RunRecord, RunStatus, read_record, record_text
from palpate.commands.sweep.store import SweepFolder
from palpate.errors import InvalidValueError
from support.sweep_runs import SHORT, planned
from support.waiting import until

LARGE = 1_000_000
"""Letters that take long to write."""

figure_values = (
    st.none()
    | st.booleans()
    | st.integers(-(2**53), 2**53)
    | st.text()
    | st.floats(allow_nan=False, allow_infinity=False)
)


def record_for(plan, number, **more):
    case = plan.runs[number].case
    fields = {"status": RunStatus.DONE, "figures": {"x": 0.1 + number}, "duration": 1.0}
    return RunRecord(run=number, digest=case.digest, seed=case.seed, **(fields | more))


@given(st.dictionaries(st.text(), figure_values), st.text(), st.sampled_from(RunStatus))
def test_a_record_reads_back_to_the_last_bit(figures, message, status):
    record = RunRecord(run=3, digest="a", seed=2**62, status=status, message=message, figures=figures)
    back = read_record(record_text(record))
    assert back == record
    assert [type(value) for value in back.figures.values()] == [type(value) for value in figures.values()]


def test_finished_runs_are_there_again_and_what_cannot_be_read_is_run_again(tmp_path):
    plan, folder = planned("force=1:4:4"), SweepFolder(tmp_path)
    assert folder.begin(plan) == {}
    kept = [record_for(plan, number) for number in (0, 2, 3)]
    for record in kept:
        folder.keep(record)
    (tmp_path / "runs" / "000003.json").write_bytes(b"")  # as after a loss of power
    (tmp_path / "runs" / ".000001.json.0123abcd.part").write_bytes(b"{")  # as after a kill
    assert folder.begin(plan) == {0: kept[0], 2: kept[1]}
    assert not list((tmp_path / "runs").glob(".*"))


def test_a_record_of_another_run_is_not_taken_for_this_one(tmp_path):
    plan, other, folder = planned("force=1,2"), planned("force=3,4"), SweepFolder(tmp_path)
    folder.begin(plan)
    folder.keep(record_for(other, 1))
    folder.keep(record_for(plan, 0))
    (tmp_path / "runs" / "000000.json").rename(tmp_path / "runs" / "000001.json")
    assert folder.finished(plan) == {}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"vary": ("force=1,2,3",)}, ["force 1,2 there, 1,2,3 now"]),
        ({"vary": ("speed=0.02",)}, ["force 1,2 there, not varied now", "speed not varied there, 0.02 now"]),
        ({"seeds": 5}, ["seeds 1 there, 5 now"]),
        ({"fixed": (*SHORT, "seed=4")}, ["first seed 0 there, 4 now", "seed not set there, 4 now"]),
        ({"fixed": ("time=0.03", "noise=0.01")}, ["time 0.02 there, 0.03 now"]),
    ],
)
def test_another_sweep_is_refused_and_told_what_differs(tmp_path, change, words):
    SweepFolder(tmp_path).begin(planned("force=1,2"))
    now = {"vary": ("force=1,2",), **change}
    with pytest.raises(InvalidValueError, match="holds another sweep") as refused:
        SweepFolder(tmp_path).begin(planned(*now.pop("vary"), **now))
    for word in (*words, "--out"):
        assert word in str(refused.value)


def test_a_file_that_a_sweep_reads_must_be_the_same(tmp_path):
    file = tmp_path / "mine.yaml"
    file.write_text("speed: 0.02\n")
    folder = SweepFolder(tmp_path / "out")
    folder.begin(planned("force=1,2", config=file))
    folder.begin(planned("force=1,2", config=file))
    file.write_text("speed: 0.03\n")
    with pytest.raises(InvalidValueError, match="typed alike, but not the same"):
        folder.begin(planned("force=1,2", config=file))


def test_two_at_once_in_a_folder_are_one_too_many(tmp_path):
    first, second = SweepFolder(tmp_path), SweepFolder(tmp_path)
    with first.alone(), pytest.raises(InvalidValueError, match="at work there"), second.alone():
        pass
    with second.alone():
        pass


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
def test_a_writer_that_is_killed_at_whatever_instant_leaves_whole_records_and_no_lock(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "O_TMPFILE", 0, raising=False)  # with it, nothing shows that a kill came in time
    plan, folder = planned("force=1:4:4"), SweepFolder(tmp_path)
    torn = 0
    for kill in range(300):
        if torn == 3:
            return
        with folder.alone():
            folder.begin(plan)
            assert not list(folder.runs.glob("*.part")), "what the one before was writing is cleared away"
        writer = os.fork()
        if writer == 0:
            write_for_ever(plan, folder)
        until(lambda: len(list(folder.runs.glob("*.json"))) >= 4)
        time.sleep(0.0007 * (kill % 10))
        os.kill(writer, signal.SIGKILL)
        os.waitpid(writer, 0)
        torn += len(list(folder.runs.glob(".*.part")))
        for file in folder.runs.glob("*.json"):
            record = read_record(file.read_bytes())
            assert record is not None
            assert record.digest == plan.runs[record.run].case.digest
    pytest.fail("hardly a kill came while something was being written: that shows nothing")


def write_for_ever(plan, folder):
    """Overwrite four large records, with the folder locked."""
    try:
        with folder.alone():
            for turn in itertools.count():
                folder.keep(record_for(plan, turn % 4, message=str(turn % 10) * LARGE))
    finally:
        os._exit(1)


@given(st.binary(max_size=200))
def test_what_is_no_record_is_none(text):
    assert read_record(text) is None
