"""The commands as one family: every one has help with an example, succeeds once, and refuses one mistake."""

import json
import re
import shutil
import socket
from itertools import pairwise
from pathlib import Path

import pytest

from palpate.cli import CommandGroup, main, typed_commands
from palpate.commands.command_result import ExitCode
from palpate.experiments.kit.registry import experiment_names, typed_words
from palpate.hw.rig import Rig
from palpate.robots.robot import shipped_robots
from palpate.sim import MujocoBackend
from palpate.sim.hand.backend import HandBackend
from support.cli_samples import SAMPLES, leaves, prepared
from support.typed_mistakes import ended, words_of

NARROW = 80
COMMAND_NAMES = [*leaves()]
GROUPS = [name for name, what in typed_commands().items() if isinstance(what, CommandGroup)]
MOVING = [" ".join(typed_words(name)) for name in experiment_names()]
QUICK = [name for name, sample in SAMPLES.items() if sample.success and name not in MOVING]


@pytest.fixture(scope="module")
def filled(tmp_path_factory):
    """A folder with what the samples name, and what the exploration there has said."""
    folder = tmp_path_factory.mktemp("filled")
    return folder, prepared(folder)


@pytest.fixture
def here(filled, tmp_path, monkeypatch):
    """A copy of it, as the present folder."""
    folder = tmp_path / "here"
    shutil.copytree(filled[0], folder, symlinks=True)
    monkeypatch.chdir(folder)
    return folder


def listing(folder):
    """Every file and folder, with the files' sizes."""
    return {str(path): path.stat().st_size if path.is_file() else None for path in folder.rglob("*")}


def test_every_command_is_in_the_table():
    assert sorted(COMMAND_NAMES) == sorted(SAMPLES)


@pytest.mark.parametrize("name", ["", *GROUPS, *COMMAND_NAMES])
def test_help_ends_well_has_an_example_fills_its_lines_and_names_the_options_of_all_commands(
    name, capsys, monkeypatch
):
    """In a box, no line ends where the first word of the next would still have had room."""
    monkeypatch.setenv("COLUMNS", str(NARROW))
    assert ended([*name.split(), "--help"]) == 0
    shown, errors = capsys.readouterr()
    assert errors == ""
    assert re.search(r"Example\b", shown)
    assert f"palpate {name}".strip() in shown
    assert "\x1b[" not in shown, "colours without a terminal"
    if name in SAMPLES:
        assert "--json" in shown
        assert "(no help)" not in shown
    # boxes fill the width, with spaces where there are no lines to draw; lines above them are not wrapped
    inside = [line[2:-2] for line in shown.splitlines() if len(line) == NARROW]
    assert any("--help" in line for line in inside)
    for line, following in pairwise(inside):
        column = len(following) - len(following.lstrip())
        if not 4 <= column < len(following) or line[column - 2 : column].strip() or line[column] == " ":
            continue  # another option, or the words above belong to none of its help
        room = NARROW - 4 - len(line.rstrip()) - 1
        assert len(following.split()[0]) > room, f"{line!r} could hold more of {following!r}"


@pytest.mark.slow
@pytest.mark.parametrize("name", QUICK)
def test_a_command_succeeds_and_its_document_is_all_there_is_on_standard_output(name, here, capsys):
    assert ended([*name.split(), *SAMPLES[name].success.split(), "--json"]) == 0
    found = json.loads(capsys.readouterr().out, parse_constant=lambda word: pytest.fail(f"{word} is no JSON"))
    assert found["schema"] == 1
    assert (found["command"], found["status"], found["exit_code"]) == (name, "done", 0)
    assert "error" not in found
    assert isinstance(found["warnings"], list)
    if "--dry-run" not in SAMPLES[name].success:
        for file in found["files"]:
            assert (here / file).is_file(), "a file that is not there"


@pytest.mark.slow
@pytest.mark.parametrize("name", SAMPLES)
def test_a_mistake_is_refused_in_words_and_as_a_document_and_nothing_is_written(name, here, capsys):
    sample, before = SAMPLES[name], listing(here)
    typed = [*name.split(), *sample.mistake.split()]
    assert ended(typed) == ExitCode.MISTAKE
    told = capsys.readouterr()
    assert told.out in ("", "planning\n"), "more than what was being done when it came out"
    assert "Traceback" not in told.err
    assert all(word in words_of(told.err) for word in sample.named), told.err
    assert ended([*typed, "--json"]) == ExitCode.MISTAKE
    found = json.loads(capsys.readouterr().out)
    assert (found["command"], found["status"], found["exit_code"]) == (name, "wrong_input", 2)
    assert all(word in found["error"] for word in sample.named), found["error"]
    assert not re.search("[│╭╮╰╯─]|For full help", found["error"])
    assert listing(here) == before


