"""`palpate compare` as people type it."""

import json

import numpy as np
import pytest
import trimesh

from palpate.cli import main
from palpate.commands.command_result import ExitCode
from palpate.mapping import TouchCloud, write_cloud_csv, write_cloud_ply


@pytest.fixture
def folder(tmp_path):
    """A ball of 20 mm in metres and millimetres, and its upper half felt 0.1 mm too far out."""
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.02)
    ball.export(tmp_path / "ball.stl")
    upper = ball.vertices[ball.vertices[:, 2] > 0.0] / 0.02
    n = len(upper)
    zero = np.zeros((n, 3))
    cloud = TouchCloud(np.arange(n) * 1e-3, 0.0201 * upper, upper, np.ones(n), zero, np.zeros(n))
    write_cloud_ply(cloud, tmp_path / "contacts.ply")
    write_cloud_csv(cloud, tmp_path / "contacts.csv")
    ball.apply_scale(1e3)
    ball.export(tmp_path / "ball_mm.stl")
    return tmp_path


@pytest.mark.slow
@pytest.mark.parametrize("name", ["contacts.ply", "contacts.csv"])
def test_a_cloud_against_a_mesh(folder, name, capsys):
    out = folder / "new" / "out"
    words = [
        "compare",
        str(folder / name),
        str(folder / "ball_mm.stl"),
        "--reference-unit",
        "mm",
        "--out",
        str(out),
    ]
    assert main(words) == 0
    said = capsys.readouterr().out
    assert "reference covered" in said
    found = json.loads((out / "compare.json").read_text())
    assert found["map_to_reference_m"]["rms"] == pytest.approx(1e-4, abs=2e-6)
    assert found["bias_m"] == pytest.approx(1e-4, abs=2e-6)
    assert found["coverage"] == pytest.approx(0.5, abs=0.03)
    assert found["normal_error_rad"]["rms"] < 0.01
    assert found["alignment"] is None
    page = (out / "compare.html").read_text()
    assert "http" not in page.replace("http://www.w3.org", "")
    assert "The map was compared where it is." in page


def test_alignment_is_said(folder, capsys):
    words = ["compare", str(folder / "contacts.ply"), str(folder / "ball.stl"), "--align"]
    assert main(words) == 0
    assert "map was moved by" in capsys.readouterr().out
    assert "first moved onto the reference" in (folder / "compare.html").read_text()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["contacts.ply", "ball_mm.stl"], "add --reference-unit mm"),
        (["contacts.ply", "contacts.ply"], "has no triangles"),
        (["none.ply", "ball.stl"], "none.ply"),
    ],
)
def test_mistakes_are_said_in_one_line(folder, words, said, capsys):
    assert main(["compare", *(str(folder / word) for word in words)]) == ExitCode.MISTAKE
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
