"""The writer on good, full, slow and hanging disks: the loop never notices, the summary tells."""

import os
import subprocess
import sys
import threading
import time
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest

from palpate.errors import InvalidValueError
from palpate.runtime.log import Layout, Level, LogWriter, log_in, new_log_path, read_log
from palpate.runtime.log import log_writer as log_writer_module
from palpate.runtime.log.chunk import PERIOD_CHANNEL, PackedRows
from palpate.runtime.log.heading import Heading
from palpate.runtime.log.log_file import LogFile
from palpate.runtime.log.period_codec import PeriodCodec
from runtime.log.log_examples import PERIOD, a_run, bits, started, write
from support.waiting import until

NOW = datetime(2026, 11, 21, 2, 30, 5)


def looped(writer, periods, times=10):
    """Record the same periods again and again."""
    recorder = started(periods, writer)
    for period in periods * times:
        recorder.record(*period)
    return recorder


def assert_periods_are(log, periods):
    """The rows of a log are these periods, again and again, bit by bit."""
    for number, sample in zip(log.sequence, log.samples(), strict=True):
        assert bits(sample) == bits(periods[number % len(periods)][0])


@pytest.fixture
def disk(monkeypatch):
    """Once a log is begun, the disk writes only while this event is set, and never the thread of the loop."""
    append, loop, unblocked = LogFile.append, threading.get_ident(), threading.Event()

    def asked(self, data):
        if self.size:
            assert threading.get_ident() != loop
            until(unblocked.is_set)
        append(self, data)

    monkeypatch.setattr(LogFile, "append", asked)
    yield unblocked
    unblocked.set()


@pytest.fixture
def full_disk(tmp_path):
    """A file system of 3 MB; where none may be mounted, the test cannot be made."""
    folder = tmp_path / "small"
    folder.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=3m", "tmpfs", str(folder)], capture_output=True, check=False
    )
    if mounted.returncode:
        pytest.skip(f"no small file system can be mounted here: {mounted.stderr.decode().strip()}")
    yield folder
    subprocess.run(["umount", "-l", str(folder)], check=True)


def test_on_a_disk_that_is_full_from_the_start_nothing_is_begun(full_disk):
    (full_disk / "filler").write_bytes(bytes(3 * 2**20))
    with pytest.raises(InvalidValueError, match=r"a\.mcap: No space left on device; choose another place"):
        write(full_disk / "a.mcap", a_run(1))
    assert [x.name for x in full_disk.iterdir()] == ["filler"]


def test_if_there_is_room_again_at_the_end_the_file_is_finished(full_disk):
    path = full_disk / "a.mcap"
    (full_disk / "filler").write_bytes(bytes(2 * 2**20))
    writer = LogWriter(path)
    recorder = looped(writer, a_run(1000), 5)
    until(lambda: writer._problem is not None)
    (full_disk / "filler").unlink()
    summary = recorder.close()
    log = read_log(path)
    assert summary.rows_lost > 0
    assert log.complete
    assert f"{summary.rows_lost} periods were not recorded" in log.events[-1].text
    assert log.events[-1].level is Level.WARN


LIMITED = """
import resource, sys
resource.setrlimit(resource.RLIMIT_FSIZE, (2_500_000, 2_500_000))
sys.path.insert(0, {tests!r})
from pathlib import Path
from palpate.runtime.log import LogWriter
from runtime.log.log_examples import a_run
from runtime.log.test_log_writer import looped
summary = looped(LogWriter(Path({path!r}), {{"experiment.yaml": "a: 1\\n"}}), a_run(1000)).close()
print(summary.rows_written, summary.rows_lost, summary.problem)
"""


@pytest.mark.slow
def test_a_full_disk_ends_the_recording_not_the_run(tmp_path):
    """The limit on the size of the files of a process stands for the disk: it needs no rights."""
    path = tmp_path / "a.mcap"
    script = LIMITED.format(tests=str(Path(__file__).parents[2]), path=str(path))
    printed = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
    written, lost, problem = printed.split(maxsplit=2)
    assert int(written) + int(lost) == 10_000
    assert 2000 < int(written) < 6000
    assert "File too large; the log is readable up to there" in problem
    log = read_log(path)
    assert (len(log), log.damage, log.attachments) == (int(written), None, {"experiment.yaml": "a: 1\n"})
    assert_periods_are(log, a_run(1000))
    assert path.stat().st_size <= 2_500_000


@pytest.mark.slow
def test_on_a_slow_disk_the_loop_does_not_wait_and_what_is_dropped_is_counted(tmp_path, disk):
    periods, path = a_run(1000), tmp_path / "a.mcap"
    writer = LogWriter(path, backlog=500_000)
    recorder = looped(writer, periods, 5)
    assert len(read_log(path)) == 0  # all was taken before the disk wrote once
    texts = [f"contact force {i}" for i in range(200)]
    for text in texts:  # events have room where periods have none left
        recorder.event(5.0, Level.ERROR, "supervisor", text)
    disk.set()
    until(lambda: writer._put == writer._taken)
    for period in periods * 5:
        recorder.record(*period)
    summary = recorder.close()
    log = read_log(path)
    assert summary.rows_lost > 1000
    assert summary.rows_written + summary.rows_lost == 10_000
    assert f"{summary.rows_lost} periods were dropped" in summary.problem
    assert log.complete
    assert len(log) == summary.rows_written
    assert [event.text for event in log.events[:200]] == texts
    assert log.gaps
    assert sum(gap.count for gap in log.gaps) + 9999 - log.sequence[-1] == summary.rows_lost
    assert f"{summary.rows_lost} periods were not recorded" in log.events[-1].text
    assert_periods_are(log, periods)


