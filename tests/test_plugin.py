"""An experiment of a stranger's package does all that built-in ones do, and nothing built in knows any by name."""

import ast
import functools
import importlib
import json
import runpy
import signal
from collections import Counter
from importlib.metadata import entry_points
from pathlib import Path

import pytest

from palpate.hw.ft_stream import StreamSettings
from palpate.hw.serial_ft import SerialSensor
from palpate.testing import check_arm, check_sensor
from support.installed_plugin import InstalledPlugin
from support.ur_wire_sessions import own_address

ROOT = Path(__file__).parents[1]
PLUGIN = ROOT / "examples" / "plugin"
SCRIPT = ROOT / "examples" / "my_texture.py"
SHORT = ("--strokes", "1", "--length", "0.008")


@pytest.fixture(scope="module")
def palpate(tmp_path_factory):
    """The command as whoever has installed the plug-in types it, in a folder of its own."""
    return InstalledPlugin(PLUGIN, tmp_path_factory)


@pytest.mark.slow
def test_its_name_and_its_options_are_shown(palpate):
    assert "texture" in palpate("--help")
    shown = palpate("texture", "--help")
    assert "--wavelength" in shown
    assert "[m]" in shown
    assert "texture" in palpate("sweep", "nothing-like-it", fails=True)


@pytest.mark.slow
def test_it_runs_and_is_replayed_with_another_force(palpate):
    metrics = json.loads(palpate("texture", *SHORT, "--out", "one", "--json"))["metrics"]
    assert metrics["strokes"] == 1
    assert metrics["wavelength_m"] == pytest.approx(0.004, rel=0.1)
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


