"""An experiment of a stranger's package does all that built-in ones do, and nothing built in knows any by name."""

import ast
import functools
import json
import runpy
from collections import Counter
from importlib.metadata import entry_points
from pathlib import Path

import pytest

from support.installed_plugin import InstalledPlugin

ROOT = Path(__file__).parents[1]
PLUGIN = ROOT / "examples" / "plugin"
SCRIPT = ROOT / "examples" / "my_texture.py"
SHORT = ("--strokes", "1", "--length", "0.008")


@pytest.fixture(scope="module")
def palpate(tmp_path_factory):
    """The command as whoever has installed the plug-in types it, in a folder of its own."""
    return InstalledPlugin(PLUGIN, tmp_path_factory)


def test_its_name_and_its_options_are_shown(palpate):
    assert "texture" in palpate("--help")
    shown = palpate("texture", "--help")
    assert "--wavelength" in shown
    assert "[m]" in shown
    assert "texture" in palpate("sweep", "nothing-like-it", fails=True)


def test_it_runs_and_is_replayed_with_another_force(palpate):
    figures = json.loads(palpate("texture", *SHORT, "--out", "one", "--json"))["figures"]
    assert figures["strokes"] == 1
    assert figures["wavelength_m"] == pytest.approx(0.004, rel=0.1)
    assert "identical" in palpate("replay", "one")
    assert "commands identical" in palpate("replay", "one", "--set", "force=2")
    palpate("texture", *SHORT, "--force", "2", "--out", "two")
    assert "roughness" in palpate("compare", "one", "two", "--out", "compared")
    assert (palpate.folder / "one" / "report.html").stat().st_size > 10_000


def test_its_own_test_checks_its_controller(monkeypatch):
    monkeypatch.syspath_prepend(str(PLUGIN))
    runpy.run_path(str(PLUGIN / "test_strokes.py"))["test_strokes_are_a_pure_step_function"]()


@pytest.mark.slow
def test_it_is_dry_run_on_a_robot_swept_and_seen(palpate):
    assert "expected duration" in palpate("texture", "--robot", "ur5e-sim", "--dry-run")
    varied = ("--vary", "force=1,2", "--seeds", "2", "--set", "strokes=1", "--set", "length=0.008")
    palpate("sweep", "texture", *varied, "--out", "swept")
    assert len((palpate.folder / "swept" / "runs.csv").read_text().splitlines()) == 5
    palpate("texture", *SHORT, "--out", "one")
    palpate("view", "one", "--picture", "seen.png")
    assert (palpate.folder / "seen.png").stat().st_size > 10_000


def test_a_class_in_a_script_does_all_that_too(palpate):
    named = f"{SCRIPT}:Texture"
    assert json.loads(palpate(named, "--out", "mine", "--json"))["figures"]["roughness_rms_um"] == pytest.approx(
        6.6, 0.1
    )
    assert "identical" in palpate("replay", "mine")
    assert "Texture" in palpate(f"{SCRIPT}:Textur", fails=True), "a mistyped class is told what there is"


# --- nothing built in has a way in that a stranger's package lacks ---


@functools.cache
def trees():
    """Every module of the source, parsed."""
    folders = (ROOT / "src", ROOT / "controllers", ROOT / "hw", ROOT / "sim")
    return {path: ast.parse(path.read_text()) for folder in folders for path in folder.resolve().rglob("*.py")}


GENERIC = ("cli", "commands", "reporting", "robots", "experiments/kit", "learning")
"""What carries out, reports and compares experiments of any package. (A view draws friction, the quantity.)"""


@pytest.mark.parametrize("point", entry_points(group="palpate.experiments"), ids=lambda point: point.name)
def test_no_module_outside_an_experiment_names_it(point):
    """Neither imports it nor has its name as a text; docstrings may, as examples of what to type."""
    package = point.module.rpartition(".")[0]
    for path, tree in trees().items():
        if package.replace(".", "/") + "/" in path.as_posix():
            continue
        generic = any(f"palpate/{room}" in path.as_posix() for room in GENERIC)
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom | ast.Import):
                imported = [getattr(node, "module", None) or "", *(each.name for each in node.names)]
                assert not any(package in each for each in imported), f"{path}:{node.lineno}"
            elif generic and isinstance(node, ast.Constant):
                assert node.value != point.name, f"{path}:{node.lineno}"


def test_a_public_class_has_a_name_of_its_own():
    names = Counter(
        node.name
        for tree in trees().values()
        for node in tree.body
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_")
    )
    assert [name for name, count in names.items() if count > 1] == []