def test_a_disk_that_hangs_holds_up_neither_the_loop_nor_the_end(tmp_path, disk):
    writer = LogWriter(tmp_path / "a.mcap", backlog=200_000, closing_time=0.2)
    recorder = looped(writer, a_run(1000))
    waiting = writer._queue.qsize()
    summary = recorder.close()
    assert writer._thread.is_alive()  # the disk has not written yet
    disk.set()
    writer._thread.join()
    assert waiting < 5  # 100 kB each: the backlog is bounded
    assert (summary.rows_written, summary.rows_lost) == (0, 10_000)
    assert "given up after 0.2 s" in summary.problem


def test_an_unforeseen_error_is_reported_too(tmp_path, monkeypatch):
    def broken(segments, codec):
        raise ZeroDivisionError("a mistake of ours")

    monkeypatch.setattr(log_writer_module, "encode_chunk", broken)
    summary = write(tmp_path / "a.mcap", a_run(300))
    assert (summary.rows_written, summary.rows_lost) == (0, 300)
    assert "a mistake of ours" in summary.problem


def test_a_log_is_not_overwritten(tmp_path):
    path = tmp_path / "a.mcap"
    write(path, a_run(2))
    kept = path.read_bytes()
    for place, message in (
        (path, "File exists; choose another place"),
        (tmp_path / "nowhere" / "a.mcap", "No such file or directory"),
    ):
        with pytest.raises(InvalidValueError, match=message):
            write(place, a_run(2))
    assert path.read_bytes() == kept


def test_a_log_can_be_read_while_it_is_being_written(tmp_path):
    path, periods = tmp_path / "a.mcap", a_run(600)
    recorder = started(periods, LogWriter(path, {"experiment.yaml": "a: 1\n"}))

    def found():
        log = read_log(log_in(tmp_path))  # the link is there from the start of the run
        assert (log.attachments, log.damage) == ({"experiment.yaml": "a: 1\n"}, None)
        return len(log), log.complete

    assert found() == (0, False)
    for number, period in enumerate(periods):
        recorder.record(*period)
        if number == 449:
            until(lambda: found() == (400, False))  # two whole blocks
    recorder.close()
    assert found() == (600, True)


def test_the_latest_log_is_linked(tmp_path):
    first = new_log_path(tmp_path / "logs", NOW)
    assert first == tmp_path / "logs" / "2026-11-21_02-30-05.mcap"
    write(first, a_run(2))
    second = new_log_path(tmp_path / "logs", NOW)
    assert second.name == "2026-11-21_02-30-05-2.mcap"
    assert write(second, a_run(3)).note == ""
    link = tmp_path / "logs" / "latest.mcap"
    assert os.readlink(link) == second.name  # relative: the folder may be moved
    assert len(read_log(log_in(tmp_path / "logs"))) == 3
    assert {x.name for x in (tmp_path / "logs").iterdir()} == {first.name, second.name, link.name}
    assert new_log_path(tmp_path / "logs", NOW).name == "2026-11-21_02-30-05-3.mcap"


def test_where_links_are_not_permitted_or_a_file_is_in_their_place_it_says_so_and_goes_on(tmp_path, monkeypatch):
    def refuse(self, target):
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(Path, "symlink_to", refuse)
    summary = write(tmp_path / "a.mcap", a_run(2))
    assert summary.problem is None
    assert summary.note.endswith("latest.mcap was not made: Operation not permitted")
    assert [x.name for x in tmp_path.iterdir()] == ["a.mcap"]
    (tmp_path / "latest.mcap").write_text("mine")
    assert "is no link and was left as it is" in write(tmp_path / "b.mcap", a_run(2)).note
    assert (tmp_path / "latest.mcap").read_text() == "mine"


def test_a_folder_without_a_log_is_refused(tmp_path):
    (tmp_path / "linked").mkdir()
    (tmp_path / "linked" / "latest.mcap").symlink_to("gone.mcap")
    for place, message in (
        ("", r"there is no latest\.mcap in this folder"),
        ("x.mcap", "no such file or folder"),
        ("linked", r"there is no latest\.mcap"),
    ):
        with pytest.raises(InvalidValueError, match=message):
            log_in(tmp_path / place)


@pytest.mark.slow
def test_sixty_random_channels_at_1_khz_stay_below_half_a_megabyte_per_second(tmp_path):
    """The worst case there is: doubles of any bits, none of them repeated."""
    rng = np.random.default_rng(0)
    writer = LogWriter(tmp_path / "a.mcap")
    heading = Heading(Layout(2, None, (6,), 2), PERIOD, 0.0, time.time_ns(), "test")
    codec = PeriodCodec(heading, PERIOD_CHANNEL)
    floats = [c for g in codec.groups for q in g.fields for c in [q.dtype == "<f8"] * q.count]
    assert sum(floats) == 60
    writer.start(heading)
    for block in range(25):
        rows = np.zeros((200, codec.width))
        rows[:, floats] = rng.normal(size=(200, 60))
        rows[:, 0] = (block * 200 + np.arange(200)) * PERIOD
        writer.rows(PackedRows(block * 200, memoryview(rows.tobytes())))
        until(lambda: writer._queue.empty())
    summary = writer.close()
    assert summary.rows_written == 5000
    assert (tmp_path / "a.mcap").stat().st_size / 5.0 <= 0.5e6
