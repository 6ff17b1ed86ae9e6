"""What needs a library that is not installed says so before anything moves, and how to install it."""

import re
import subprocess
import sys
from importlib.metadata import requires

import pytest

from palpate.extras import MissingLibraryError, require


def palpate_without(library: str, *typed: str) -> subprocess.CompletedProcess[str]:
    """Type a command where a library is not installed."""
    program = (
        f"import sys; sys.modules[{library!r}] = None; sys.argv = ['palpate', *sys.argv[1:]]; "
        "from palpate.__main__ import main; sys.exit(main())"
    )
    return subprocess.run([sys.executable, "-c", program, *typed], capture_output=True, text=True, timeout=120)


def test_what_is_there_is_not_refused():
    require("numpy", "grasp", "nothing")


def test_what_is_missing_is_named_with_its_remedy():
    with pytest.raises(
        MissingLibraryError, match=r'a thing needs no_such_library.*pip install "palpate\[grasp\]"'
    ) as told:
        require("no_such_library", "grasp", "a thing")
    assert told.value.name == "no_such_library"


@pytest.mark.parametrize(
    ("library", "extra", "typed"),
    [
        ("casadi", "grasp", ["grasp"]),
        ("casadi", "grasp", ["grasp", "--dry-run"]),
        ("casadi", "grasp", ["bench", "grasp", "--quick"]),
        ("casadi", "grasp", ["sweep", "grasp", "--vary", "mass=0.1,0.2"]),
        ("ray", "cluster", ["sweep", "explore", "--vary", "force=1,2", "--ray", "local"]),
    ],
)
def test_a_command_that_needs_it_is_a_mistake_and_leaves_nothing(tmp_path, library, extra, typed):
    out = tmp_path / "out"
    done = palpate_without(library, *typed, "--out", str(out))
    assert done.returncode == 2, done.stderr
    assert f"needs {library}, which is not installed" in done.stderr
    assert f'pip install "palpate[{extra}]"' in done.stderr
    assert "Traceback" not in done.stderr
    assert not out.exists()
    brought = [each for each in requires("palpate") or () if re.search(f"extra == .{extra}.", each)]
    assert any(each.startswith(library) for each in brought), brought


def test_all_studies_but_the_one_that_needs_it_can_be_named(tmp_path):
    done = palpate_without("casadi", "bench", "--out", str(tmp_path / "out"))
    assert done.returncode == 2, done.stderr
    others = "palpate bench contact mapping friction control simulation"
    assert done.stderr.splitlines()[-1].endswith(f'pip install "palpate[grasp]", or name the others: {others}')


def test_feeling_needs_no_grasps_and_pictures_say_what_they_need(tmp_path):
    small = ["--width", "0.01", "--depth", "0.004", "--speed", "0.05", "--out", str(tmp_path)]
    done = palpate_without("casadi", "explore", *small)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "report.html").exists()
    done = palpate_without("OpenGL", "view", str(tmp_path), "--picture", str(tmp_path / "still.png"))
    assert done.returncode == 2, done.stderr
    assert 'needs OpenGL, which is not installed: pip install "palpate[render]"' in done.stderr
    assert not (tmp_path / "still.png").exists()
