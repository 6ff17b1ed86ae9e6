"""A scene holds only its parts, stands above the floor, and runs without a display."""

import os
import subprocess
import sys

import mujoco
import pytest

from palpate.sim import ArmCarrier, ContactLaw, SphereObject, Stage, Tip, build_scene
from palpate.sim.headless import importable
from palpate.sim.scene_cost import scene_cost
from palpate.surfaces import Sphere


@pytest.mark.parametrize(("carrier", "bodies", "dofs", "geoms"), [(Stage(), 3, 3, 2), (ArmCarrier(), 10, 6, 8)])
def test_a_scene_has_what_it_names_and_one_pair(carrier, bodies, dofs, geoms):
    scene = build_scene(Tip(Sphere(0.008)), SphereObject(0.04), ContactLaw(), (0.0, 0.0, 0.06), carrier)
    cost = scene_cost(scene.model)
    assert (cost.bodies, cost.dofs, cost.geoms, cost.pairs) == (bodies, dofs, geoms, 1)
    assert cost.step_time > 0.0
    assert f"{dofs} degrees of freedom" in str(cost)
    # nothing collides but the pair
    assert not scene.model.geom_contype.any()
    assert not scene.model.geom_conaffinity.any()


@pytest.mark.parametrize("start", [(0.0, 0.0, 0.06), (0.02, -0.02, 0.05), (-0.05, 0.05, 0.1), (0.2, 0.1, 0.2)])
def test_no_link_is_below_the_floor(start):
    scene = build_scene(Tip(Sphere(0.008)), SphereObject(0.04), ContactLaw(), start, ArmCarrier())
    data = mujoco.MjData(scene.model)
    mujoco.mj_kinematics(scene.model, data)
    links = [scene.model.body(scene.model.jnt_bodyid[joint]).name for joint in range(6)]
    heights = {name: float(data.xpos[scene.model.body(name).id, 2]) for name in links}
    assert min(heights.values()) > 0.0, heights
    assert heights["arm/upper_arm"] > 0.3  # its frame is at its far end: the elbow


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
def test_a_missing_graphics_platform_stops_pictures_only(asked):
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
