"""Messages of a run: progress, interruptions, rest of the robot, and files of an earlier run."""

import html
import io
import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from rich.console import Console

from palpate.cli import main
from palpate.commands import run
from palpate.commands.command_result import ExitCode
from palpate.commands.run import STOPPING_TEXT, earlier_run, kept_if_interrupted, run_shown
from palpate.errors import InvalidValueError
from palpate.experiments.kit.recorded_run import RecordedRun
from palpate.runtime import Ending, RestState, progress
from palpate.runtime.log import log_in, read_log
from palpate.runtime.progress import doing, run_progress, step_progress
from palpate.runtime.rest import CLAUSES, LOOK, rest_in
from palpate.sim import MujocoBackend
from support.friction_runs import planned

JUST_HELD = ("--load", "none", "--rise", "0.1", "--lift-height", "0.01")

SHORT = {"quick": True, "loads": (2.0,), "robot": "stage"}


def captured():
    return Console(file=io.StringIO(), width=200)


def lines(console):
    return console.file.getvalue().splitlines()


# --- progress where the output is captured


@pytest.mark.slow
def test_every_phase_and_every_so_often_a_run_is_a_line_of_its_own(monkeypatch):
    monkeypatch.setattr(progress, "LINE_INTERVAL", 0.0)
    console = captured()
    with doing(console, "planning"):
        plan = planned(**SHORT)
    with run_progress(console, plan.expected_duration) as observer:
        RecordedRun(plan).run((observer,))
    with step_progress(console, ("one", "two")) as tell:
        tell("one")
        tell("two")
    told = lines(console)
    assert told[:2] == ["planning", f"running, about {plan.expected_duration:.0f} s on the robot's clock"]
    assert told[2].startswith("0 of about ")
    assert told[-3].endswith(" s on the robot's clock, stop")
    assert told[-2:] == ["one", "two"]
    assert not any("\x1b" in line or not line for line in told)


# --- Ctrl-C


@pytest.fixture(scope="module")
def run_over():
    """How a run went until it was interrupted."""

    asked = []

    def stop(sample, now, command):
        if now.time > 0.1 and not asked:
            asked.append(now.time)
            os.kill(os.getpid(), signal.SIGINT)

    console = captured()
    run = RecordedRun(planned(**SHORT))
    result, interrupted = run_shown(console, 5.0, lambda observer: run.run((observer, stop)))
    assert interrupted
    assert STOPPING_TEXT in lines(console)
    return result


def test_an_interrupted_run_is_over_and_told_of(run_over):
    assert run_over.ending is Ending.INTERRUPTED
    assert run_over.at_rest


@pytest.mark.slow
@pytest.mark.parametrize(
    "arguments",
    [
        ["friction", "--quick", "--loads", "2", "--robot", "stage"],
        ["regulate", "--duration", "0.2"],
        ["grasp", *JUST_HELD],
    ],
    ids=["friction", "regulate", "grasp"],
)
def test_a_command_whose_report_is_interrupted_names_its_log(arguments, monkeypatch, tmp_path, capsys):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("palpate.commands.run.write_result", interrupted)
    assert main([*arguments, "--out", str(tmp_path)]) == ExitCode.INTERRUPTED
    said = capsys.readouterr().err
    (log,) = (path for path in tmp_path.glob("*.mcap") if not path.is_symlink())
    assert f"its log is kept: {log} (palpate view shows it)" in said
    assert "Traceback" not in said


@pytest.mark.slow
def test_a_control_beside_that_is_interrupted_leaves_the_report_of_the_first(
    run_over, monkeypatch, tmp_path, capsys
):
    runs = []

    def interrupted(console, expected_duration):
        runs.append(expected_duration)
        if len(runs) > 1:
            raise KeyboardInterrupt(run_over)
        return run_progress(console, expected_duration)

    monkeypatch.setattr("palpate.commands.run.run_progress", interrupted)
    assert main(["grasp", *JUST_HELD, "--against-ignoring-spin", "--out", str(tmp_path)]) == ExitCode.INTERRUPTED
    assert "the report is of the first run alone" in " ".join(capsys.readouterr().out.split())
    assert "neither slipped nor spun" in " ".join((tmp_path / "report.html").read_text().split())


STARTING = """
import os, signal, sys
from palpate.commands import start_up
{before}
start_up.begin()
{within}
os.kill(os.getpid(), signal.SIGINT)
print("still here", flush=True)
"""


