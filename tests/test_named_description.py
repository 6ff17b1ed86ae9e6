"""Robots by their names in `robot_descriptions`, a small stand-in of which is put on the path here."""

import sys

import pytest

from palpate.errors import InvalidValueError
from palpate.robots.named_description import described_path
from palpate.robots.robot import load_robot

ROBOT = """
palpate_robot: 1
name: by name
backend: {kind: urdf, file: "robot_descriptions:arm_description", flange: flange}
period_s: 0.001
fingers: [{surface: {kind: sphere, radius_m: 0.008}, payload: {mass_kg: 0.03}}]
limits: {force_N: 20}
"""


@pytest.fixture
def descriptions(tmp_path, monkeypatch):
    folder = tmp_path / "robot_descriptions"
    folder.mkdir()
    (folder / "__init__.py").write_text("")
    (folder / "arm_description.py").write_text(f"print('Cloning')\nURDF_PATH = {str(tmp_path / 'arm.urdf')!r}")
    (folder / "far_description.py").write_text("raise OSError('no route to host\\nat all')")
    (folder / "odd_description.py").write_text("XACRO_PATH = 'arm.xacro'")
    (tmp_path / "arm.urdf").write_text("<robot name='r'/>")
    monkeypatch.syspath_prepend(tmp_path)
    yield tmp_path
    for name in [each for each in sys.modules if each.split(".")[0] == "robot_descriptions"]:
        del sys.modules[name]


def test_a_robot_file_names_an_arm_that_is_installed(descriptions, capsys):
    (descriptions / "robot.yaml").write_text(ROBOT)
    texts = load_robot(str(descriptions / "robot.yaml")).texts
    assert texts["arm.xml"] == "<robot name='r'/>"
    assert texts["arm.xml.path"] == str((descriptions / "arm.urdf").resolve())
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("am_description", "has no such robot; did you mean arm_description?"),
        ("far_description", "cannot load it: no route to host; run .* pull far_description"),
        ("odd_description", "has no MJCF_PATH or URDF_PATH; give"),
    ],
)
def test_what_it_does_not_have_is_refused_in_one_line(descriptions, name, message):
    with pytest.raises(InvalidValueError, match=f"^robot_descriptions:{name}: .*{message}") as refused:
        described_path(f"robot_descriptions:{name}")
    assert "\n" not in str(refused.value)


def test_it_need_not_be_installed(monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(InvalidValueError, match=r"is not installed; `pip install robot_descriptions`, or give"):
        described_path("robot_descriptions:panda_mj_description")
