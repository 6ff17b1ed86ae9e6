"""The simulated sensor against MuJoCo's own contact forces (mj_contactForce): sign, weight, inertia, position."""

import mujoco
import numpy as np
import pytest

from palpate.runtime.data import Command
from palpate.sensing.compensation import SensorPayload, contact_wrench
from palpate.sensing.solver import contact_from_wrench
from palpate.sim import Box, ContactLaw, EllipsoidObject, MujocoBackend, SphereObject, Tip, build_scene
from palpate.sim.fidelity import GRAVITY
from palpate.surfaces import Ellipsoid, Sphere

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
    backend = MujocoBackend(build_scene(tip, target, ContactLaw(), start))
    backend.start()
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


@pytest.mark.slow
@pytest.mark.parametrize("name", TIPS)
@pytest.mark.parametrize("target", [SphereObject(), EllipsoidObject(), Box()], ids=["sphere", "ellipsoid", "box"])
def test_the_compensated_wrench_is_the_contact_wrench_while_the_stage_accelerates(name, target):
    tip = TIPS[name]
    largest_error, largest_inertia, touched = 0.0, 0.0, 0
    for sample, backend in pressed_and_shaken(tip, target):
        force, torque, position = force_on_tip(backend)
        if position is None:
            continue
        touched += 1
        origin = np.array(sample.arm.position_base_tip)
        true = np.concatenate([force, torque - np.cross(origin, force)])  # the stage does not turn
        given = sample.wrenches[0]
        found = np.array(contact_wrench(given.wrench, given.acceleration, payload(tip)))
        largest_error = max(largest_error, np.abs(found - true).max())
        # Newton and Euler: what is left uncompensated is m a, at the centre of mass
        inertia = tip.mass * np.array(given.acceleration)
        moment = np.cross(tip.center_of_mass, inertia)
        assert np.allclose(true - given.wrench, np.concatenate([inertia, moment]), rtol=0, atol=1e-6)
        shaking = inertia - tip.mass * GRAVITY * np.array([0.0, 0.0, 1.0])
        largest_inertia = max(largest_inertia, np.linalg.norm(shaking))
    assert touched > 300
    assert largest_error < 1e-6
    assert largest_inertia > 0.5 * tip.mass  # it really shook


@pytest.mark.parametrize("name", TIPS)
def test_the_truth_of_the_back_end_is_that_of_the_contact_solver(name):
    touched = 0
    for _, backend in pressed_and_shaken(TIPS[name], SphereObject(), seconds=0.1):
        force, torque, position = force_on_tip(backend)
        truth = backend.truth()
        assert truth.touching == (position is not None)
        if position is None:
            continue
        touched += 1
        assert force[2] > 0.0  # the object carries the tip
        assert np.allclose(truth.force, force, rtol=0, atol=1e-9)
        assert np.allclose(truth.position, position, rtol=0, atol=1e-9)
        assert np.allclose(truth.torque, torque - np.cross(position, force), rtol=0, atol=1e-9)
    assert touched > 80


def test_the_wrong_sign_of_the_sensor_would_show_on_the_other_side_of_the_tip():
    tip = TIPS["sphere off the sensor"]
    for sample, backend in pressed_and_shaken(tip, SphereObject(), seconds=0.05):
        given = sample.wrenches[0]
        wrench = np.array(contact_wrench(given.wrench, given.acceleration, payload(tip)))
        position = np.subtract(backend.truth().position, sample.arm.position_base_tip)
        right = contact_from_wrench(tip.surface, wrench).centroid
        wrong = contact_from_wrench(tip.surface, -wrench).centroid
        assert np.linalg.norm(right - position) < 0.2e-3
        assert np.linalg.norm(wrong - position) > 10e-3


def test_no_contact_means_no_force_once_weight_and_inertia_are_taken_off():
    tip = TIPS["heavy sphere"]
    backend = MujocoBackend(build_scene(tip, SphereObject(), ContactLaw(), (0.0, 0.0, 0.2)))
    with backend:
        sample = backend.start()
        for i in range(200):
            given = sample.wrenches[0]
            rest = contact_wrench(given.wrench, given.acceleration, payload(tip))
            assert np.abs(rest).max() < 1e-9
            truth = backend.truth()
            assert not truth.touching
            assert np.linalg.norm(truth.force) == 0.0
            v = 0.1 * np.sin(0.1 * i)
            sample = backend.step(Command((v, -v, v)))


def test_at_rest_the_accelerometer_points_up_with_g_and_the_sensor_carries_the_weight():
    tip = TIPS["heavy sphere"]
    backend = MujocoBackend(build_scene(tip, SphereObject(), ContactLaw(), (0.0, 0.0, 0.2)))
    given = backend.start().wrenches[0]
    assert np.allclose(given.acceleration, [0.0, 0.0, GRAVITY], atol=1e-9)
    weight = np.array([0.0, 0.0, -tip.mass * GRAVITY])
    moment = np.cross(tip.center_of_mass, weight)
    assert np.allclose(given.wrench, np.concatenate([weight, moment]), atol=1e-9)
