"""What needs a library that is not installed says so before anything moves, and how to install it."""

import re
import subprocess
import sys
from importlib.metadata import requires

import pytest

from palpate.extras import MissingLibraryError, require


def python_without(library: str, program: str, *typed: str) -> subprocess.CompletedProcess[str]:
    """Run a program where a library is not installed."""
    return subprocess.run(
        [sys.executable, "-c", f"import sys; sys.modules[{library!r}] = None; {program}", *typed],
        capture_output=True,
        text=True,
        timeout=120,
    )


def palpate_without(library: str, *typed: str) -> subprocess.CompletedProcess[str]:
    """Type a command where a library is not installed."""
    run = "sys.argv = ['palpate', *sys.argv[1:]]; from palpate.__main__ import main; sys.exit(main())"
    return python_without(library, run, *typed)


def test_what_is_missing_is_named_with_its_remedy():
    with pytest.raises(
        MissingLibraryError, match=r'a thing needs no_such_library.*pip install "palpate\[parquet\]"'
    ) as told:
        require("no_such_library", "parquet", "a thing")
    assert told.value.name == "no_such_library"


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
        "import pkgutil, palpate\n"
        "for module in pkgutil.walk_packages(palpate.__path__, 'palpate.'):\n"
        "    if module.name != 'palpate.__main__': __import__(module.name)"
    )
    done = python_without("rtde_control", f"sys.modules.update(rtde_receive=None, rtde_io=None)\n{program}")
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("found", ["'3.17.0'", "'5.0.0'", "None"])
def test_another_mujoco_than_asked_for_is_refused_by_name(found):
    """Two packages fill its folder, and pip sees no conflict: what was imported is asked."""
    program = f"import mujoco; mujoco.__version__ = {found}; import palpate.sim"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120)
    assert done.returncode == 1
    assert "palpate.sim needs MuJoCo 4.x" in done.stderr.splitlines()[-1]
    assert 'pip install "mujoco>=4,<5"' in done.stderr
