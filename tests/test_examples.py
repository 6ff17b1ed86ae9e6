"""Every example runs as it stands, and what it prints is what its text claims."""

import ast
import csv
import json
import math
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from palpate.hw.emulators.process import EmulatorProcess
from support import warm_process
from support.document_blocks import load_module
from support.emulated_file import unhurried_file
from support.resting_box import BOX, box_at_rest

ROOT = Path(__file__).parent.parent
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))

SPAWNS = {"live_netft.py", "own_sensor.py", "sim_to_emulated.py", "sweep.py"}
"""Examples that start processes of their own: these import the script, which a fork has not been started with."""


def printed_by(name, *arguments, folder):
    """Run an example as a user would, one of an experiment by palpate, without a screen; return what it prints."""
    environment = {"MPLBACKEND": "Agg", "OPENBLAS_NUM_THREADS": "1", "COLUMNS": "120"}
    path = ROOT / "examples" / name
    if name in SPAWNS:
        command = [sys.executable, "-W", "error", str(path), *arguments]
        environment = {**os.environ, **environment}
        done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=120)
    elif ":" in name:
        done = warm_process.palpate(path, *arguments, folder=folder, environment=environment)
    else:
        done = warm_process.script(path, *arguments, folder=folder, environment=environment)
    assert done.returncode == 0, done.stderr
    return done.stdout


def numbers_after(words, text):
    """Return the number that follows some words, each time that they occur."""
    return [float(found) for found in re.findall(re.escape(words) + r"\s*(-?[\d.]+(?:e-?\d+)?)", text)]


LIMIT = math.inf
RUNS = (
    ("contact_from_wrench.py", (), ("noise is VALID", "10000 of 10000 found"), {"at most": [(0.0, 1e-15)]}),  # [m]
    ("own_controller.py", (), ("done",), {"felt": [(1.95, 2.05)], "+-": [(-LIMIT, 0.1)]}),
    ("own_controller.py", ("--force", "12"),
     ("stopped by the supervisor (contact force was 10.", "the robot is at rest"), {}),
    ("own_sensor.py", ("--force", "3"), ("OK: 3.00 N at x = 8.0 mm",), {}),
    ("calibrate_tip.py", (), ("OK: all assumptions were tested",),
     {"radius off by": [(-LIMIT, 5.0)], "centre off by": [(-LIMIT, 5.0)]}),  # [um]
    ("unknown_friction.py", ("--friction", "0.45"), ("; held",) * 2,
     {"found mu": [(0.4365, 0.4635)] * 2, "grip": [(1.0, 1.3), (1.3, LIMIT)]}),
    ("turn_in_hand.py", ("--angle", "10"), (), {"turned by": [(9.9, 10.1)], "in truth by": [(9.9, 10.1)]}),
    ("notebook.py", (), (), {"within": [(-LIMIT, 0.1)]}),
)  # fmt: skip
"""Example, options, texts in order, and bounds of the numbers after some words."""


@pytest.mark.slow
@pytest.mark.parametrize(("name", "options", "texts", "numbers"), RUNS, ids=lambda each: str(each)[:20])
def test_an_example_prints_what_its_text_claims(name, options, texts, numbers, tmp_path):
    said = printed_by(name, *options, folder=tmp_path)
    assert re.search(".*".join(map(re.escape, texts)), said, re.DOTALL)
    for words, bounds in numbers.items():
        found = numbers_after(words, said)
        assert len(found) == len(bounds)
        assert all(low < value < high for value, (low, high) in zip(found, bounds, strict=True)), (words, found)


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_each_is_short_says_what_it_shows_and_how_to_run_it_and_is_run_here(path):
    """An example that no test runs is one that will rot."""
    text = path.read_text(encoding="utf-8")
    said = ast.get_docstring(ast.parse(text))
    experiment, notebook = path.stem == "my_texture", path.stem == "notebook"
    assert 30 <= len(text.splitlines()) <= (100 if path.stem == "own_sensor" else 80 if experiment else 60)
    assert said.splitlines()[0].endswith(".")
    assert f"    {'palpate' if experiment else 'python'} examples/{path.name}" in said
    assert len(said.split("\n\n")) >= 3  # a title, what it is about, what one sees
    assert ('if __name__ == "__main__":' in text) is not (notebook or experiment)
    here = Path(__file__).read_text(encoding="utf-8")
    assert re.search(rf'(printed_by\(\s*|^    \()"{path.name}[":]', here, re.MULTILINE)


