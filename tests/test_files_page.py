"""The page that documents every file has just the columns that runs write."""

import csv
import itertools
import json
import re
from functools import cache

import numpy as np
import pytest
import trimesh
import yaml

from palpate.cli import main
from palpate.experiments.kit.registry import experiment_named, experiment_names
from support.document_blocks import DOCS

ESTIMATE = {"value", "lower", "upper", "how"}
"""Keys of an estimate, which the page documents once."""

NOT_HERE = {
    "grasp.csv": {"felt_grip_N"},  # on a robot
    "period": {r"arm_joint_position_\w+", r"arm_tip_force_(x|y|z)_N", r"command_finger_velocity_\w+(x|y|z)_m/s"}
    | {"command_finger_velocity_count"},  # of other robots
}
"""What is documented of a file and not in that of the runs here."""


@cache
def documented():
    """Every section's columns, as patterns."""
    sections = re.split(r"^#+ (.+)$", (DOCS / "files.md").read_text(encoding="utf-8"), flags=re.MULTILINE)
    found = {}
    for name, text in zip(sections[1::2], sections[2::2], strict=True):
        rows = re.findall(r"^\| `([^`]+)` \|", text, flags=re.MULTILINE)
        found[name] = {pattern(row) for row in rows}
    return found


def pattern(name):
    parts = re.split(r"(\{[^}]*\}|<\w+>)", name)
    return "".join(
        f"({part[1:-1].replace(',', '|')})" if part[:1] == "{" else r"\w+" if part[:1] == "<" else re.escape(part)
        for part in parts
    )


def header(path):
    with path.open(newline="", encoding="utf-8") as file:
        return set(next(csv.reader(file)))


def agree(name, columns):
    """Every column is documented, and every documented one is there."""
    patterns = documented()[name]
    assert not {each for each in columns if not any(re.fullmatch(p, each) for p in patterns)}
    unused = {p for p in patterns if not any(re.fullmatch(p, each) for each in columns)}
    assert unused <= NOT_HERE.get(name, set())


def keys(value, prefix=""):
    """Dotted keys of a mapping; those of an estimate are none."""
    if isinstance(value, list) and value:
        return set(itertools.chain.from_iterable(keys(each, f"{prefix.removesuffix('.')}[].") for each in value))
    if not isinstance(value, dict) or set(value) == ESTIMATE:
        return {prefix.removesuffix(".")}
    return set(itertools.chain.from_iterable(keys(each, f"{prefix}{key}.") for key, each in value.items()))


def done(folder, words):
    assert main([*words.split(), "--out", str(folder)]) == 0
    return folder


@pytest.mark.slow
def test_explore_writes_what_the_page_says(tmp_path):
    out = done(tmp_path, "explore --width 0.02 --depth 0.004 --force-swing 0.5")
    for name in ("contacts.csv", "marks.csv", "height_map.csv"):
        agree(name, header(out / name))
    for name in ("map.ply", "contacts.ply"):
        head = (out / name).read_bytes().partition(b"end_header")[0].decode("ascii")
        agree(name, set(re.findall(r"^property .*?(\w+)$", head, flags=re.MULTILINE)))
    mesh = trimesh.load(out / "map.ply", process=False)
    band = np.ravel(mesh.metadata["_ply_raw"]["vertex"]["data"]["band"])
    assert 1e-7 < np.median(band) < 1e-4  # metres


@pytest.mark.slow
def test_the_other_experiments_write_what_the_page_says(tmp_path):
    agree("forces.csv", header(done(tmp_path / "r", "regulate --duration 0.2") / "forces.csv"))
    rubbed = done(tmp_path / "f", "friction") / "friction.yaml"
    agree("friction.yaml", keys(yaml.safe_load(rubbed.read_text(encoding="utf-8"))))
    grasp = done(tmp_path / "g", "grasp")
    agree("grasp.csv", header(grasp / "grasp.csv"))
    tables = done(tmp_path / "tables", f"log export {grasp}")
    for name in ("period", "event", "parameter"):
        agree(name, header(tables / f"{name}.csv"))


@pytest.mark.slow
def test_a_sweep_and_its_data_set_have_what_the_page_says(tmp_path):
    out = done(tmp_path / "s", "sweep regulate --set duration=0.2 --keep-reports --jobs 1")
    experiment = experiment_named("regulate")
    metrics = {metric.key for metric in experiment.metrics}
    agree("runs.csv", header(out / "runs.csv") - metrics)
    agree("sweep.json", set(json.loads((out / "sweep.json").read_text())))
    agree("runs/NNNNNN.json", set(json.loads((out / "runs/000000.json").read_text())))
    columns = header(done(tmp_path / "d", f"log export {out}") / "episodes.csv")
    agree("episodes", columns - metrics - set(experiment.Config.__dataclass_fields__))


@pytest.mark.slow
def test_contact_and_compare_write_what_the_page_says(tmp_path):
    (tmp_path / "w.csv").write_text("fx,fy,fz,mx,my,mz\n0.3,0.1,-2.0,0.004,0.008,0.001\n")
    noise = "--force-noise 0.01 --moment-noise 1e-4"
    agree(
        "contacts of palpate contact",
        header(done(tmp_path / "c.csv", f"contact {tmp_path}/w.csv --sphere 0.02 {noise}")),
    )
    ball = trimesh.creation.icosphere(radius=0.02)
    for name in ("a.stl", "b.stl"):
        ball.export(tmp_path / name)
    done(tmp_path / "k", f"compare {tmp_path}/a.stl {tmp_path}/b.stl")
    agree("compare.json", set(json.loads((tmp_path / "k/compare.json").read_text())))


@pytest.mark.parametrize("name", experiment_names()[:5])
def test_every_figure_is_there(name):
    page = (DOCS / "files.md").read_text(encoding="utf-8")
    for metric in experiment_named(name).metrics:
        assert f"| `{metric.key}` | {metric.unit or '-'} | {metric.meaning} |" in page
    agree(f"Metrics of {name}", {metric.key for metric in experiment_named(name).metrics})
