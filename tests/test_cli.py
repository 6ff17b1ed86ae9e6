"""The command line as a newcomer types it, mistakes included."""

import re
import signal
import subprocess
import sys
import types
from dataclasses import dataclass
from time import sleep

import pytest

from palpate import __version__
from palpate.cli import CommandGroup, TypedCommand, main
from palpate.commands.command_result import ExitCode
from palpate.errors import InvalidValueError, OverrunError
from palpate.estimation import Assumption, BrokenAssumption
from palpate.robots.robot import shipped_robots
from palpate.sim.backend import MujocoBackend
from support.waiting import until

SMALL = ["--width", "0.01", "--depth", "0.004", "--speed", "0.05"]


def run(*arguments):
    return subprocess.run(
        [sys.executable, "-m", "palpate", *arguments], capture_output=True, text=True, timeout=120
    )


def test_exploration_leaves_its_files_and_says_where(tmp_path):
    done = run("explore", *SMALL, "--out", str(tmp_path / "new" / "folder"))
    assert done.returncode == 0, done.stderr
    names = {path.name for path in (tmp_path / "new" / "folder").iterdir() if path.suffix != ".mcap"}
    assert names == {
        "report.html",
        "contacts.ply",
        "contacts.csv",
        "marks.csv",
        "map.ply",
        "map.stl",
        "height_map.csv",
    }
    assert "report.html" in done.stdout
    assert "\x1b[" not in done.stdout, "colours in a pipe"


@pytest.fixture
def undrawn(monkeypatch):
    """Reports take longer than all else of a small run, and say nothing here."""
    monkeypatch.setattr("palpate.reporting.page.write_report", lambda report, path: None)


def test_version():
    """By the command that is installed, a process of its own."""
    assert run("--version").stdout.strip() == f"palpate {__version__}"


def test_help_does_not_load_the_simulator():
    """Heavy imports wait until something runs."""
    code = (
        "import sys, palpate.cli\n"
        "for words in (['explore'], ['robot'], ['robot', 'check'], []):\n"
        "    try: palpate.cli.main([*words, '--help'])\n"
        "    except SystemExit: pass\n"
        "heavy = {'mujoco', 'numba', 'matplotlib', 'scipy'} & set(sys.modules)\n"
        "sys.exit(', '.join(sorted(heavy)) or 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr


def test_a_folder_that_cannot_be_made_is_named_before_anything_moves(tmp_path, monkeypatch, capsys):
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    monkeypatch.setattr(MujocoBackend, "step", lambda *_: pytest.fail("found out only when it moves"))
    assert main(["explore", "--out", str(blocked)]) == ExitCode.MISTAKE
    assert str(blocked) in capsys.readouterr().err


# --- files ---


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_a_shown_robot_is_a_start_for_your_own(tmp_path, capsys):
    assert main(["robot", "list"]) == 0
    listed = capsys.readouterr().out
    for name in shipped_robots():
        assert re.search(rf"^{name} ", listed, re.MULTILINE)
    assert main(["robot", "show", "stage"]) == 0
    mine = tmp_path / "mine.yaml"
    mine.write_text(capsys.readouterr().out.replace("force_N: 20 ", "force_N: 12 "))
    assert main(["robot", "check", str(mine)]) == 0
    assert re.search(r"limits\.force +12 N\n", capsys.readouterr().out)
    assert main(["explore", *SMALL, "--robot", str(mine), "--out", str(tmp_path / "run")]) == 0
    assert (
        main(["explore", *SMALL, "--robot", str(mine), "--force", "10", "--out", str(tmp_path / "run")])
        == ExitCode.MISTAKE
    )
    assert "robot's limit of 12 N" in capsys.readouterr().err


def test_check_says_every_value_with_its_unit_and_which_are_default(capsys):
    assert main(["robot", "check", "stage-nano17"]) == 0
    said = capsys.readouterr().out
    for line in (
        r"backend\.bandwidth +100 rad/s",
        r"fingers\[0\]\.surface\.radius +0\.008 m",
        r"fingers\[0\]\.noise\.moment +1\.5625e-05 Nm",
        r"limits\.acceleration +25 m/s\^2 +default",
        r"limits\.joint_lower +not limited +default",
        r"sensor of finger 0: ATI Nano17 .* up to 12 12 17 N",
    ):
        assert re.search(rf"^ +{line}", said, re.MULTILINE), line


@pytest.mark.parametrize(("robot", "risky"), [("ur5e-hand", True), ("ur5e-netft", False), ("stage", False)])
def test_check_says_what_is_risked_without_a_second_channel_of_force(robot, risky, capsys):
    assert main(["robot", "check", robot]) == 0
    assert ("No second channel: " in capsys.readouterr().out) is risky


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (
            ["explore", "--robot", "BAD"],
            ["bad.yaml: backend.mas_kg: unknown key", "did you mean mass_kg?", "line "],
        ),
        (["explore", "--config", "BAD"], ["bad.yaml", "this is a robot file", "--robot"]),
        (["robot", "check", "BAD"], ["bad.yaml: backend.mas_kg"]),
        (
            ["robot", "show", "ur5e"],
            ["robot = 'ur5e'", "palpate comes with emulated-hand, emulated-ur5e, panda-hand, panda-sim"],
        ),
    ],
)
def test_what_is_wrong_with_a_file_is_said_in_one_line(arguments, words, tmp_path, capsys):
    bad = tmp_path / "bad.yaml"
    bad.write_text(shipped_robots()["stage"].read_text().replace("mass_kg: 5", "mas_kg: 5"))
    assert main([str(bad) if word == "BAD" else word for word in arguments]) == ExitCode.MISTAKE
    said = capsys.readouterr().err
    assert said.startswith("palpate: ")
    assert said.count("\n") == 1
    for word in words:
        assert word in said


