"""Replays of explorations: bit for bit as recorded, however they ended; and what is said when they are not."""

import os
import re
import signal
import subprocess
import sys
from dataclasses import fields, replace

import numpy as np
import pytest

from palpate.cli import main
from palpate.commands.command_result import ExitCode
from palpate.commands.replay.report import version_differences
from palpate.commands.replay.run import changeable, replay_log
from palpate.errors import InvalidValueError
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.experiment import Explore
from palpate.experiments.kit.options import spec_of
from palpate.experiments.kit.recorded_run import carry_out
from palpate.experiments.kit.recording import log_writer
from palpate.reporting.page import WrittenReport
from palpate.robots.robot import robot_path
from palpate.runtime import Command, Ending, Phase, result_until
from palpate.runtime.log import LogWriter, read_log
from palpate.runtime.log.chunk import PackedRows
from palpate.runtime.log.entry_codec import Entry
from support.explore_runs import plan_of
from support.waiting import until

SMALL = {"width": 0.01, "depth": 0.004, "speed": 0.05}
NOISY = {"force_noise": 0.01, "moment_noise": 1e-4, "seed": 3}
CHANGES = ((1.0, "force", 3.0), (1.2, "speed", 0.02), (1.5, "force_gain", 1.2e-3), (1.6, "force", 1.5))
FIXED = [each.name for each in fields(ExploreConfig) if spec_of(each).fixed]


def record(config, observers=()):
    """Explore, recorded in `config.out`; returns how it ended."""
    planned = plan_of(config)
    try:
        return carry_out(planned, observers, (log_writer(Explore(), planned, config.out),)).run.ending
    except KeyboardInterrupt as interruption:
        return result_until(interruption).ending


@pytest.fixture(scope="module")
def nano(tmp_path_factory):
    """A run of five seconds with a sensor file, noise and live changes."""
    folder = tmp_path_factory.mktemp("nano")
    values = {"width": 0.01, "depth": 0.008, "speed": 0.03, "change": CHANGES, "seed": 5, "out": folder}
    assert record(ExploreConfig(robot="stage-nano17", **values)) is Ending.DONE
    return folder


@pytest.fixture(scope="module")
def two_seconds(tmp_path_factory):
    """The log of a shorter run like that."""
    folder = tmp_path_factory.mktemp("short")
    assert record(ExploreConfig(robot="stage-nano17", **SMALL, change=CHANGES, out=folder)) is Ending.DONE
    return (folder / "latest.mcap").read_bytes()


@pytest.fixture
def small(two_seconds, tmp_path):
    """It in a folder of its own, by another name."""
    (tmp_path / "mine.mcap").write_bytes(two_seconds)
    return tmp_path / "mine.mcap"


@pytest.fixture
def undrawn(monkeypatch):
    """Reports are begun but not drawn, which takes a second each."""

    def write(report, path, figures):
        path.write_text(report.outcome)
        return WrittenReport((path,), ())

    monkeypatch.setattr("palpate.commands.replay.command.write_report", write)


def check_identical(found, least=1000):
    """All of it came out again, and it was worth it."""
    assert found.commands.first is None, str(found.commands.first)
    assert found.sensing.first is None, str(found.sensing.first)
    assert found.identical
    assert found.commands.identical == found.commands.count == found.extent.count == found.replayed > least


# --- the same again ---


@pytest.mark.slow
def test_a_run_with_noise_sensor_file_and_live_changes_comes_out_bit_for_bit(nano, capsys):
    found = replay_log(nano)
    check_identical(found, 4400)
    assert [change.name for change in found.log.changes] == ["force", "speed", "force_gain", "force"]
    record = found.records()[0]
    assert np.ptp(record.normal_force[record.phase == Phase.SCAN.value]) > 0.5  # the changes did something
    assert main(["replay", str(nano)]) == 0
    said = capsys.readouterr().out
    count = f"{found.extent.count:,}".replace(",", " ")
    assert f"{count} of {count} commands identical, bit for bit" in said
    assert "Written" not in said
    assert not list(nano.glob("*.html"))


@pytest.mark.slow
def test_without_the_recorded_changes_it_would_not(nano):
    log = read_log(nano / "latest.mcap")
    found = replay_log(replace(log, changes=log.changes[1:]))
    assert found.commands.first.time == pytest.approx(1.0, abs=0.002)


