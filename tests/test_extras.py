"""What needs a library that is not installed says so before anything moves, and how to install it."""

import re
import subprocess
import sys
from importlib.metadata import requires

import pytest

from palpate.errors import InvalidValueError
from palpate.extras import MissingLibraryError, require
from palpate.robots.named_description import described_path
from palpate.robots.robot import load_robot


def python(program: str, *typed: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", program, *typed]
    return subprocess.run(command, capture_output=True, text=True, timeout=120)


def palpate_without(library: str, *typed: str) -> subprocess.CompletedProcess[str]:
    """Type a command where a library is not installed."""
    run = "sys.argv = ['palpate', *sys.argv[1:]]; from palpate.__main__ import main; sys.exit(main())"
    return python(f"import sys; sys.modules[{library!r}] = None; {run}", *typed)


def test_what_is_missing_is_named_with_its_remedy():
    with pytest.raises(
        MissingLibraryError, match=r'a thing needs no_such_library.*pip install "palpate\[parquet\]"'
    ) as told:
        require("no_such_library", "parquet", "a thing")
    assert told.value.name == "no_such_library"


@pytest.mark.slow
def test_a_command_that_needs_it_is_a_mistake_and_leaves_nothing(tmp_path):
    out = tmp_path / "out"
    typed = ["sweep", "explore", "--vary", "force=1,2", "--ray", "local", "--out", str(out)]
    done = palpate_without("ray", *typed)
    assert done.returncode == 2, done.stderr
    assert "needs ray, which is not installed" in done.stderr
    assert 'pip install "palpate[cluster]"' in done.stderr
    assert "Traceback" not in done.stderr
    assert not out.exists()
    brought = [each for each in requires("palpate") or () if re.search("extra == .cluster.", each)]
    assert any(each.startswith("ray") for each in brought), brought


@pytest.mark.slow
@pytest.mark.parametrize("typed", [["explore", "--robot", "emulated-ur5e"], ["grasp", "--robot", "emulated-hand"]])
def test_only_a_ur_needs_the_library_of_its_maker(tmp_path, typed):
    """One line, before anything starts, and nothing is left."""
    out = tmp_path / "out"
    done = palpate_without("rtde_control", *typed, "--out", str(out))
    assert done.returncode == 2, done.stderr
    *before, line = done.stderr.splitlines()
    assert line.startswith(
        "palpate: a UR arm needs ur_rtde, which exists for CPython 3.11 and 3.12 on Linux x86-64"
    )
    assert "python3.12 -m venv" in line
    assert all(each.startswith("palpate: compiling") for each in before)  # after an update, say
    assert not out.exists()


@pytest.mark.slow
def test_without_the_library_of_a_ur_all_else_imports():
    program = (
        "import sys, pkgutil\n"
        "sys.modules.update(rtde_control=None, rtde_receive=None, rtde_io=None)\n"
        "import palpate\n"
        "for module in pkgutil.walk_packages(palpate.__path__, 'palpate.'):\n"
        "    if module.name != 'palpate.__main__': __import__(module.name)"
    )
    done = python(program)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("found", ["'3.17.0'", "'5.0.0'", "None"])
def test_another_mujoco_than_asked_for_is_refused_by_name(found):
    """Two packages fill its folder, and pip sees no conflict: what was imported is asked."""
    done = python(f"import mujoco; mujoco.__version__ = {found}; import palpate.sim")
    assert done.returncode == 1
    assert "palpate.sim needs MuJoCo 4.x" in done.stderr.splitlines()[-1]
    assert 'pip install "mujoco>=4,<5"' in done.stderr


# --- Robots by their names in `robot_descriptions`, a small stand-in of which is put on the path here ---


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
        ("panda_mj_description", r"is not installed; `pip install robot_descriptions`, or give"),
    ],
)
def test_a_missing_description_is_refused_in_one_line(descriptions, name, message, monkeypatch):
    if "not installed" in message:
        monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(InvalidValueError, match=f"^robot_descriptions:{name}: .*{message}") as refused:
        described_path(f"robot_descriptions:{name}")
    assert "\n" not in str(refused.value)
