"""A target on a spring: what it weighs, how it swings, what a tip feels of it."""

import math

import mujoco
import numpy as np
import pytest

from palpate.runtime import Command
from palpate.sim import Box, ContactLaw, MujocoBackend, SprungTarget, Tip, build_scene
from palpate.sim.objects.target import Mount
from palpate.surfaces import Sphere

PLATE = Box((0.2, 0.2, 0.04))


def model_of(target):
    spec = mujoco.MjSpec()
    spec.option.timestep = 1e-4
    target.add_to(spec, "object")
    return spec.compile()


@pytest.mark.parametrize(("stiffness", "mass"), [(2e3, 1.0), (500.0, 3.0)])
def test_it_swings_at_its_own_frequency_and_its_swings_decay_as_its_damping_says(stiffness, mass):
    ratio = 0.1
    target = SprungTarget(PLATE, stiffness, 2.0 * ratio * math.sqrt(stiffness * mass), mass)
    assert target.damping_ratio == pytest.approx(ratio)
    model = model_of(target)
    data = mujoco.MjData(model)
    data.qpos[0] = 1e-3
    heights = []
    for _ in range(20000):
        mujoco.mj_step(model, data)
        heights.append(float(data.qpos[0]))
    z = np.array(heights)
    rate = math.sqrt(stiffness / mass * (1.0 - ratio**2))
    crossings = np.flatnonzero((z[:-1] < 0.0) & (z[1:] >= 0.0))[:5]
    assert np.diff(crossings) * 1e-4 == pytest.approx(2.0 * math.pi / rate, rel=5e-3)
    first, second = z[crossings[0] : crossings[1]].max(), z[crossings[1] : crossings[2]].max()
    assert math.log(first / second) == pytest.approx(2.0 * math.pi * ratio / math.sqrt(1.0 - ratio**2), rel=0.02)


def test_nothing_holds_its_weight_but_it_does_not_fall():
    model = model_of(SprungTarget(PLATE))
    data = mujoco.MjData(model)
    for _ in range(1000):
        mujoco.mj_step(model, data)
    assert data.qpos[0] == pytest.approx(0.0, abs=1e-9)


def test_pressed_it_yields_by_force_over_stiffness_and_the_truth_says_where_it_is():
    tip, target = Tip(Sphere(0.008), 0.03), SprungTarget(PLATE, 2e3, 60.0, 1.0)
    assert target.mount is Mount.SPRUNG
    scene = build_scene(tip, target, ContactLaw(stiffness=20e3), (0.0, 0.0, 0.02 + 0.0081))
    with MujocoBackend(scene) as backend:
        backend.start()
        for i in range(2000):
            backend.step(Command((0.0, 0.0, -0.001 if i < 1000 else 0.0)))
        truth = backend.truth()
    force = -truth.force[2] if truth.force[2] < 0.0 else truth.force[2]
    assert force > 0.5
    assert truth.pose_base_object.position[2] == pytest.approx(-force / 2e3, rel=1e-3)