@pytest.mark.slow
def test_a_class_in_a_script_does_all_that_too(palpate):
    named = f"{SCRIPT}:Texture"
    assert json.loads(palpate(named, "--out", "mine", "--json"))["metrics"]["roughness_rms_um"] == pytest.approx(
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


@functools.cache
def mentioned():
    """Names that each module imports, and its constants: path, imported, constants."""
    found = []
    for path, tree in trees().items():
        nodes = list(ast.walk(tree))
        imports = [node for node in nodes if isinstance(node, ast.ImportFrom | ast.Import)]
        names = {getattr(node, "module", None) or "" for node in imports}
        names |= {each.name for node in imports for each in node.names}
        constants = {repr(node.value) for node in nodes if isinstance(node, ast.Constant)}
        found.append((path.as_posix(), names, constants))
    return found


@pytest.mark.slow
@pytest.mark.parametrize("point", entry_points(group="palpate.experiments"), ids=lambda point: point.name)
def test_no_module_outside_an_experiment_names_it(point):
    """No module imports it or holds its name as a text; docstrings may, as examples of what to type."""
    package = point.module.rpartition(".")[0]
    for path, names, constants in mentioned():
        if package.replace(".", "/") + "/" in path:
            continue
        assert not any(package in name for name in names), path
        if any(f"palpate/{room}" in path for room in GENERIC):
            assert repr(point.name) not in constants, path


@pytest.mark.slow
def test_a_public_class_has_a_name_of_its_own():
    names = Counter(
        node.name
        for tree in trees().values()
        for node in tree.body
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_")
    )
    assert [name for name, count in names.items() if count > 1] == []


# --- An arm, a sensor and a fingertip of a stranger's package, in one robot file, through the commands ---


CELL = Path(__file__).parents[1] / "examples" / "plugin_cell"
PATIENT = (("sample_age_s: 0.3", "sample_age_s: 1.0"), ("silent_after_s: 0.3", "silent_after_s: 3.0"),
           ("watchdog_s: 0.3", "watchdog_s: 1.0"))  # fmt: skip

NOISE = (0.003, 0.003, 0.003, 1.6e-5, 1.6e-5, 1.6e-5)


@pytest.fixture(scope="module")
def palpate_cell(tmp_path_factory):
    typed = InstalledPlugin(CELL, tmp_path_factory)
    text = (CELL / "bench.yaml").read_text().replace("127.0.0.40", own_address(90))
    for before, after in (*PATIENT, ("/tmp/bench-box", str(typed.folder / "box"))):
        assert before in text
        text = text.replace(before, after)
    (typed.folder / "bench.yaml").write_text(text)
    return typed


@pytest.mark.slow
@pytest.mark.wire
def test_its_kinds_are_words_of_robot_files_and_mistakes_have_their_place(palpate_cell):
    assert "bench_arm" in palpate_cell("robot", "check", "bench.yaml")
    for before, after, words in (
        ("kind: bench_arm", "kind: bench_armm", ("did you mean bench_arm?", "ur", "line 6")),
        ("watchdog_s: 1.0", "watchdog_s: 100", ("backend.arm.watchdog_s = 100", "0.01 to 1 s")),
        ("diameter_m: 0.016", "diameter_m: 16", ("fingers[0].surface.diameter_m = 16", "another unit?")),
    ):
        text = (palpate_cell.folder / "bench.yaml").read_text()
        assert before in text
        (palpate_cell.folder / "wrong.yaml").write_text(text.replace(before, after))
        refused = palpate_cell("robot", "check", "wrong.yaml", fails=True)
        assert all(word in refused for word in words), refused


@pytest.mark.slow
@pytest.mark.wire
def test_its_fingertip_is_swept_in_simulation_and_its_devices_are_refused(palpate_cell):
    (palpate_cell.folder / "bench-sim.yaml").write_text((CELL / "bench-sim.yaml").read_text())
    words = ("sweep", "regulate", "--out", "swept", "--json", "--vary", "force=1,2", "--set", "duration=0.3")
    swept = json.loads(palpate_cell(*words, "robot=bench-sim.yaml"))
    assert swept["outcome"] == "All 2 runs got to their end."
    assert "simulated robots only" in palpate_cell(*words, "robot=bench.yaml", fails=True)


@pytest.mark.wire
@pytest.mark.slow
def test_its_arm_and_its_sensor_conform(palpate_cell, monkeypatch):
    monkeypatch.syspath_prepend(str(CELL))
    arm, box = (importlib.import_module(f"palpate_bench.{name}") for name in ("arm", "box"))
    emulator = palpate_cell.begun("emulate", "robot", "bench.yaml")
    try:
        while "Runs until" not in (line := emulator.stdout.readline()):
            assert line, "it ended"
        check_arm(lambda: arm.BenchArm(own_address(90), 40_000, watchdog=1.0, silent_after=3.0))
        stream = StreamSettings(NOISE, silent_after=3.0)
        check_sensor(lambda: SerialSensor(str(palpate_cell.folder / "box"), box.BenchLines(), stream), NOISE)
    finally:
        emulator.send_signal(signal.SIGINT)
        emulator.communicate(timeout=20)


@pytest.mark.wire
@pytest.mark.slow
def test_its_devices_are_emulated_examined_recovered_and_used(palpate_cell):
    emulator = palpate_cell.begun("emulate", "robot", "bench.yaml")
    try:
        while "Runs until" not in (line := emulator.stdout.readline()):
            assert line, "it ended"
        found = json.loads(palpate_cell("recover", "bench.yaml", "--json"))
        assert found["fit"]
        assert found["devices"][1]["state"] == "it stands still"
        # at 250 Hz and 26 ms of delay a tip that presses with 2 N may bounce on landing until it gives up
        calm = ("--duration", "2", "--force", "5", "--landing-speed", "0.003")
        outcome = json.loads(palpate_cell("regulate", "--robot", "bench.yaml", *calm, "--out", "held", "--json"))
        assert outcome["status"] == "done"
        assert outcome["metrics"]["sensed_rms_n"] < 0.5
        assert "identical" in palpate_cell("replay", "held")
        area = ("--width", "0.004", "--depth", "0.002", "--object", "box")
        explored = json.loads(palpate_cell("explore", "--robot", "bench.yaml", *area, "--out", "felt", "--json"))
        assert explored["status"] == "done"
        assert explored["metrics"]["contacts"] > 50
    finally:
        emulator.send_signal(signal.SIGINT)
        emulator.communicate(timeout=20)
    assert emulator.returncode == 0
