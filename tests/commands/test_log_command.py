"""`palpate log`: what people read about a log is what is in it; tables keep every digit."""

import csv
import json
import math
import os
import shutil
import struct
import subprocess
import sys

import pytest

from palpate.commands.log import export
from palpate.commands.log.config import LogExportConfig, LogInfoConfig
from palpate.commands.log.export import run_log_export
from palpate.commands.log.info import run_log_info
from palpate.commands.output_format import run_with_text
from palpate.errors import InvalidValueError
from palpate.runtime import progress
from palpate.runtime.data import Phase
from palpate.runtime.log import LogWriter, Recorder, read_log
from palpate.runtime.progress import lively
from palpate.sensing.contact import ContactStatus
from runtime.log.log_examples import ONE_FINGER, PERIOD, TWO_FINGERS_AND_A_HAND, a_run, write
from support.tiny_experiment import TINY
from support.waiting import until

ATTACHMENTS = {"experiment.yaml": "force_N: 2\n", "versions.yaml": "palpate: 0.1\nnumpy: 2.4\n"}


@pytest.fixture(scope="module")
def log_path(tmp_path_factory):
    path = tmp_path_factory.mktemp("logs") / "a.mcap"
    write(path, a_run(300, TWO_FINGERS_AND_A_HAND), ATTACHMENTS)
    return path