@pytest.fixture
def still(monkeypatch):
    """Nothing may start: no simulation, and no device."""
    for kind in (MujocoBackend, HandBackend, Rig):
        monkeypatch.setattr(kind, "start", lambda *_, **__: pytest.fail("something was started"))
    monkeypatch.setattr(socket, "socket", lambda *_, **__: pytest.fail("something was connected to"))


@pytest.mark.slow
@pytest.mark.parametrize("name", MOVING)
def test_a_dry_run_plans_and_moves_nothing_and_writes_nothing(name, here, capsys, still):
    before = listing(here)
    typed = [*name.split(), *SAMPLES[name].success.split(), "--dry-run"]
    assert main(typed) == 0
    assert "nothing was moved, nothing was written" in words_of(capsys.readouterr().out)
    assert main([*typed, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["dry_run"] is True
    assert told["metrics"]["expected_duration_s"] > 0.0
    assert listing(here) == before


@pytest.mark.parametrize("name", ["explore", "regulate", "friction"])
def test_a_rig_is_planned_for_without_a_connection(name, capsys, still):
    assert main([name, "--robot", "ur5e-netft", "--dry-run", "--json"]) == 0
    assert "devices were not connected to" in json.loads(capsys.readouterr().out)["robot"]


@pytest.mark.parametrize("name", MOVING)
def test_a_dry_run_refuses_what_the_run_would_refuse(name, here, capsys):
    typed = [*name.split(), *SAMPLES[name].success.split(), "--dry-run", "--json"]
    blocked = here / "blocked"
    blocked.write_text("in the way")
    assert main([*typed, "--out", str(blocked / "run")]) == ExitCode.MISTAKE
    assert str(blocked) in json.loads(capsys.readouterr().out)["error"]
    assert ended([*name.split(), *SAMPLES[name].mistake.split(), "--dry-run"]) == ExitCode.MISTAKE


def check_figures(name, told, done):
    """What a run has said must fit what its dry run had."""
    assert (done["command"], done["status"], done["ending"]) == (name, "done", "done")
    assert done["metrics"]["simulated_s"] == pytest.approx(told["metrics"]["expected_duration_s"], rel=0.5)
    names = [[Path(file).name for file in each["files"] if not file.endswith(".mcap")] for each in (told, done)]
    assert names[0] == names[1]
    assert len(told["files"]) == len(done["files"])


def test_an_exploration_gives_its_figures_and_writes_what_the_dry_run_says(filled, here, capsys):
    assert main(["explore", *SAMPLES["explore"].success.split(), "--dry-run", "--json"]) == 0
    check_figures("explore", json.loads(capsys.readouterr().out), filled[1])
    assert filled[1]["metrics"]["force_rms_n"] < 0.05


def test_a_path_that_leaves_the_workspace_is_refused_before_anything_moves(here, capsys, still):
    stage = shipped_robots()["stage"].read_text()
    narrow = stage.replace("workspace_upper_m: [1, 1, 1]", "workspace_upper_m: [0.01, 1, 1]")
    (here / "narrow.yaml").write_text(narrow)
    assert main(["explore", "--robot", "narrow.yaml", "--dry-run"]) == ExitCode.MISTAKE
    assert "leaves the robot's workspace" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize("name", ["regulate", "friction", "grasp"])
def test_a_run_gives_its_figures_and_writes_what_the_dry_run_said(name, here, capsys):
    typed = [name, *SAMPLES[name].success.split()]
    assert main([*typed, "--dry-run", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    before = listing(here)
    assert main([*typed, "--json"]) == 0
    done = json.loads(capsys.readouterr().out)
    check_figures(name, told, done)
    written = {file for file in listing(here).keys() - before if Path(file).is_file()}
    assert {str(here / file) for file in done["files"]} == {f for f in written if not f.endswith("latest.mcap")}
