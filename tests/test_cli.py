"""The command line as a newcomer types it, mistakes included."""

import io
import json
import os
import pty
import re
import subprocess
import sys
from dataclasses import dataclass
from functools import partial
from types import SimpleNamespace
from typing import Any

import pytest
from rich.console import Console

from palpate import __version__
from palpate.cli import CommandGroup, TypedCommand, main, typed_commands
from palpate.commands.command_result import ExitCode
from palpate.commands.typed_options import coloured
from palpate.errors import InvalidValueError, OverrunError
from palpate.estimation import Assumption, BrokenAssumption
from palpate.experiments.kit import registry
from palpate.experiments.kit.registry import experiment_named, typed_words
from palpate.experiments.kit.run_report import command_line
from palpate.experiments.regulate.experiment import Regulate
from palpate.reporting.page import WrittenReport
from palpate.robots.robot import shipped_robots
from palpate.runtime.progress import lively
from palpate.sim.backend import MujocoBackend
from support import warm_process
from support.typed_mistakes import answer_to

SMALL = ["--width", "0.01", "--depth", "0.004", "--speed", "0.05"]


@pytest.fixture
def undrawn(monkeypatch):
    """Reports take longer than all else of a small run, and say nothing here."""

    def unwritten(report, path, figures):
        return WrittenReport((path,), ())

    # where it is used: a module that is first imported meanwhile would keep a stand-in from where it is defined
    monkeypatch.setattr("palpate.experiments.kit.recording.write_report", unwritten)


def test_version():
    """By the command that is installed, a process of its own."""
    command = [sys.executable, "-m", "palpate", "--version"]
    assert subprocess.check_output(command, text=True, timeout=120).strip() == f"palpate {__version__}"


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
    typed = ["explore", *SMALL, "--robot", str(mine), "--out", str(tmp_path / "run")]
    assert main(typed) == 0
    assert main([*typed, "--force", "10"]) == ExitCode.MISTAKE
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
        ("explore --robot BAD", ["bad.yaml: backend.mas_kg: unknown key", "did you mean mass_kg?", "line "]),
        ("explore --config BAD", ["bad.yaml", "this is a robot file", "--robot"]),
        ("robot check BAD", ["bad.yaml: backend.mas_kg"]),
        ("robot show ur5e", ["robot = 'ur5e'", "palpate comes with emulated-hand, emul", "panda-hand, panda-sim"]),
        *((f"{command} --robot UNREADABLE --dry-run", ["cannot be read: Permission denied"])
          for command in ("explore", "regulate", "friction")),
    ],
)  # fmt: skip
def test_a_mistake_with_a_file_is_reported_in_one_line(arguments, words, tmp_path, capsys, monkeypatch):
    stage = shipped_robots()["stage"].read_text()
    for name in ("bad", "unreadable"):
        (tmp_path / f"{name}.yaml").write_text(stage.replace("mass_kg: 5", "mas_kg: 5"))
        arguments = arguments.replace(name.upper(), str(tmp_path / f"{name}.yaml"))

    def refused(path, what):
        raise PermissionError(13, "Permission denied")

    if "unreadable" in arguments:
        monkeypatch.setattr("palpate.robots.robot.load_text", refused)
    assert main(arguments.split()) == ExitCode.MISTAKE
    said = capsys.readouterr().err
    assert said.startswith("palpate: ")
    assert said.count("\n") == 1
    assert all(word in said for word in words), said


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

        monkeypatch.setitem(sys.modules, "made_up", SimpleNamespace(run=runner))
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
@pytest.mark.usefixtures("undrawn")
def test_an_exploration_whose_map_is_not_to_be_used_exits_with_1(tmp_path, monkeypatch, capsys):
    broken = BrokenAssumption(Assumption.WITHIN_BOUNDS, "length at its limit", "feel a larger part")
    monkeypatch.setattr("palpate.mapping.surface_map.surface_map.at_bounds", lambda *_: (broken,))
    assert main(["explore", *SMALL, "--json", "--out", str(tmp_path)]) == 1
    assert "WITHIN_BOUNDS" in capsys.readouterr().out


# --- Colours and moving bars: on a terminal and nowhere else, unless the environment says so ---


ESCAPE = "\x1b["
HELP = ("robot", "--help")
MISTAKE = ("explore", "--speed", "20")
PLAIN = ("NO_COLOR", "FORCE_COLOR", "COLUMNS")


class Screen(io.StringIO):
    """A terminal."""

    def isatty(self):
        return True


