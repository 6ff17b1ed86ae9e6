"""The simulated UR5e stands as one would stand it: all of it above the floor that it is bolted to."""

import mujoco
import pytest

from palpate.sim import ArmCarrier, ContactLaw, SphereObject, Tip, build_scene
from palpate.surfaces import Sphere


@pytest.mark.parametrize("start", [(0.0, 0.0, 0.06), (0.02, -0.02, 0.05), (-0.05, 0.05, 0.1), (0.2, 0.1, 0.2)])
def test_no_link_is_below_the_floor(start):
    scene = build_scene(Tip(Sphere(0.008)), SphereObject(0.04), ContactLaw(), start, ArmCarrier())
    data = mujoco.MjData(scene.model)
    mujoco.mj_kinematics(scene.model, data)
    links = [scene.model.body(scene.model.jnt_bodyid[joint]).name for joint in range(6)]
    heights = {name: float(data.xpos[scene.model.body(name).id, 2]) for name in links}
    assert min(heights.values()) > 0.0, heights
    assert heights["arm/upper_arm"] > 0.3  # its frame is at its far end: the elbow