# --- how it ends ---


@dataclass(frozen=True)
class Nothing:
    """Do nothing."""


@pytest.fixture
def ending(monkeypatch):
    """Return what the command line returns when a command, nested like the others, raises or returns something."""

    def run_it(result):
        def runner(config):
            if isinstance(result, BaseException):
                raise result
            return result

        monkeypatch.setitem(sys.modules, "made_up", types.SimpleNamespace(run=runner))
        made = {"made": CommandGroup({"up": TypedCommand(Nothing, "made_up:run")}, "Nothing.")}
        monkeypatch.setattr("palpate.cli.typed_commands", lambda: made)
        return main(["made", "up"])

    return run_it


@pytest.mark.parametrize(
    ("result", "code", "said"),
    [
        (0, 0, ""),
        (1, 1, ""),
        (
            InvalidValueError("a = 1 m:\n  must be 2;\ntake 2"),
            ExitCode.MISTAKE,
            "palpate: a = 1 m: must be 2; take 2\n",
        ),
        (OverrunError("late by 3 ms"), ExitCode.UNFINISHED, "palpate: late by 3 ms; the robot was stopped\n"),
        (
            OSError(28, "No space left on device"),
            ExitCode.UNFINISHED,
            "palpate: [Errno 28] No space left on device\n",
        ),
        (
            KeyboardInterrupt("interrupted; the robot was stopped"),
            ExitCode.INTERRUPTED,
            "palpate: interrupted; the robot was stopped\n",
        ),
        (
            KeyboardInterrupt(),
            ExitCode.INTERRUPTED,
            "palpate: interrupted; nothing was finished, and nothing is kept\n",
        ),
    ],
)
def test_every_ending_has_its_exit_code_and_one_line(result, code, said, ending, capsys):
    assert ending(result) == code
    assert capsys.readouterr().err == said


@pytest.mark.slow
def test_ctrl_c_stops_the_robot_and_says_so(tmp_path):
    out = tmp_path / "run"
    endless = ["--speed", "0.002", "--spacing", "0.001", "--out", str(out)]
    process = subprocess.Popen(
        [sys.executable, "-m", "palpate", "explore", *endless],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    until(lambda: any(out.glob("*.mcap")))  # there is a log as soon as the run has begun
    sleep(0.5)
    process.send_signal(signal.SIGINT)
    said, _ = process.communicate(timeout=60)
    assert process.returncode == ExitCode.INTERRUPTED
    assert "interrupted" in said
    assert "the robot was stopped" in said or "the robot is at rest" in said
    assert "Traceback" not in said


@pytest.mark.parametrize("command", ["explore", "regulate", "friction"])
def test_a_robot_file_that_cannot_be_read_is_wrong_input_everywhere(command, tmp_path, monkeypatch, capsys):
    file = tmp_path / "mine.yaml"
    file.write_text(shipped_robots()["stage"].read_text())

    def refused(path, what):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("palpate.robots.robot.load_text", refused)
    assert main([command, "--robot", str(file), "--dry-run"]) == ExitCode.MISTAKE
    assert "cannot be read: Permission denied" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_an_exploration_whose_map_is_not_to_be_used_exits_with_1(tmp_path, monkeypatch, capsys):
    broken = BrokenAssumption(Assumption.WITHIN_BOUNDS, "length at its limit", "feel a larger part")
    monkeypatch.setattr("palpate.mapping.surface_map.surface_map.at_bounds", lambda *_: (broken,))
    assert main(["explore", *SMALL, "--json", "--out", str(tmp_path)]) == 1
    assert "WITHIN_BOUNDS" in capsys.readouterr().out
