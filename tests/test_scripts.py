"""`import palpate as pp` in scripts: typed names, short results, clear errors."""

import os
import shutil
import subprocess
import sys
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import pytest

import palpate as pp
from palpate.experiments.kit.registry import experiment_named
from palpate.experiments.kit.script import perform
from palpate.runtime.batch import quiet
from support.sweep_runs import planned
from support.tiny_experiment import TINY

SCRIPT = """\
import palpate as pp

explored: pp.ExplorationResult = pp.explore(pp.ExploreConfig(object="sphere", width=0.01))
regulated: pp.RegulationResult = pp.regulate(pp.RegulateConfig(duration=1.0), out="runs/held")
measured: pp.FrictionResult = pp.measure_friction(pp.FrictionConfig(friction=0.8, quick=True))
grasped: pp.GraspResult = pp.grasp_object(pp.GraspConfig(fingers=3))
calibrated: pp.TipCalibrationResult = pp.calibrate_tip(pp.TipCalibrationConfig(unknown_tip=1))
points: int = len(explored.cloud)
surface: pp.LimitSurface = pp.LimitSurface(0.5, 0.004)
tip: pp.MeshSurface = pp.load_mesh("tip.stl")
try:
    log: pp.Log = pp.read_log("runs/held")
except (pp.InvalidValueError, pp.DeviceError) as error:
    print(error, points, regulated.run.ending is pp.Ending.DONE, surface, tip)
"""
"""As somebody writes one who has a type checker."""

WRONG = """\
import palpate as pp

pp.explore("sphere")
pp.regulate(pp.ExploreConfig())
pp.explor
text: str = pp.measure_friction(pp.FrictionConfig())
"""
"""An error in each of its lines."""

SOURCE = Path(pp.__file__).parents[1]


def checked(checker, source, folder):
    """Exit code and output of a type checker for a script somewhere else."""
    script = folder / "script.py"
    script.write_text(source, encoding="utf-8")
    python = {"PYTHONPATH": str(SOURCE), "MYPYPATH": str(SOURCE)}
    words = {
        "mypy": [sys.executable, "-m", "mypy", "--strict", "--follow-imports=silent", f"--cache-dir={folder}"],
        "pyright": [shutil.which("pyright") or "pyright", f"--pythonpath={sys.executable}"],
    }
    if checker == "pyright":
        (folder / "pyrightconfig.json").write_text(f'{{"extraPaths": ["{SOURCE}"]}}', encoding="utf-8")
    done = subprocess.run(
        [*words[checker], script.name],
        cwd=folder, env=os.environ | python, capture_output=True, text=True, check=False,
    )  # fmt: skip
    return done.returncode, done.stdout + done.stderr


def is_installed(checker):
    return shutil.which("pyright") is not None if checker == "pyright" else find_spec("mypy") is not None


@pytest.mark.slow
@pytest.mark.parametrize("checker", ["mypy", "pyright"])
def test_type_checkers_know_all_five_experiments(checker, tmp_path):
    if not is_installed(checker):
        pytest.skip(f"{checker} is not installed")
    code, said = checked(checker, SCRIPT, tmp_path)
    assert code == 0, said
    assert "0 errors" in said or "no issues found" in said
    code, said = checked(checker, WRONG, tmp_path)
    assert code == 1
    for line in (3, 4, 5, 6):
        assert f"script.py:{line}" in said, said


def test_the_star_imports_what_dir_lists_and_every_name_is_there():
    scope = {}
    exec("from palpate import *", scope)
    assert {name for name in scope if not name.startswith("__")} == set(dir(pp))
    assert len(dir(pp)) > 100
    assert pp.load_mesh is scope["load_mesh"]
    for name in dir(pp):
        assert getattr(pp, name) is scope[name]
    assert sorted(getattr(pp, "__all__")) == dir(pp)  # noqa: B009  # the stub does not state it


def test_a_misspelt_name_is_answered_by_the_right_one():
    with pytest.raises(AttributeError, match=r"has no attribute 'explor': did you mean explore\?"):
        getattr(pp, "explor")  # noqa: B009
    with pytest.raises(AttributeError, match=r"dir\(palpate\) lists its names"):
        getattr(pp, "quite_different")  # noqa: B009
    assert not hasattr(pp, "_private")


@pytest.mark.parametrize(
    ("function", "config", "remedy"),
    [
        (pp.explore, "sphere", r"'sphere': .* for example pp\.ExploreConfig\(object=\"sphere\"\)"),
        (pp.explore, None, r"None: .* for example pp\.ExploreConfig\(\)"),
        (pp.explore, pp.ExploreConfig, r"must be of the class pp\.ExploreConfig"),
        (pp.regulate, {"force": 2.0}, r"for example pp\.RegulateConfig\(\)"),
        (pp.grasp_object, pp.ExploreConfig(), r"for example pp\.GraspConfig\(\)"),
        (pp.measure_friction, 2, r"for example pp\.FrictionConfig\(\)"),
        (pp.calibrate_tip, "stage", r"for example pp\.TipCalibrationConfig\(\)"),
    ],
)
def test_anything_but_a_configuration_is_answered_by_the_way_to_make_one(function, config, remedy):
    with pytest.raises(pp.InvalidValueError, match=rf"^config = .*{remedy}"):
        function(config)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Two runs of the smallest experiment in one folder."""
    folder = tmp_path_factory.mktemp("tapped")
    experiment = experiment_named(TINY)
    for force in (1.0, 2.0):
        perform(experiment, experiment.Config(force=force), folder)
    return folder


def test_a_log_is_read_from_its_folder_as_commands_do(folder, tmp_path):
    from_folder, from_file = pp.read_log(str(folder)), pp.read_log(folder / "latest.mcap")
    assert from_folder.rows.tobytes() == from_file.rows.tobytes()
    assert pp.replay_log(folder).identical
    with pytest.raises(pp.InvalidValueError, match=r"no latest\.mcap in this folder; name the log's file"):
        pp.read_log(tmp_path)


def check_short(shown, *words):
    lines = shown.splitlines()
    assert 3 <= len(lines) <= 12
    assert len(shown) < 2500
    for word in words:
        assert word in shown


def test_a_result_is_printed_in_a_few_lines():
    found = pp.explore(pp.ExploreConfig(width=0.006, depth=0.004, speed=0.04))
    for shown in (str(found), repr(found), f"{found}"):
        check_short(shown, "Exploration of a sphere", "  largest force felt: ", " mm", "more metrics")


@pytest.mark.slow
def test_a_replay_and_a_sweep_are_printed_in_a_few_lines(folder, tmp_path):
    check_short(repr(pp.replay_log(folder)), "identical")
    config = replace(planned("force=1,2").config, out=tmp_path)
    check_short(repr(pp.sweep(config, quiet)), "All 2 runs got to their end.")


def test_a_result_that_is_not_whole_has_a_name():
    assert repr(object.__new__(pp.ExplorationResult)) == "<ExplorationResult>"