@pytest.mark.slow
def test_an_exploration_writes_what_it_says(tmp_path):
    said = printed_by(
        "explore_and_export.py", "--out", "found", "--width", "0.008", "--depth", "0.002", folder=tmp_path
    )
    for name in re.findall(
        r"`([a-z_]+\.(?:ply|csv|stl|html))`", (ROOT / "examples/explore_and_export.py").read_text()
    ):
        assert (tmp_path / "found" / name).stat().st_size > 100, name
    assert numbers_after("force error", said)[0] < 0.02
    assert "PrimitiveKind" not in said
    assert numbers_after("points", said)[0] < 2.0  # [um]
    assert float(re.search(r"([\d.]+) um from the true ellipsoid", said)[1]) < 5.0


@pytest.mark.wire
@pytest.mark.slow
def test_a_live_plot_shows_what_rolls_on_an_emulated_box(tmp_path):
    said = printed_by("live_netft.py", "--seconds", "1", folder=tmp_path)
    assert "last OK: 2.00 N" in said
    assert float(said.split()[0]) > 500  # records, of 1000 per second
    assert (tmp_path / "live_netft.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.wire
@pytest.mark.slow
def test_a_live_plot_tares_a_box_that_somebody_else_runs(tmp_path):
    """What hangs on the sensor from the beginning is no touch."""
    with EmulatorProcess(box_at_rest):
        said = printed_by("live_netft.py", "--seconds", "0.3", "--address", BOX, folder=tmp_path)
    assert "last NO_FORCE" in said


@pytest.mark.slow
@pytest.mark.parametrize(("falls", "count"), [("0.1", "one"), ("0", "several")])
def test_a_held_box_tells_where_and_at_how_many_places_it_touches(falls, count, tmp_path):
    said = printed_by("held_tool.py", "--table-falls", falls, folder=tmp_path)
    assert said.startswith(f"contacts: {count};")
    felt, true = (np.array(each.split(), float) for each in re.findall(r"\[([^\]]*)\]", said)[-2:])
    assert count == "several" or np.linalg.norm(felt - true) < 1.0  # [mm]


@pytest.mark.slow
def test_a_fingertip_of_ones_own_feels_where_it_is_touched(tmp_path):
    said = printed_by("own_fingertip.py", "--beside", "0.0", "0.01", folder=tmp_path)
    off = [float(number) for number in re.findall(r"(\d+) um off", said)]
    assert len(off) == 2
    assert max(off) <= 10.0  # [um], on a mesh that lies up to 4 um below the formula


@pytest.mark.slow
def test_a_replay_is_the_same_until_something_is_changed(tmp_path):
    said = printed_by("replay_study.py", folder=tmp_path)
    rows = [line.rsplit(maxsplit=3) for line in said.splitlines()[2:]]
    assert [row[1] for row in rows] == ["yes", "no", "no", "no", "no"]
    velocity, centroid = ([float(row[column]) for row in rows] for column in (2, 3))
    assert velocity[0] == centroid[0] == 0.0
    assert velocity[2] == pytest.approx(2.0 * velocity[1], rel=0.1)  # 1 N more against half a newton less
    # a tip taken for so much larger moves what it feels by as much
    assert centroid[3:] == [pytest.approx(0.4, abs=0.05), pytest.approx(0.8, abs=0.1)]


@pytest.mark.slow
def test_an_experiment_of_ones_own_feels_the_ripples(tmp_path):
    said = json.loads(printed_by("my_texture.py:Texture", "--ripple", "15e-6", "--json", folder=tmp_path))
    assert said["metrics"]["roughness_rms_um"] == pytest.approx(6.6 / 7.1 * 15.0 / math.sqrt(2.0), rel=0.1)


@pytest.mark.wire
@pytest.mark.slow
def test_the_emulated_robot_finds_what_the_simulated_one_does(tmp_path):
    robots = ("--robots", "ur5e-sim", unhurried_file(tmp_path, "127.0.0.79", scale=0.5))
    said = printed_by("sim_to_emulated.py", *robots, folder=tmp_path)
    assert said.count("done after") == 2
    assert numbers_after("radius", said) == [pytest.approx(40.0, abs=1.0)] * 2  # [mm]
    assert all(abs(force - 2.0) < 0.1 for force in numbers_after("felt", said))


@pytest.mark.slow
def test_the_whole_sweep_shows_what_its_text_claims_and_does_nothing_twice(tmp_path):
    assert "All 6 runs got to their end" in printed_by("sweep.py", folder=tmp_path)
    folder = tmp_path / "runs" / "example-sweep"
    assert (folder / "own.png").read_bytes().startswith(b"\x89PNG")
    kept = {path.name: path.stat().st_mtime_ns for path in (folder / "runs").iterdir()}
    printed_by("sweep.py", folder=tmp_path)
    assert {path.name: path.stat().st_mtime_ns for path in (folder / "runs").iterdir()} == kept
    with (folder / "runs.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    # error [N] of every run by speed [m/s] and stiffness [N/m]
    errors = {(float(r["surface_speed"]), float(r["assumed_stiffness"])): float(r["force_rms_n"]) for r in rows}
    assert len(errors) == 6
    slow, fast = ([errors[speed, stiffness] for stiffness in (10e3, 20e3, 40e3)] for speed in (0.01, 0.02))
    assert slow == sorted(slow)
    assert fast == sorted(fast)
    assert max(slow) < min(fast)


@pytest.mark.slow
def test_a_notebook_shows_what_stands_on_the_last_line_of_its_cells(monkeypatch):
    """As a notebook does: statements are executed, a last expression is shown as HTML or as a picture."""
    monkeypatch.setenv("MPLBACKEND", "Agg")
    names, shown = {}, []
    text = (ROOT / "examples" / "notebook.py").read_text(encoding="utf-8")
    for cell in re.split(r"^# %%.*\n", text, flags=re.MULTILINE)[1:]:
        *body, last = ast.parse(cell).body
        if isinstance(last, ast.Expr):
            exec(compile(ast.Module(body, []), "cell", "exec"), names)
            shown.append(eval(compile(ast.Expression(last.value), "cell", "eval"), names))
        else:
            exec(compile(ast.Module([*body, last], []), "cell", "exec"), names)
    _, contact, exploration, figure, _ = shown
    assert "<td>mN m</td>" in contact._repr_html_()
    html = exploration._repr_html_()
    assert html.count("<img") == 1
    assert "force" in html
    assert figure.axes
    names["plt"].close("all")


def test_the_notebook_for_jupyter_and_colab_is_that_of_the_script():
    """`python docs/make_notebook.py` makes it anew."""
    made = load_module(ROOT / "docs" / "make_notebook.py").notebook
    script = ROOT / "examples" / "notebook.py"
    assert script.with_suffix(".ipynb").read_text("utf-8") == made(script.read_text("utf-8"))


def test_a_page_has_the_text_and_the_code_and_no_page_is_left_of_what_is_gone(tmp_path):
    write_pages = load_module(ROOT / "docs" / "example_pages.py").write_pages
    (tmp_path / "gone.md").write_text("# Gone\n")
    pages = write_pages(ROOT / "examples", tmp_path)
    assert [page.stem for page in pages] == [path.stem for path in EXAMPLES]
    index = (ROOT / "docs" / "examples.md").read_text(encoding="utf-8")
    assert sorted(re.findall(r"\(\.\./examples/(\w+\.py)\)", index)) == [path.name for path in EXAMPLES]
    assert not (tmp_path / "gone.md").exists()
    for page, script in zip(pages, EXAMPLES, strict=True):
        text = page.read_text(encoding="utf-8")
        said = ast.get_docstring(ast.parse(script.read_text(encoding="utf-8")))
        assert text.startswith(f"# {said.splitlines()[0][:-1]}\n")
        assert said.splitlines()[-1] in text
        (included,) = re.findall(r"\{literalinclude\} (\S+)", text)
        assert (tmp_path / included).resolve() == script
        (first,) = re.findall(r":lines: (\d+)-", text)
        code = script.read_text(encoding="utf-8").splitlines()[int(first) - 1 :]
        assert code[0].startswith(("import", "from", "#"))  # the docstring is not shown twice
    before = [page.stat().st_mtime_ns for page in pages]
    write_pages(ROOT / "examples", tmp_path)
    assert [page.stat().st_mtime_ns for page in pages] == before
