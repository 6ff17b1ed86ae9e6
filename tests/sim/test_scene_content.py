"""A scene holds only its parts, stands above the floor, and runs without a display."""

import os
import subprocess
import sys

import mujoco
import pytest

from palpate.sim import (
    ArmCarrier,
    Box,
    ContactLaw,
    Mount,
    ObjectBody,
    SphereObject,
    Stage,
    Table,
    Tip,
    build_scene,
)
from palpate.sim.friction.law import FrictionLaw
from palpate.sim.hand.hand import three_finger_hand, two_finger_hand
from palpate.sim.hand.scene import HeldObject, build_grasp_scene
from palpate.sim.hand.turning_hand import turning_hand
from palpate.sim.headless import importable
from palpate.sim.objects.motion import DrivenJoint, JointKind, MovingTarget, Ramp
from palpate.sim.scene_cost import scene_cost
from palpate.surfaces import Sphere
from support.held_object import BOX, standing

BALL = SphereObject(0.03)


@pytest.mark.parametrize(("carrier", "bodies", "dofs", "geoms"), [(Stage(), 3, 3, 2), (ArmCarrier(), 10, 6, 8)])
def test_a_scene_has_what_it_names_and_one_pair(carrier, bodies, dofs, geoms):
    scene = build_scene(Tip(Sphere(0.008)), SphereObject(0.04), ContactLaw(), (0.0, 0.0, 0.06), carrier)
    cost = scene_cost(scene.model)
    assert (cost.bodies, cost.dofs, cost.geoms, cost.pairs) == (bodies, dofs, geoms, 1)
    assert cost.step_time > 0.0
    assert f"{dofs} degrees of freedom" in str(cost)


PLATE = Box((0.2, 0.2, 0.02))
SLIDING = MovingTarget(PLATE, [DrivenJoint(JointKind.SLIDE, (1.0, 0.0, 0.0), Ramp(0.1))])
FREE = ObjectBody(Box((0.06, 0.06, 0.04)), 0.5, 0.1, mount=Mount.FREE, position=(0.0, 0.0, 0.02))


def under_tip(target, table=None):
    return build_scene(Tip(Sphere(0.008)), target, ContactLaw(stiffness=5e3), (0.0, 0.0, 0.2), table=table)


@pytest.mark.parametrize(
    ("make", "counts"),
    [
        (lambda: under_tip(PLATE), {"npair": 1, "ngeom": 2}),
        (lambda: under_tip(PLATE, Table()), {"npair": 1, "ngeom": 3}),
        (lambda: under_tip(ObjectBody(PLATE), Table()), {"npair": 1, "ngeom": 3}),
        (lambda: under_tip(SLIDING, Table()), {"npair": 1, "ngeom": 3}),
        (lambda: under_tip(FREE), {"npair": 1, "ngeom": 2}),
        (lambda: under_tip(FREE, Table()), {"npair": 2, "ngeom": 3}),
        (lambda: build_grasp_scene(two_finger_hand(), HeldObject(BOX)), {"npair": 2, "nv": 8, "nu": 2}),
        (lambda: standing(three_finger_hand(), BALL).scene, {"npair": 4, "nv": 10, "nu": 4}),
        (lambda: standing(turning_hand(), BALL).scene, {"npair": 4, "nv": 13, "nu": 7}),
    ],
)
def test_a_scene_holds_only_its_parts_of_which_only_pairs_collide(make, counts):
    model = make().model
    assert {name: getattr(model, name) for name in counts} == counts
    assert not model.geom_contype.any()
    assert not model.geom_conaffinity.any()


def test_a_table_rubs_by_the_law_of_mujoco_where_fingers_rub_by_the_plant():
    model = standing(friction=FrictionLaw(stiffness=5e3)).scene.model
    assert sorted(model.pair_dim.tolist()) == [1, 1, 3]


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
