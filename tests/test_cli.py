"""The command line as a newcomer types it, mistakes included."""

import re
import subprocess
import sys
import time

import pytest

from palpate import __version__
from palpate.cli import MISTAKE, main

SMALL = ["--width", "0.01", "--depth", "0.004", "--speed", "0.05"]


def run(*arguments):
    return subprocess.run(
        [sys.executable, "-m", "palpate", *arguments], capture_output=True, text=True, timeout=120
    )


def test_exploration_leaves_its_files_and_says_where(tmp_path):
    done = run("explore", *SMALL, "--out", str(tmp_path / "new" / "folder"))
    assert done.returncode == 0, done.stderr
    names = {path.name for path in (tmp_path / "new" / "folder").iterdir()}
    assert names == {"report.html", "contacts.ply", "contacts.csv", "height_map.ply", "height_map.csv"}
    assert "report.html" in done.stdout
    assert "\x1b[" not in done.stdout, "colours in a pipe"


def test_the_same_seed_gives_the_same_points(tmp_path):
    noisy = [*SMALL, "--force-noise", "0.01", "--moment-noise", "1e-4"]
    for name, seed in (("a", "1"), ("b", "1"), ("c", "2")):
        assert main(["explore", *noisy, "--seed", seed, "--out", str(tmp_path / name)]) == 0
    a, b, c = ((tmp_path / name / "contacts.csv").read_bytes() for name in "abc")
    assert a == b
    assert a != c


def test_help_explains_the_command_and_its_units():
    done = run("explore", "--help")
    assert done.returncode == 0
    for word in ("[N]", "[m/s]", "Example:", "--object", "sphere"):
        assert word in done.stdout


def test_version():
    assert run("--version").stdout.strip() == f"palpate {__version__}"


def test_help_does_not_load_the_simulator():
    """Heavy imports wait until something runs."""
    code = (
        "import sys, palpate.cli\n"
        "try: palpate.cli.main(['explore', '--help'])\n"
        "except SystemExit: pass\n"
        "heavy = {'mujoco', 'numba', 'matplotlib', 'scipy'} & set(sys.modules)\n"
        "sys.exit(', '.join(sorted(heavy)) or 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--speed", "20"], ["speed = 20 m/s", "0.1 m/s", "for 20 mm/s give 0.02"]),
        (["--speed", "0"], ["speed = 0 m/s"]),
        (["--force", "-2"], ["force = -2 N", "between 0.3 and 15 N"]),
        (["--force", "nan"], ["force = nan N"]),
        (["--force", "100"], ["force = 100 N"]),
        (["--force", "0.5", "--force-noise", "0.1"], ["force = 0.5 N", "with a force noise of 0.1 N"]),
        (["--object", "ellipsoid", "--size", "0.05"], ["takes 3 numbers", "three semi-axes", "0.05 0.04 0.03"]),
        (["--size", "-0.04"], ["size = -0.04 m"]),
        (["--tip", "0.008", "0.01"], ["tip = 0.008 0.01", "one number", "three"]),
        (["--tip", "1e-6"], ["tip = 1e-06 m", "compression"]),
        (["--width", "0.2"], ["0.2 x 0.04 m", "at most", "--size"]),
        (["--spacing", "0.1"], ["raster spacing = 0.1 m", "depth = 0.04 m"]),
        (["--friction", "0"], ["friction = 0"]),
        (["--stiffness", "1e6"], ["stiffness = 1e+06 N/m", "at most 120000 N/m", "time step"]),
        (["--friction", "0.005"], ["friction = 0.005", "at least 0.01"]),
        (["--seed", "-1"], ["seed = -1"]),
        (["--period", "0.5"], ["period = 0.5 s", "0.008 s"]),
        (["--spacing", "1e-5"], ["spacing = 1e-05 m", "rows at least"]),
        (["--speed", "1e-4"], ["speed = 0.0001 m/s", "creeps"]),
        (["--period", "0.0003"], ["period = 0.0003 s", "whole number of time steps"]),
    ],
)
def test_wrong_values_are_named_with_what_would_be_right(arguments, words, capsys, tmp_path):
    try:
        code = main(["explore", *arguments, "--out", str(tmp_path / "run")])
    except SystemExit as stop:  # found while the command line was read
        code = stop.code
    assert code == MISTAKE
    said = " ".join(re.sub("[│╭╮╰╯─]", " ", capsys.readouterr().err).split())
    for word in words:
        assert word in said
    assert "Traceback" not in said
    assert not (tmp_path / "run").exists(), "nothing half written"


def test_nothing_typed_shows_the_help(capsys):
    with pytest.raises(SystemExit) as stop:
        main([])
    assert stop.value.code == 0
    assert "explore" in capsys.readouterr().out


@pytest.mark.parametrize("arguments", [["explore", "--object", "cube"], ["explore", "--sped", "1"], ["explor"]])
def test_misspelt_words_are_refused_with_the_alternatives(arguments):
    done = run(*arguments)
    assert done.returncode == MISTAKE
    assert any(word in done.stderr + done.stdout for word in ("sphere", "--speed", "explore"))


def test_a_folder_that_cannot_be_made_is_named(tmp_path, capsys):
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    started = time.monotonic()
    assert main(["explore", "--out", str(blocked)]) == MISTAKE
    assert str(blocked) in capsys.readouterr().err
    assert time.monotonic() - started < 5.0, "found out only after the exploration"