@pytest.mark.slow
def test_a_run_that_was_stopped_by_the_supervisor_trips_again(tmp_path):
    # friction's, 8 mm below the sensor, is 5 mN m
    text = robot_path("stage").read_text().replace("moment_Nm: 2.0 ", "moment_Nm: 0.003 ")
    text = text.replace("impact_force_N: 40 ", "impact_force_N: 90 ")
    (tmp_path / "weak.yaml").write_text(text)
    config = ExploreConfig(**SMALL, **NOISY, stiffness=60e3, robot=str(tmp_path / "weak.yaml"), out=tmp_path)
    assert record(config) is Ending.TRIPPED
    found = replay_log(tmp_path)
    check_identical(found, 100)
    assert found.replay.trip.measure == "contact moment"
    assert str(found.replay.trip) == next(each.text for each in found.log.events if each.source == "supervisor")
    assert list(found.log.commands())[found.extent.count - 1].phase is Phase.STOP
    (tmp_path / "strong.yaml").write_text(text.replace("moment_Nm: 0.003 ", "moment_Nm: 2.0 "))
    stronger = replay_log(tmp_path, {"robot": str(tmp_path / "strong.yaml")})  # limits that it does not reach
    assert stronger.replay.trip is None


def test_a_run_that_was_interrupted_comes_out_up_to_there(tmp_path):
    seen = []

    def interrupt(sample, now, command):
        seen.append(None)
        if len(seen) == 1234:
            os.kill(os.getpid(), signal.SIGINT)

    assert record(ExploreConfig(**SMALL, **NOISY, out=tmp_path), (interrupt,)) is Ending.INTERRUPTED
    found = replay_log(tmp_path)
    check_identical(found)
    assert found.extent.count == 1234
    assert found.replay.reached_end


@pytest.mark.slow
def test_a_run_that_was_killed_comes_out_as_far_as_its_log_goes(tmp_path):
    explore = ["explore", "--robot", "stage-nano17", "--speed", "0.02", "--out", str(tmp_path)]
    process = subprocess.Popen([sys.executable, "-m", "palpate", *explore, "--change", "0.9", "force", "3"])
    try:
        log = tmp_path / "latest.mcap"
        until(lambda: process.poll() is not None or (log.exists() and log.stat().st_size > 400_000))
        assert process.poll() is None
    finally:
        process.kill()
        process.wait()
    found = replay_log(tmp_path)
    check_identical(found)
    assert not found.log.complete
    assert found.log.changes
    assert found.replay.reached_end


# --- not the same ---


def rewritten(log, path, rows=None, attachments=None):
    """A log as it would have been written with other rows or attachments."""
    writer = LogWriter(path, log.attachments if attachments is None else attachments)
    writer.start(log.heading)
    writer.rows(PackedRows(0, memoryview((log.rows if rows is None else rows).tobytes())))
    for number, what in enumerate((*log.changes, *log.events)):
        writer.entry(Entry(number, what))
    writer.close()
    return path


def flipped(log, row, bit):
    """The rows with one bit of one reading flipped."""
    rows = log.rows.copy()
    rows.view(np.uint64)[row, log.codec.columns["finger_0.reading"].start + 2] ^= np.uint64(1 << bit)
    return rows


# the weight is taken off a reading: what is below that sum's rounding, the lowest bits, changes nothing sensed
@pytest.mark.slow
@pytest.mark.parametrize("bit", [4, 7, 20, 40, 51, 62])
def test_whichever_bit_of_a_sample_is_flipped_it_is_found_in_its_period(bit, small):
    log = read_log(small)
    for row in (5, 1001, 1501):
        found = replay_log(replace(log, rows=flipped(log, row, bit)))
        assert found.sensing.first.row == row


def test_one_flipped_bit_in_one_sample_is_told_with_what_it_changes(small, tmp_path, undrawn, capsys):
    log, row = read_log(small), 1500
    rows = flipped(log, row, 20)
    path = rewritten(log, tmp_path / "flipped.mcap", rows)
    assert main(["replay", str(path)]) == 1
    said = capsys.readouterr().out
    assert f"Differs: sensing first at t = {rows[row, 0]:.3f} s (period {row}): finger_0." in said
    assert f"Differs: commands first at t = {rows[row, 0]:.3f} s" in said
    assert "Versions: the same as then" in said
    assert (tmp_path / "flipped-replay.html").exists()


