"""The disk is full, or slow: the run goes on as planned, and its result says what became of the log."""

import resource
import threading
from contextlib import contextmanager

import pytest

from faults.fault_checks import periods_until_safe
from faults.fault_rig import FaultyBackend, Rig, carry_out
from faults.fault_table import ANYWHERE
from palpate.runtime.data import Phase
from palpate.runtime.log import LogWriter, Recorder, read_log
from palpate.runtime.loop import run
from palpate.runtime.result import Ending
from palpate.runtime.supervision import Limits
from runtime.puppets import PuppetBackend, PuppetController, touch

ROOM = 60_000
"""Bytes that fit the disk: what the log begins with, and some hundred periods."""
SCAN = (0.001, 0.0, 0.0)


@contextmanager
def full_disk(room: int):
    """No file may grow beyond some bytes: the system itself refuses, as on a full disk, amid a write."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def rig(duration: float = 3.0) -> Rig:
    return Rig(FaultyBackend(PuppetBackend()), touch(), PuppetController(velocity=SCAN), Limits(), duration)


def carry_out_with(writer: LogWriter, given: Rig):
    recorder = Recorder(writer)
    return run(
        given.backend,
        given.touch,
        given.controller,
        duration=given.duration,
        recorder=recorder,
    )


def test_a_full_disk_neither_stops_nor_changes_the_run_and_the_result_says_so(tmp_path):
    path, whole = tmp_path / "run.mcap", rig()
    with full_disk(ROOM):
        result = carry_out_with(LogWriter(path), whole)
    assert result.ending is Ending.TIME_UP
    assert result.trip is None
    assert result.error is None
    assert result.stopped
    assert [c.velocity_base_tip for c in whole.backend.commands[:3000]] == [SCAN] * 3000
    assert "File too large" in result.recording.problem
    assert "readable up to there" in result.recording.problem
    assert result.recording.rows_lost > 100
    log = read_log(path)
    assert 0 < len(log) == result.recording.rows_written
    assert log.damage is None
    assert log.gaps == ()
    assert list(log.samples()) == whole.backend.samples[: len(log)]  # up to the last good chunk, bit for bit


def test_a_disk_that_was_full_from_the_start_is_refused_before_anything_moves(tmp_path):
    given = rig()
    with full_disk(10), pytest.raises(ValueError, match="choose another place"):
        carry_out_with(LogWriter(tmp_path / "run.mcap"), given)
    assert given.backend.commands == []
    assert given.backend.closed_after == 0
    assert list(tmp_path.iterdir()) == []


def test_a_fault_is_dealt_with_as_ever_while_the_disk_is_full(tmp_path):
    fault = next(fault for fault in ANYWHERE if fault.name == "a force is NaN")
    given = rig()
    fault.injection.into(given, 2000)
    with full_disk(ROOM):
        outcome = carry_out(given, file=LogWriter(tmp_path / "run.mcap"))
    assert outcome.result.ending is Ending.TRIPPED
    assert outcome.result.trip.measure == fault.measure
    assert "File too large" in outcome.result.recording.problem
    assert periods_until_safe(outcome, fault, 2000, lambda index: (0.0, 0.0, 1.0)) == 0


def test_a_sink_that_hangs_does_not_hold_up_the_loop(tmp_path, monkeypatch):
    """A disk that does not reply at all: the writer's thread waits, nobody else does."""
    from palpate.runtime.log.log_file import LogFile

    free, held, append = threading.Event(), [], LogFile.append

    def hang(self, data):
        if held:
            free.wait(20.0)
        held.append(None)  # the opening goes through: the run may start
        append(self, data)

    monkeypatch.setattr(LogFile, "append", hang)
    given = rig(duration=1.0)
    try:
        result = carry_out_with(LogWriter(tmp_path / "run.mcap", closing_time=0.1), given)
    finally:
        free.set()
        for thread in threading.enumerate():
            if thread.name == "palpate log writer":
                thread.join(20.0)
    assert result.ending is Ending.TIME_UP
    assert result.stopped
    assert given.backend.commands[-1].phase is Phase.STOP
    assert "too long" in result.recording.problem
