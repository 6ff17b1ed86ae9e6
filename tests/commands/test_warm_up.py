"""`palpate warm-up`: what it says, how it ends, and that after it nothing is left to compile."""

import json
import os
import signal
import subprocess
import sys

import numpy as np
import pytest

from palpate.cli import main
from palpate.commands.command_result import ExitCode
from palpate.commands.contact.config import FINGERTIPS
from palpate.commands.warm_up import command
from palpate.commands.warm_up.steps import steps
from support.cli_samples import WRENCHES

FAKE = """
import json, pathlib, sys
print(json.dumps(dict(step="a thing", number=1, of=1)), flush=True)
{then}
"""

DONE = """
kernels = pathlib.Path({kernels!r})
kernels.mkdir(parents=True, exist_ok=True)
(kernels / "made.nbi").touch()
print(json.dumps(dict(compiled=["one", "two"], folders=[str(kernels)] * {kept})), flush=True)
"""


@pytest.fixture
def pretend(tmp_path, monkeypatch):
    """Let something else than all of palpate be compiled; returns what sets it, and where kernels are kept."""
    kernels = tmp_path / "kernels"
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(kernels))
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setattr(command, "STEPS", "fake_steps")

    def pretended(then=DONE, kept=1):
        then = then.format(kernels=str(kernels), kept=kept)
        (tmp_path / "fake_steps.py").write_text(FAKE.format(then=then))
        return kernels

    return pretended


def document(capsys):
    return json.loads(capsys.readouterr().out)


def test_run_again_it_has_nothing_to_compile_until_something_is_gone(pretend, capsys):
    kernels = pretend()
    assert main(["warm-up", "--json"]) == 0
    found = document(capsys)
    assert (found["metrics"]["compiled"], found["functions"]) == (2, ["one", "two"])
    assert main(["warm-up", "--json"]) == 0
    found = document(capsys)
    assert found["metrics"]["compiled"] == 0
    assert found["outcome"].startswith("Nothing to compile; kept in ")
    (kernels / "made.nbi").unlink()
    assert main(["warm-up", "--json"]) == 0
    assert document(capsys)["metrics"]["compiled"] == 2


def test_a_folder_that_numba_passed_over_is_told(pretend, capsys, monkeypatch):
    pretend()
    monkeypatch.setenv("NUMBA_CACHE_DIR", "/dev/null/kernels")
    assert main(["warm-up", "--json"]) == ExitCode.UNFINISHED
    assert "NUMBA_CACHE_DIR = /dev/null/kernels cannot be written" in document(capsys)["warnings"][0]


@pytest.mark.slow
def test_every_step_has_a_name_of_its_own():
    names = [name for name, _ in steps()]
    assert len(set(names)) == len(names) > 15


@pytest.mark.slow
def test_ctrl_c_ends_it_at_once_and_what_is_compiled_by_then_is_kept(tmp_path):
    """In the middle of the first kernel, of which numba would hear only when it is done."""
    process = subprocess.Popen(
        [sys.executable, "-m", "palpate", "warm-up"],
        env=os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "numba"), "XDG_CACHE_HOME": str(tmp_path)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    assert process.stdout.readline().startswith("1 of ")
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert process.returncode == ExitCode.INTERRUPTED
    assert "2 of " not in out
    assert err == f"palpate: {command.INTERRUPTED}\n"


HEARD = """
import sys
from numba.core import event
compiled = []
class Hears(event.Listener):
    def on_start(self, event): compiled.append(event.data["dispatcher"].py_func.__qualname__)
    def on_end(self, event): pass
event.register("numba:compile", Hears())
from palpate.__main__ import main
for command in sys.argv[1:]:
    sys.argv = ["palpate", *command.split()]
    code = main()
    assert code == 0 and not compiled, (command, code, compiled)
"""
"""Carries out commands one after the other, until one fails or compiles something."""

SMALL = "--width 0.01 --depth 0.004 --speed 0.05"

TIPS = {
    "sphere": "0.01",
    "ellipsoid": "0.01 0.012 0.008",
    "cylinder": "0.01",
    "plane": "0.01",
    "paraboloid": "0.01 0.012",
    "capsule": "0.01 0.03",
    "box": "0.01 0.01 0.01 0.003",
    "superellipsoid": "0.01 0.012 0.008 4",
    "mesh": "tip.off",
}

AFTERWARDS = (
    f"explore {SMALL} --out explored",
    f"explore {SMALL} --object torus --out ring",
    f"explore {SMALL} --object bumps --out waves",
    f"explore {SMALL} --object mesh --file part.stl --out part",
    f"explore {SMALL} --object height-field --file heights.csv --size 0.1 0.1 --out heights",
    f"explore {SMALL} --robot ur5e-nano17 --out arm",
    "replay explored",
    "compare explored/contacts.csv explored/map.stl --samples 200",
    "view explored --picture explored.png",
    "regulate --duration 0.5 --out held",
    "regulate --duration 0.5 --robot turning-stage-nano17 --out turned",
    "friction --quick --out rubbed",
    "grasp --load none --rise 0.1 --lift-height 0.01 --out two",
    "grasp --out three --fingers 3 --object cylinder --known estimated",
    "view two --picture two.png",
    *(f"contact wrenches.csv --{name} {TIPS[name]}" for name in FINGERTIPS),
    "contact wrenches.csv --mesh tip.off --model hard",
)


@pytest.mark.slow
def test_after_it_nothing_is_compiled(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    trimesh.creation.icosphere(2, 0.01).export(tmp_path / "tip.off")
    trimesh.creation.icosphere(2, 0.04).export(tmp_path / "part.stl")
    along = np.linspace(-0.05, 0.05, 21)
    np.savetxt(tmp_path / "heights.csv", 0.003 * np.outer(np.sin(40 * along), np.cos(40 * along)), delimiter=",")
    (tmp_path / "wrenches.csv").write_text(WRENCHES)
    environment = os.environ | {
        "NUMBA_CACHE_DIR": str(tmp_path / "numba"),
        "XDG_CACHE_HOME": str(tmp_path),
    }

    def run(*words):
        done = subprocess.run(
            [sys.executable, *words], cwd=tmp_path, env=environment, capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr
        return done

    assert json.loads(run("-m", "palpate", "warm-up", "--json").stdout)["metrics"]["compiled"] > 20
    assert "palpate: compiling" not in run("-c", HEARD, "warm-up", *AFTERWARDS).stderr


@pytest.mark.parametrize(
    ("then", "kept", "message"),
    [
        (DONE, 0, "set NUMBA_CACHE_DIR"),
        ("raise OSError('No space left on device')", 1, "No space left on device"),
    ],
)
def test_what_cannot_be_compiled_or_kept_is_named_every_time(then, kept, message, pretend, capsys):
    pretend(then, kept)
    for _ in range(2):
        assert main(["warm-up", "--json"]) == ExitCode.UNFINISHED
        assert message in capsys.readouterr().out