def test_other_versions_are_named_where_something_differs(small, tmp_path, undrawn, capsys):
    log = read_log(small)
    texts = dict(log.attachments)
    texts["versions.yaml"] = re.sub("numpy: .*", "numpy: 1.0.0", texts["versions.yaml"])
    rows = log.rows.copy()
    rows[100, log.codec.columns["command.velocity"].start] += 1e-9
    assert main(["replay", str(rewritten(log, tmp_path / "old.mcap", rows, texts))]) == 1
    assert f"Versions: numpy 1.0.0 then, {np.__version__} now" in capsys.readouterr().out
    without = {name: text for name, text in texts.items() if name != "versions.yaml"}
    assert "unknown then" in version_differences(replay_log(replace(log, attachments=without)))[0]


def written_in_three(log, path):
    """Write a log whose rows are in three chunks, however busy the machine; returns a place inside the second."""
    writer = LogWriter(path, log.attachments)
    writer.start(log.heading)
    ends, count = [], 0
    for block in np.array_split(log.rows, 3):
        writer.rows(PackedRows(count, memoryview(block.tobytes())))
        count += len(block)
        until(lambda count=count: rows_in(path) >= count)
        ends.append(path.stat().st_size)
    for number, what in enumerate((*log.changes, *log.events)):
        writer.entry(Entry(number, what))
    writer.close()
    return (ends[0] + ends[1]) // 2


def rows_in(path):
    """How many rows are in a log that is still being written."""
    try:
        return len(read_log(path))
    except (FileNotFoundError, InvalidValueError):
        return 0


