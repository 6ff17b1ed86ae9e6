"""The simulated sensor against MuJoCo's own contact forces (mj_contactForce): sign, weight, inertia, position."""

import mujoco
import numpy as np
import pytest

from palpate.runtime.data import Command
from palpate.sensing.compensation import SensorPayload, contact_wrench
from palpate.sim import Box, ContactLaw, EllipsoidObject, MujocoBackend, SphereObject, Tip, build_scene
from palpate.sim.fidelity import GRAVITY
from palpate.surfaces import Ellipsoid, Sphere
from support.simulated import started

OFF_CENTER = (0.001, -0.002, 0.01)
TILT = np.array([[0.8, 0.0, 0.6], [0.36, 0.8, -0.48], [-0.48, 0.6, 0.64]])
TIPS = {
    "centred sphere": Tip(Sphere(0.008)),
    "sphere off the sensor": Tip(Sphere(0.008, center=OFF_CENTER)),
    "heavy sphere": Tip(Sphere(0.008, center=OFF_CENTER), mass=0.5),
    "tilted ellipsoid": Tip(Ellipsoid((0.007, 0.008, 0.01), center=OFF_CENTER, rotation=TILT), mass=0.1),
}
WOBBLE_HZ, WOBBLE = 15.0, 0.03


def force_on_tip(backend):
    """Return (force, torque about the base origin, position) of all contacts on the tip, by mj_contactForce."""
    model, data = backend.scene.model, backend._data
    tip = model.geom("tip").id
    force, torque, weighted, weight = np.zeros(3), np.zeros(3), np.zeros(3), 0.0
    for i, contact in enumerate(data.contact):
        in_contact_frame = np.zeros(6)
        mujoco.mj_contactForce(model, data, i, in_contact_frame)
        # rows of the frame are its axes, the first from geom 1 into geom 2; the force acts on geom 2
        axes = contact.frame.reshape(3, 3)
        sign = 1.0 if contact.geom[1] == tip else -1.0
        f = sign * axes.T @ in_contact_frame[:3]
        force += f
        torque += np.cross(contact.pos, f) + sign * axes.T @ in_contact_frame[3:]
        weighted += in_contact_frame[0] * contact.pos
        weight += in_contact_frame[0]
    return force, torque, weighted / weight if weight else None


def pressed_and_shaken(tip, target, seconds=0.4):
    """Press the tip on an object, then shake the stage; yield (sample, backend) while it shakes."""
    bottom = -tip.center_of_mass[2] + max(tip.surface.half_lengths)
    start = (-tip.center_of_mass[0], -tip.center_of_mass[1], target.top + bottom)
    backend = started(build_scene(tip, target, ContactLaw(), start))
    for _ in range(1500):  # down until 3 N
        backend.step(Command((0.0, 0.0, -0.003)))
        if backend.truth().force[2] > 3.0:
            break
    for i in range(round(seconds / backend.period)):
        t = i * backend.period
        v = WOBBLE * np.sin(2 * np.pi * WOBBLE_HZ * t)
        yield backend.step(Command((v, 0.7 * v, -0.01 * v))), backend


def payload(tip):
    return SensorPayload(tip.mass, tip.center_of_mass)


@pytest.mark.parametrize(
    ("name", "target"),
    [
        *zip(TIPS, [SphereObject(), EllipsoidObject(), Box(), SphereObject()], strict=True),
        *zip(TIPS, [Box(), SphereObject(), EllipsoidObject(), Box()], strict=True),
    ],
)
def test_the_compensated_wrench_is_the_contact_wrench_while_the_stage_accelerates(name, target):
    """The truth of the back end, too, is that of the contact solver."""
    tip = TIPS[name]
    largest_inertia, touched = 0.0, 0
    for sample, backend in pressed_and_shaken(tip, target):
        force, torque, position = force_on_tip(backend)
        truth = backend.truth()
        assert truth.touching == (position is not None)
        touched += truth.touching
        if position is None:
            continue
        assert force[2] > 0.0  # the object carries the tip
        known = np.concatenate([truth.force, truth.position, truth.torque])
        assert known == pytest.approx(
            np.concatenate([force, position, torque - np.cross(position, force)]), abs=1e-9
        )
        origin = np.array(sample.arm.position_base_tip)
        true = np.concatenate([force, torque - np.cross(origin, force)])  # the stage does not turn
        given = sample.wrenches[0]
        found = np.array(contact_wrench(given.wrench, given.acceleration, payload(tip)))
        assert found == pytest.approx(true, abs=1e-6)
        # Newton and Euler: the uncompensated rest is m a, at the centre of mass
        inertia = tip.mass * np.array(given.acceleration)
        moment = np.cross(tip.center_of_mass, inertia)
        assert np.allclose(true - given.wrench, np.concatenate([inertia, moment]), rtol=0, atol=1e-6)
        largest_inertia = max(
            largest_inertia, np.linalg.norm(inertia - tip.mass * GRAVITY * np.array([0.0, 0.0, 1.0]))
        )
    assert touched > 300
    assert largest_inertia > 0.5 * tip.mass  # it really shook


def test_without_contact_only_weight_and_inertia_are_felt():
    tip = TIPS["heavy sphere"]
    backend = MujocoBackend(build_scene(tip, SphereObject(), ContactLaw(), (0.0, 0.0, 0.2)))
    given = backend.start().wrenches[0]
    assert np.allclose(given.acceleration, [0.0, 0.0, GRAVITY], atol=1e-9)
    weight = np.array([0.0, 0.0, -tip.mass * GRAVITY])
    assert np.allclose(given.wrench, np.concatenate([weight, np.cross(tip.center_of_mass, weight)]), atol=1e-9)
    for i in range(200):
        v = 0.1 * np.sin(0.1 * i)
        given, truth = backend.step(Command((v, -v, v))).wrenches[0], backend.truth()
        assert np.abs(contact_wrench(given.wrench, given.acceleration, payload(tip))).max() < 1e-9
        assert (truth.touching, np.linalg.norm(truth.force)) == (False, 0.0)
