"""Physics runs whatever MUJOCO_GL says, and who wants pictures is told what is missing."""

import os
import subprocess
import sys

import pytest

from palpate.sim.headless import importable

SCRIPT = """
import os
import palpate.sim
from palpate.sim.render.gl import NoRendererError, offscreen_context
print(os.environ["MUJOCO_GL"])
try:
    offscreen_context(16, 16)
except NoRendererError as error:
    print(error)
"""


@pytest.mark.slow
@pytest.mark.parametrize("asked", ["nonsense", "osmesa", "egl"])
def test_a_platform_that_is_not_there_stops_nobody_but_who_wants_pictures(asked):
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], env={**os.environ, "MUJOCO_GL": asked}, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    said, *refused = done.stdout.splitlines()
    assert said == asked
    assert not refused or "no off-screen rendering" in refused[0]


def test_what_mujoco_takes_is_left_to_it():
    assert importable("")
    assert importable("disable")
    assert importable("GLFW")
    assert not importable("nonsense")