@pytest.mark.parametrize(
    ("before", "within", "code", "out", "err"),
    [
        ("", "", ExitCode.INTERRUPTED, "", "palpate: interrupted; nothing had begun, and nothing was written\n"),
        ("", "start_up.over()", 1, "", "KeyboardInterrupt"),
        ("signal.signal(signal.SIGINT, signal.SIG_IGN)", "", 0, "still here\n", ""),
    ],
    ids=["while it starts", "once it has started", "ignored, as under nohup"],
)
def test_ctrl_c_while_it_starts_is_one_line(before, within, code, out, err):
    done = subprocess.run(
        [sys.executable, "-c", STARTING.format(before=before, within=within)],
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.returncode == code
    assert done.stdout == out
    assert done.stderr.endswith(err) if code == ExitCode.INTERRUPTED else err in done.stderr
    assert ("Traceback" in done.stderr) is (within != "")


@pytest.mark.slow
def test_whoever_stops_reading_ends_no_run(tmp_path):
    """`palpate friction | head -1`: the robot goes on, and the report is written."""
    words = ["friction", "--quick", "--loads", "2", "--robot", "stage", "--out", str(tmp_path)]
    with subprocess.Popen(
        [sys.executable, "-m", "palpate", *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        process.stdout.close()
        assert process.stderr.read() == ""
    assert (tmp_path / "report.html").exists()
    assert (tmp_path / "friction.yaml").exists()


# --- rest of the robot ---


FIRST_LOST = 150


def plain(text):
    """A text without line breaks and tags."""
    return " ".join(html.unescape(re.sub("<[^>]*>|[│|]", " ", text)).split())


CASES = [
    RestState.NOT_KNOWN,
    pytest.param(RestState.AT_REST, marks=pytest.mark.slow),
    pytest.param(RestState.MOVING, marks=pytest.mark.slow),
]


@pytest.fixture(params=CASES, ids=str)
def ending(request, monkeypatch):
    """The back end goes on, is lost for good, or goes on moving whatever it is commanded."""
    step, done = MujocoBackend.step, []

    def failing(self, command):
        done.append(command)
        if len(done) >= FIRST_LOST and request.param is RestState.NOT_KNOWN:
            raise OSError("no reply")
        if command.phase == "stop" and request.param is RestState.MOVING:
            command = done[0].__class__((0.0, 0.0, 0.01), command.phase)
        return step(self, command)

    monkeypatch.setattr(MujocoBackend, "step", failing)
    return request.param


def test_terminal_report_log_and_json_have_the_same_clause_on_rest(ending, tmp_path, capsys):
    arguments = ["regulate", "--duration", "0.3", "--out", str(tmp_path)]
    code = main([*arguments, "--json"])
    document, terminal = capsys.readouterr()
    found = json.loads(document)
    words = found["rest"]["words"]
    assert found["rest"]["state"] == ending
    assert words.startswith(CLAUSES[ending])
    assert words in found["outcome"]
    assert words in plain(terminal)
    assert words in plain((tmp_path / "report.html").read_text())
    assert rest_in(read_log(log_in(tmp_path)).events).words == words
    assert (code == ExitCode.DONE) == (ending is RestState.AT_REST)
    main(["log", "info", str(tmp_path), "--json"])
    assert json.loads(capsys.readouterr().out)["rest"]["words"] == words
    main(["log", "info", str(tmp_path)])
    assert words in plain(capsys.readouterr().out)


def test_the_documents_have_the_same_clauses():
    page = (Path(__file__).parents[2] / "docs" / "running.md").read_text()
    assert [clause for clause in (*CLAUSES.values(), LOOK) if clause not in page] == []


@pytest.mark.parametrize("error", [MemoryError(), ImportError("failed to map segment from shared object")])
def test_without_memory_for_a_report_the_outcome_and_the_log_are_there(error, tmp_path, capsys, monkeypatch):
    def no_memory(*given):
        raise error

    monkeypatch.setattr(run, "write_result", no_memory)
    assert main(["regulate", "--duration", "0.3", "--out", str(tmp_path), "--json"]) == ExitCode.UNFINISHED
    found = json.loads(capsys.readouterr().out)
    assert found["rest"]["state"] == RestState.AT_REST
    assert (str(error) or "out of memory") in found["error"]
    assert read_log(log_in(tmp_path)).complete


# --- A folder that a run is to write into, and what an earlier run has left there ---


NAMES = ("forces.csv",)


def left(folder, *names):
    for name in names:
        (folder / name).touch()
    return folder


def test_a_sweep_is_never_written_over(tmp_path):
    with pytest.raises(InvalidValueError, match=r"holds a run of `palpate sweep.*another folder \(--out\)"):
        earlier_run(left(tmp_path, "report.html", "sweep.json"), "regulate", NAMES)


def test_the_files_that_go_are_counted(tmp_path):
    (said,) = earlier_run(left(tmp_path, "report.html", *NAMES, "mine.txt"), "regulate", NAMES)
    assert said == f"{tmp_path / 'report.html'} and 1 more file are overwritten."


@pytest.mark.slow
def test_a_log_tells_whose_folder_it_is(tmp_path, capsys):
    out = ["--out", str(tmp_path)]
    assert main(["regulate", "--duration", "0.2", *out]) == 0
    capsys.readouterr()
    assert main(["regulate", "--dry-run", *out]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "Note: " in said
    assert "report.html and 1 more file of an earlier run are overwritten; its log stays." in said
    for name in ("report.html", *NAMES):
        (tmp_path / name).unlink()
    assert earlier_run(tmp_path, "regulate", NAMES) == ()
    for typed in (["explore", *out], ["friction", "--dry-run", *out]):
        assert main(typed) == 2
        assert "holds a run of `palpate regulate`" in capsys.readouterr().err


def test_without_a_run_or_at_the_second_request_nothing_goes_on():
    def interrupted(observer):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_shown(captured(), 5.0, interrupted)


def test_a_report_that_is_interrupted_says_what_is_kept(run_over):
    told = r"not finished; the run was over, the robot is at rest; there is no"
    with pytest.raises(KeyboardInterrupt, match=told), kept_if_interrupted(run_over):
        raise KeyboardInterrupt
    with kept_if_interrupted(run_over):
        pass