def test_a_damaged_log_is_replayed_up_to_the_gap(small, tmp_path, capsys):
    log = read_log(small)
    damaged = tmp_path / "damaged.mcap"
    place = written_in_three(log, damaged)
    data = bytearray(damaged.read_bytes())
    data[place] ^= 0xFF
    damaged.write_bytes(data)
    assert main(["replay", str(damaged)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "are missing in the log" in said
    assert "replayed up to there" in said
    found = replay_log(damaged)
    check_identical(found, least=400)
    assert found.extent.count < len(found.log) < len(log)


# --- with something else ---


@pytest.mark.slow
def test_another_force_differs_from_the_touch_on_at_the_latest_and_is_drawn(small, tmp_path, capsys):
    assert main(["replay", str(small), "--set", "force=3", "speed=0.02"]) == 0
    said = capsys.readouterr().out
    for words in ("commanded velocity apart, RMS", "first difference of a command", "periods in another phase"):
        assert words in said
    report = tmp_path / "mine-replay.html"
    assert f"Written: {report}" in " ".join(said.split())
    assert "data-figure" in report.read_text()
    found = replay_log(small, {"force": 3.0, "speed": 0.02})
    recorded, replayed = found.records()
    touched = recorded.time[np.argmax(recorded.touching)]
    assert found.commands.first.time <= touched + 0.01  # landing depends on the force, too
    # before that, nothing is pressed and nothing slides
    before = recorded.time < touched
    assert np.array_equal(recorded.command[before, :2], replayed.command[before, :2])
    # speed along the surface alone changes nothing until something is touched (the run had 20 mm/s)
    faster = replay_log(small, {"speed": 0.03})
    assert faster.commands.first.time > touched
    recorded, replayed = faster.records()
    assert np.array_equal(recorded.command[before], replayed.command[before])


def test_a_larger_tip_is_felt_elsewhere_and_a_narrower_raster_is_swept_otherwise(small):
    felt = replay_log(small, {"tip": [0.009]})
    recorded, replayed = felt.records()
    both = recorded.touching & replayed.touching
    apart = np.linalg.norm(replayed.centroid - recorded.centroid, axis=1)[both]
    assert np.median(apart) == pytest.approx(0.001, rel=0.1)
    swept = replay_log(small, {"width": 0.006})
    assert swept.sensing.first is None
    assert not swept.identical


@pytest.mark.slow
def test_reports_are_named_after_their_logs_and_none_is_overwritten(small, tmp_path, undrawn):
    other = tmp_path / "other.mcap"
    other.write_bytes(small.read_bytes())
    (tmp_path / "latest.mcap").symlink_to("other.mcap")
    out = tmp_path / "reports"
    for log in (small, small, tmp_path):
        assert main(["replay", str(log), "--set", "force=3", "--out", str(out)]) == 0
    assert {path.name for path in out.iterdir()} == {
        "mine-replay.html",
        "mine-replay-2.html",
        "other-replay.html",
    }


# --- with another controller ---

CONTROLLERS = """
from palpate.runtime import Command, Phase

class Still:
    def start(self, first): pass
    def step(self, now): return Command(phase=Phase.HOLD)

class Raising(Still):
    def step(self, now):
        if now.time > 1.0:
            raise ZeroDivisionError("mine")
        return Command(phase=Phase.HOLD)

class Picky(Still):
    def start(self, first): raise ValueError("not this robot")

def still(planned): return Still()
def raising(planned): return Raising()
def picky(planned): return Picky()
def same(planned): return planned.controller()
def nothing(planned): return None
def a_class(planned): return Still
def fails(planned): raise LookupError("no such gain")
number = 3
"""


@pytest.fixture
def controllers(tmp_path, monkeypatch):
    """The name of a module of controllers in the present folder."""
    name = f"controllers_{abs(hash(tmp_path))}"
    (tmp_path / f"{name}.py").write_text(CONTROLLERS)
    monkeypatch.chdir(tmp_path)
    yield name
    sys.modules.pop(name, None)


def test_the_same_controller_by_another_name_gives_the_same(small, controllers, tmp_path, undrawn, capsys):
    before = list(sys.path)
    assert main(["replay", str(small), "--controller", f"{controllers}:same", "--out", str(tmp_path)]) == 0
    assert sys.path == before
    count = f"{replay_log(small).replayed:,}".replace(",", " ")
    assert f"{count} of {count} commands identical" in capsys.readouterr().out


@pytest.mark.slow
def test_a_controller_of_ones_own_is_compared_and_drawn(small, controllers, capsys):
    assert main(["replay", str(small), "--controller", f"{controllers}:still"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "no live parameter force, speed, force_gain: 4 recorded changes were left out" in said
    assert "end of the replay" in said
    assert f"{controllers}:still" in (small.parent / "mine-replay.html").read_text()


def test_a_controller_that_raises_is_shown_where(small, controllers, undrawn, capsys):
    assert main(["replay", str(small), "--controller", f"{controllers}:raising"]) == 1
    said = capsys.readouterr().out
    assert "ZeroDivisionError: mine" in said
    assert f"{controllers}.py" in said
    assert "Written" in said


# --- mistakes ---

MISTAKES = {
    "no such file": (["nowhere.mcap"], ["nowhere.mcap", "no such file or folder"]),
    "an empty folder": (["EMPTY"], ["there is no latest.mcap", "name the log's file"]),
    "no log": (["TEXT"], ["cannot be read as a log of palpate's"]),
    "no setting": (["LOG", "--set", "force"], ["--set force", "NAME=VALUE", "force=3"]),
    "spaces": (["LOG", "--set", "force", "=", "3"], ["--set force", "without spaces"]),
    "twice": (["LOG", "--set", "force=3", "force=4"], ["force is set twice"]),
    "misspelt": (["LOG", "--set", "frce=3"], ["there is no option frce", "did you mean force?"]),
    "with a unit": (["LOG", "--set", "force_N=3"], ["force_N", "did you mean force?"]),
    "unknown": (["LOG", "--set", "xyzzy=3"], ["there are", *changeable(ExploreConfig)]),
    "no number": (["LOG", "--set", "force=two"], ["force", "two"]),
    "no YAML": (["LOG", "--set", "force=[3"], ["--set force=[3", "YAML"]),
    "impossible": (["LOG", "--set", "force=100"], ["force = 100 N", "15 N"]),
    "in millimetres": (["LOG", "--set", "speed=20"], ["speed = 20 m/s", "for 20 mm/s give 0.02"]),
    "changes out of bounds": (["LOG", "--set", "stiffness=1900"], ["recorded at t = 1.5", "force_gain"]),
    "a robot of another kind": (["LOG", "--set", "robot=ur5e-sim"], ["as recorded, of stage", "of that kind"]),
    "no robot": (["LOG", "--set", "robot=stag"], ["stag"]),
    "no colon": (["LOG", "--controller", "mine"], ["MODULE:NAME", "mine:make"]),
    "a path": (["LOG", "--controller", "./mine.py:make"], ["there is no file ./mine.py"]),
    "no module": (["LOG", "--controller", "nosuch:make"], ["there is no module nosuch", "installed"]),
    "no package": (["LOG", "--controller", "nosuch.sub:make"], ["there is no module nosuch"]),
    "no function": (["LOG", "--controller", "MINE:stil"], ["is called stil", "did you mean still?"]),
    "a number": (["LOG", "--controller", "MINE:number"], ["number is 3", "must be a function"]),
    "returns None": (["LOG", "--controller", "MINE:nothing"], ["returned None", "start(first) and step(now)"]),
    "returns a class": (["LOG", "--controller", "MINE:a_class"], ["returned <class", "start(first)"]),
    "raises": (["LOG", "--controller", "MINE:fails"], ["fails raised LookupError", "no such gain", ".py, line"]),
    "raises at the start": (["LOG", "--controller", "MINE:picky"], ["the replay cannot begin", "not this robot"]),
    "syntax": (["LOG", "--controller", "broken:make"], ["importing broken raised SyntaxError", "line 1"]),
    "missing import": (["LOG", "--controller", "lacking:make"], ["lacking", "no_such_library"]),
    "no folder": (["LOG", "--set", "force=3", "--out", "TEXT"], ["out =", "choose another folder (--out)"]),
    **{name: (["LOG", "--set", f"{name}=1"], [name, "a replay cannot change it"]) for name in FIXED},
}


@pytest.mark.parametrize("name", MISTAKES)
def test_mistakes_are_named_with_what_would_be_right(name, small, controllers, capsys):
    folder = small.parent
    (folder / "empty").mkdir()
    (folder / "text").write_text("no log")
    (folder / "broken.py").write_text("def make(planned) return 3")
    (folder / "lacking.py").write_text("import no_such_library")
    stands_for = {"LOG": str(small), "EMPTY": "empty", "TEXT": "text"}
    arguments, words = MISTAKES[name]
    typed = [stands_for.get(word, word.replace("MINE", controllers)) for word in arguments]
    try:
        assert main(["replay", *typed]) == ExitCode.MISTAKE
    finally:
        for module in ("broken", "lacking"):
            sys.modules.pop(module, None)
    said = " ".join(capsys.readouterr().err.split())
    for word in words:
        assert word in said
    assert not list(folder.glob("*.html")), "nothing half written"


def test_a_log_of_something_else_is_refused(nano, tmp_path):
    log = read_log(nano / "latest.mcap")
    without = {name: text for name, text in log.attachments.items() if name != "experiment.yaml"}
    with pytest.raises(InvalidValueError, match="is no log of an experiment"):
        replay_log(replace(log, attachments=without))
    newer = log.attachments | {"experiment.yaml": log.attachments["experiment.yaml"] + "colour: blue\n"}
    with pytest.raises(InvalidValueError, match=r"was it written by another version\? .*colour"):
        replay_log(replace(log, attachments=newer))


def test_a_replay_that_is_interrupted_speaks_of_no_robot(nano, capsys, monkeypatch):
    def interrupt(*_):
        os.kill(os.getpid(), signal.SIGINT)
        return Command()

    monkeypatch.setattr("palpate.controllers.ExploreController.step", interrupt)
    assert main(["replay", str(nano)]) == ExitCode.INTERRUPTED
    assert capsys.readouterr().err == "palpate: interrupted; nothing was finished, and nothing is kept\n"


def test_a_flipped_bit_in_a_recorded_command_is_found_there_and_nowhere_else(nano, tmp_path):
    log = read_log(nano / "latest.mcap")
    rows = log.rows.copy()
    rows.view(np.uint64)[3000, log.codec.columns["command.velocity"].start + 1] ^= np.uint64(1)
    found = replay_log(replace(log, rows=rows))
    assert found.sensing.first is None
    assert (found.commands.first.row, found.commands.first.name) == (3000, "command.velocity.y")
    assert found.commands.identical == found.commands.count - 1