@pytest.mark.parametrize(
    ("stream", "environment", "expected"),
    [
        (Screen(), {}, True),
        (io.StringIO(), {}, False),
        (Screen(), {"NO_COLOR": "1"}, False),
        (Screen(), {"NO_COLOR": ""}, True),
        (io.StringIO(), {"FORCE_COLOR": "1"}, True),
        (io.StringIO(), {"FORCE_COLOR": "1", "NO_COLOR": "1"}, False),
        (Screen(), {"TERM": "dumb"}, False),
    ],
)
def test_colours_go_to_terminals_unless_the_environment_asks_otherwise(stream, environment, expected, monkeypatch):
    for name in PLAIN:
        monkeypatch.delenv(name, raising=False)
    for name, value in {"TERM": "xterm", **environment}.items():
        monkeypatch.setenv(name, value)
    assert coloured(stream) is expected


def test_nothing_moves_where_only_colours_are_forced(monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")
    assert Console(file=io.StringIO()).is_terminal, "rich has changed its mind: `lively` may go"
    assert not lively(Console(file=io.StringIO()))
    assert lively(Console(file=Screen(), force_terminal=True))


def piped(words, **environment):
    """What a command writes into pipes."""
    done = warm_process.palpate(*words, environment={"TERM": "xterm", **environment})
    return done.stdout, done.stderr


@pytest.mark.slow
def test_pipes_get_no_colours_unless_they_are_forced_and_a_refusal_has_none():
    assert ESCAPE not in "".join(piped(HELP))
    assert ESCAPE in piped(HELP, FORCE_COLOR="1")[0]
    assert ESCAPE not in "".join(piped(HELP, FORCE_COLOR="1", NO_COLOR="1"))
    assert ESCAPE not in "".join(piped(MISTAKE, FORCE_COLOR="1"))


def test_a_refusal_has_no_colours_even_if_standard_output_is_a_terminal():
    """A terminal for standard output and a pipe for errors."""
    ours, theirs = pty.openpty()
    kept = {name: value for name, value in os.environ.items() if name not in PLAIN}
    command = [sys.executable, "-m", "palpate", *MISTAKE]
    with os.fdopen(ours), os.fdopen(theirs, "w") as terminal:
        done = subprocess.run(
            command, stdout=terminal, stderr=subprocess.PIPE, text=True, env={**kept, "TERM": "xterm"}
        )
    assert ESCAPE not in done.stderr


# --- An experiment whose name has a dot belongs to a group of commands: one that is there, or one of its own ---


@pytest.fixture
def declared(monkeypatch):
    """Packages that declare experiments of these names, all of which hold a force."""

    def declare(*names):
        made = {name: SimpleNamespace(load=partial(type, "Other", (Regulate,), {"name": name}), value="mine:Other")
                for name in names}  # fmt: skip
        monkeypatch.setattr(registry, "declared_in", lambda group: made)
        monkeypatch.setattr("palpate.cli.experiment_names", lambda: tuple(made))

    typed_commands.cache_clear()
    experiment_named.cache_clear()
    yield declare
    typed_commands.cache_clear()
    experiment_named.cache_clear()


def test_it_joins_a_group_that_is_there_or_makes_one_and_both_ways_of_typing_it_do(declared, capsys):
    declared("calibrate.mine", "mine.first", "mine.second", "plain")
    groups: Any = typed_commands()
    assert {"mine", "new", "tare"} <= set(groups["calibrate"].commands)
    assert set(groups["mine"].commands) == {"first", "second"}
    for typed in ("mine first", "mine.first", "plain"):
        assert main([*typed.split(), "--dry-run"]) == 0
    assert "expected duration" in capsys.readouterr().out
    assert main(["calibrate", "mine", "--dry-run", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert (report["command"], report["dry_run"]) == ("calibrate mine", True)


def test_what_a_report_says_to_type_is_what_can_be_typed():
    assert typed_words("group.word") == ("group", "word")
    assert typed_words("mine.py:Mine") == ("mine.py:Mine",)
    assert command_line("group.word", Regulate.Config(force=3.0)) == "palpate group word --force 3.0"


# --- Slips of the fingers ---


@pytest.mark.parametrize("typed", ["explore --out sphere --speed 20", "explore --object qqqq"])
def test_what_is_no_slip_of_that_kind_gets_no_advice(typed, capsys):
    assert not re.search("(D|d)id you mean", answer_to(typed.split(), capsys))