@pytest.fixture
def wide(monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")


def info(path, capsys):
    assert run_with_text(lambda: run_log_info(LogInfoConfig(path))) == 0
    return capsys.readouterr().out


def test_info_tells_what_is_in_a_log(log_path, capsys, wide):
    told = info(log_path, capsys)
    for words in (
        "complete, every check sum is right",
        "300, nominally every 1 ms",
        "0.299 s, 1000 periods per second",
        "experiment.yaml, versions.yaml",
        "numpy: 2.4",
        "velocity(3) [m/s]",
        "reading(16)",
        "wrench(6) [N, N m]",
        "joint_position(7)",
        "event before period 50",
        "WARN",
        "time [s], name, value",
    ):
        assert words in told


def test_a_log_that_may_not_be_read_is_named_with_what_to_do(log_path, monkeypatch):
    def forbidden(path):
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr(
        "palpate.runtime.log.reader.open_regular", forbidden
    )  # who tests as root may read anything
    with pytest.raises(InvalidValueError, match=r"a\.mcap: may not be read; .*chmod a\+r"):
        run_log_info(LogInfoConfig(log_path))


def test_info_tells_damage_and_what_is_missing(log_path, tmp_path, capsys, wide):
    path = tmp_path / "cut.mcap"
    data = log_path.read_bytes()
    path.write_bytes(data[: len(data) // 2])
    told = info(path, capsys)
    assert f"DAMAGED: cut off at byte {len(data) // 2}" in told
    path = tmp_path / "unfinished.mcap"
    end = data.rindex(b"\x0f" + (4).to_bytes(8, "little"))  # DataEnd
    path.write_bytes(data[:end])
    assert "not finished: its process was killed, or is still writing" in info(path, capsys)


def test_info_of_a_log_with_gaps_counts_what_is_missing(tmp_path, capsys, wide):
    periods = a_run(10)
    recorder = Recorder(LogWriter(tmp_path / "a.mcap"))
    recorder.start(periods[0][0], periods[0][1], 1e-3)
    for i, period in enumerate(periods):
        recorder.record(*(period if i not in (4, 5, 8) else (period[0], None, *period[2:])))
    recorder.close()
    assert "3 MISSING in 2 places, the first after period 3" in info(tmp_path / "a.mcap", capsys)


def exported(log_path, to, folder):
    result = run_log_export(LogExportConfig(log_path, to, folder))
    assert run_with_text(lambda: result) == 0
    return folder


@pytest.mark.parametrize("layout", [ONE_FINGER, TWO_FINGERS_AND_A_HAND])
def test_csv_keeps_every_double(layout, tmp_path):
    path = tmp_path / "a.mcap"
    write(path, a_run(300, layout))
    folder = exported(path, "csv", tmp_path / "tables")
    log = read_log(path)
    with (folder / "period.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    table = log.channels["/period"]
    assert len(rows) == 300
    expected = {
        "time_s": table["time"],
        "arm_velocity_z_m/s": table["arm"]["velocity"][:, 2],
        "arm_rotation_12": table["arm"]["rotation"][:, 5],
        "finger_0_wrench_mx_Nm": table["finger_0"]["wrench"][:, 3],
        "finger_0_reading_5": table["finger_0"]["reading"][:, 5],
        "finger_0_spin_torque_Nm": table["finger_0"]["spin_torque"],
        "command_grip_force_1_N": table["command"]["grip_force"][:, 1],
        "lateness_s": table["lateness"],
    }
    for name, values in expected.items():
        for row, value in zip(rows, values, strict=True):
            found = float(row[name])
            assert math.isnan(found) if math.isnan(value) else struct.pack("<d", found) == value.tobytes()
    assert [row["command_phase"] for row in rows] == [list(Phase)[i].name for i in table["command"]["phase"]]
    assert [row["finger_0_status"] for row in rows] == [ContactStatus(i).name for i in table["finger_0"]["status"]]
    assert [row["finger_0_touching"] for row in rows] == [str(int(x)) for x in table["finger_0"]["touching"]]
    with (folder / "event.csv").open(newline="") as file:
        assert [row["text"] for row in csv.DictReader(file)] == [event.text for event in log.events]
    with (folder / "parameter.csv").open(newline="") as file:
        assert [float(row["value"]) for row in csv.DictReader(file)] == [change.value for change in log.changes]


def test_an_export_of_a_damaged_log_says_so(log_path, tmp_path, capsys):
    (tmp_path / "cut.mcap").write_bytes(log_path.read_bytes()[:-2000])
    exported(tmp_path / "cut.mcap", "csv", tmp_path / "tables")
    assert "damaged, its periods have gaps" in capsys.readouterr().out


def test_a_folder_that_cannot_be_made_is_refused(log_path, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InvalidValueError, match=r"choose another folder \(--out\)"):
        exported(log_path, "csv", tmp_path / "file" / "tables")


def test_what_takes_long_shows_how_far_it_is(log_path, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(export, "BAR_DELAY", -1.0)
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setattr(progress, "lively", lambda console: True)  # a terminal
    exported(log_path, "csv", tmp_path / "slow")
    assert "writing" in capsys.readouterr().err
    monkeypatch.setattr(export, "BAR_DELAY", math.inf)
    exported(log_path, "csv", tmp_path / "quick")
    assert "writing" not in capsys.readouterr().err
    monkeypatch.setattr(export, "BAR_DELAY", -1.0)
    monkeypatch.setattr(progress, "lively", lively)  # FORCE_COLOR makes no terminal of a pipe
    exported(log_path, "csv", tmp_path / "to a pipe")
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("count", [1, 2])
def test_info_of_a_short_log_is_no_reason_to_fail(count, tmp_path, capsys):
    write(tmp_path / "a.mcap", a_run(count))
    assert f" {count}, nominally every 1 ms" in info(tmp_path / "a.mcap", capsys)


def test_tables_go_beside_the_log_if_nothing_else_is_said(tmp_path, capsys):
    write(tmp_path / "run.mcap", a_run(3))
    result = run_log_export(LogExportConfig(tmp_path))  # through latest.mcap
    assert run_with_text(lambda: result) == 0
    assert {x.name for x in (tmp_path / "run").iterdir()} == {
        "period.csv",
        "event.csv",
        "parameter.csv",
        "episodes.csv",
    }
    assert "3 periods of 1 run" in capsys.readouterr().out


# --- Records that are lost are in the outcome and in the exit code, whatever lost them ---


def written_while(path, happens):
    """Return the summary of a log of 1000 periods to which something happens half-way."""
    periods, recorder = a_run(1000), Recorder(writer := LogWriter(path))
    recorder.start(periods[0][0], periods[0][1], PERIOD)
    for period in periods[:600]:
        recorder.record(*period)
    until(lambda: writer._written == 600)
    happens()
    for period in periods[600:]:
        recorder.record(*period)
    return recorder.close()


@pytest.mark.parametrize(
    ("happens", "words"),
    [
        (lambda path: shutil.rmtree(path.parent), "was deleted or moved"),
        (lambda path: path.unlink(), "was deleted or moved"),
        (lambda path: path.parent.rename(path.parent.with_name("elsewhere")), "was deleted or moved"),
        (lambda path: (path.unlink(), path.write_text("x")), "another file has taken its place"),
    ],
)
def test_a_log_that_is_gone_is_counted_as_lost(happens, words, tmp_path):
    path = tmp_path / "out" / "a.mcap"
    path.parent.mkdir()
    summary = written_while(path, lambda: happens(path))
    assert words in summary.problem
    assert (summary.rows_written, summary.rows_lost) == (0, 1000)


@pytest.mark.parametrize("size", [0, 5000, 60_000, 10**6])
def test_of_a_log_whose_size_others_change_the_whole_chunks_are_left(size, tmp_path):
    path = tmp_path / "a.mcap"
    summary = written_while(path, lambda: os.truncate(path, size))
    assert "changed its size" in summary.problem
    assert summary.rows_written + summary.rows_lost == 1000
    assert size != 10**6 or summary.rows_written == 600
    if size >= 60_000:
        assert len(read_log(path)) == summary.rows_written


PUT_IN = """
import os, resource, shutil, sys, threading
from pathlib import Path
from palpate import cli

waited = threading.Event()

def when_it_has_grown(folder, happens):
    while not any(path.stat().st_size > 30_000 for path in folder.glob("2*.mcap")):
        waited.wait(0.01)
    happens(next(folder.glob("2*.mcap")))

how, folder = sys.argv.pop(1), Path(sys.argv[-1])
happens = {
    "deleted": lambda path: shutil.rmtree(path.parent),
    "truncated": lambda path: os.truncate(path, 20_000),
}
if how == "limited":
    resource.setrlimit(resource.RLIMIT_FSIZE, (400_000, 400_000))
else:
    threading.Thread(target=when_it_has_grown, args=(folder, happens[how]), daemon=True).start()
sys.exit(cli.main())
"""


@pytest.mark.slow
@pytest.mark.parametrize("how", ["limited", "deleted", "truncated"])
def test_the_outcome_and_the_exit_code_of_a_run_report_it(how, tmp_path):
    words = [TINY, "--time", "20", "--json", "--out", str(tmp_path / "out")]
    ended = subprocess.run([sys.executable, "-c", PUT_IN, how, *words], capture_output=True, check=False)
    result = json.loads(ended.stdout)
    assert ended.returncode == result["exit_code"] == 1, ended.stderr.decode()
    assert "THE LOG IS NOT WHOLE" in result["outcome"]
    assert "THE LOG IS NOT WHOLE" in (tmp_path / "out" / "report.html").read_text()
