"""A held object whose fingertips rub by the friction plant: what its law says, and nothing else."""

import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from palpate.errors import InvalidValueError
from palpate.kinematics.pose import Pose, rotvec_from_rotation, times, transposed
from palpate.runtime.data import Command
from palpate.sensing.compensation import SensorPayload, contact_wrench
from palpate.sensing.solver import contact_from_wrench
from palpate.sim import Box, Fidelity, Integrator, Lift, SphereObject, TurningStage
from palpate.sim.fidelity import GRAVITY
from palpate.sim.friction.law import FrictionLaw
from palpate.sim.friction.texture import Grating
from palpate.sim.hand.backend import HandBackend
from palpate.sim.hand.hand import three_finger_hand, two_finger_hand
from palpate.sim.hand.scene import HeldObject, build_grasp_scene
from palpate.sim.objects.table import Table
from palpate.spatial import cross, subtract

BOX = Box((0.06, 0.05, 0.06))
COULOMB = FrictionLaw(0.5, 0.5, spin_length=0.004, stiffness=5e3)
RUBBER = FrictionLaw(0.6, 0.4, spin_length=0.003, load_exponent=0.3, norm_exponent=1.4, stiffness=5e3)


def scene_of(law=COULOMB, hand=None, shape=BOX, mass=0.1, carrier=None, **more):
    target = HeldObject(shape, mass)
    return build_grasp_scene(
        hand or two_finger_hand(),
        target,
        carrier=carrier or Lift(),
        table=Table(-0.03),
        friction=law,
        **more,
    )


def held(scene, force=5.0, sensor=None):
    """An object lifted off its table, at rest."""
    backend, n = HandBackend(scene, sensor=sensor), scene.hand.fingers
    backend.start()
    for _ in range(1500):
        backend.step(Command(grip_force=(force,) * n))
    for _ in range(400):
        backend.step(Command((0.0, 0.0, 0.02)))
    for _ in range(400):
        backend.step(Command())
    return backend


def normal_force(finger):
    return math.hypot(finger.force[0], finger.force[1])


def lead_object(backend):
    """Make the object so heavy that no contact changes its velocity, and weightless; the contact law stays."""
    model, body = backend.scene.model, backend.scene.model.body("object").id
    kept = model.body_invweight0.copy(), model.dof_invweight0.copy()
    model.body_mass[body], model.body_inertia[body], model.body_gravcomp[body] = 100.0, [1.0] * 3, 1.0
    mujoco.mj_setConst(model, mujoco.MjData(model))
    model.body_invweight0[:], model.dof_invweight0[:] = kept


SLIDING = replace(RUBBER, static_friction=0.4)
"""Without stick-slip, which else goes on at this speed."""


@pytest.mark.slow
@pytest.mark.parametrize("law", [COULOMB, SLIDING], ids=["Coulomb", "rubber"])
@pytest.mark.parametrize("angle", [0.0, 20.0, 45.0, 70.0, 90.0])
def test_full_slip_lies_on_the_limit_surface_of_its_law(law, angle):
    """Within 0.5 %, from pulling over mixed to twisting: load-dependent spin length and exponent p included."""
    backend = held(scene_of(law), 3.0)
    direction, e = math.radians(angle), law.spin_length
    v, w = 0.02 * math.cos(direction), 0.02 * math.sin(direction) / e
    lead_object(backend)
    at = int(backend.scene.model.joint("object").dofadr[0])
    for _ in range(100):
        backend._data.qvel[at : at + 6] = [0.0, v, 0.0, w, 0.0, 0.0]
        backend.step(Command())
    for finger in backend.truth().fingers:
        f_n, f_t = abs(finger.force[0]), math.hypot(finger.force[1], finger.force[2])
        spin = abs(finger.torque[0])
        mu = law.friction_at(law.slip_speed(f_n, v, w))
        assert law.load_ratio(f_n, f_t, spin, mu) == pytest.approx(1.0, abs=5e-3)
        pull, twist = law.slipping_load(f_n, v, w)
        # the object's own centre is not quite on the line of contacts: the slip is not quite (v, w)
        assert (f_t, spin / e) == pytest.approx((pull, twist / e), abs=0.06 * mu * f_n)


@pytest.mark.parametrize(
    ("hand", "shape", "law"),
    [
        (two_finger_hand(), BOX, COULOMB),
        (two_finger_hand(), BOX, RUBBER),
        (three_finger_hand(), SphereObject(0.03), COULOMB),
    ],
    ids=["two", "two, rubber", "three"],
)
def test_what_is_held_does_not_creep_at_all(hand, shape, law):
    """Below the limit surface a bristle bears for ever: MuJoCo's own friction sinks by 0.25 um/s."""
    backend = held(scene_of(law, hand, shape))
    first = backend.truth()
    for _ in range(2000):
        backend.step(Command())
    last = backend.truth()
    assert abs(first.position[2] - last.position[2]) / (last.time - first.time) < 1e-9
    assert last.position[2] > 0.005  # it was lifted
    on_object = -np.sum([finger.force for finger in last.fingers], axis=0)
    assert on_object == pytest.approx([0.0, 0.0, 0.1 * GRAVITY], abs=1e-3)


@pytest.mark.parametrize(("share", "slips"), [(0.97, False), (1.03, True)])
def test_it_slips_at_static_friction(share, slips):
    law = FrictionLaw(0.6, 0.3, spin_length=0.004, stiffness=5e3)
    mass = 0.1
    backend = held(scene_of(law, mass=mass), 5.0)
    capacity = 0.6 * sum(normal_force(finger) for finger in backend.truth().fingers)
    body = backend.scene.model.body("object").id
    along = math.sqrt((share * capacity) ** 2 - (mass * GRAVITY) ** 2)
    for i in range(300):  # not at once: a blow on a spring is twice its force
        backend._data.xfrc_applied[body, 1] = along * min(1.0, i / 250)
        backend.step(Command())
    for _ in range(100):
        backend.step(Command())
    assert (math.hypot(*backend.truth().velocity) > 0.01) == slips


def test_what_each_fingertip_feels_is_what_happens():
    backend = held(scene_of(RUBBER))
    hand = backend.scene.hand
    sample, truth = backend.step(Command()), backend.truth()
    palm = Pose(sample.arm.position_base_tip, sample.arm.rotation_base_tip)
    sensors = hand.sensor_poses(truth.joint_position)
    for given, finger, sensor in zip(sample.wrenches, truth.fingers, sensors, strict=True):
        tip = hand.tips[0]
        payload = SensorPayload(tip.mass, tip.center_of_mass)
        wrench = contact_wrench(given.wrench, given.acceleration, payload)
        contact = contact_from_wrench(tip.surface, np.array(wrench))
        rotation = np.array((palm @ sensor).rotation)
        assert rotation @ contact.force == pytest.approx(finger.force, abs=1e-6)
        assert contact.normal_force == pytest.approx(normal_force(finger), rel=5e-3)
        assert finger.force[2] == pytest.approx(-0.05 * GRAVITY, abs=1e-3)  # half the weight each


def test_a_held_box_that_turns_with_the_hand_comes_back_to_where_it_was():
    """There and back: bristles give way to the weight, elastically; MuJoCo's friction creeps by 0.1 mm here."""
    backend = held(scene_of(COULOMB, carrier=TurningStage()), 6.0)
    sample = backend.step(Command())
    place = backend.truth().position

    def in_hand():
        truth, flat = backend.truth(), np.zeros(9)
        mujoco.mju_quat2Mat(flat, truth.quat_wxyz)
        rows = tuple(map(tuple, flat.reshape(3, 3).tolist()))
        palm = Pose(sample.arm.position_base_tip, sample.arm.rotation_base_tip)
        return palm.inverse() @ Pose(truth.position, rows)

    before = in_hand()
    for rate in ((0.3, 0.2, 0.4), (-0.3, -0.2, -0.4)):
        for _ in range(1000):
            lever = subtract(sample.arm.position_base_tip, place)
            sample = backend.step(Command(cross(rate, lever), angular_velocity_base_tip=rate))
    for _ in range(500):
        sample = backend.step(Command())
    after = in_hand()
    assert math.dist(after.position, before.position) < 20e-6
    turn = rotvec_from_rotation(times(after.rotation, transposed(before.rotation)))
    assert math.hypot(*turn) < 1e-3


def test_texture_is_felt_where_the_fingers_are():
    """Dragged over a grating along z, the friction of both fingers goes with it."""
    wavelength, amplitude = 0.01, 0.3
    law = FrictionLaw(0.4, 0.4, spin_length=0.004, stiffness=5e3)
    texture = Grating(wavelength, amplitude, (0.0, 0.0, 1.0))
    backend = held(scene_of(law, texture=texture), 5.0)
    lead_object(backend)
    at = int(backend.scene.model.joint("object").dofadr[0])
    factors, wanted = [], []
    for _ in range(1000):
        backend._data.qvel[at : at + 6] = [0.0, 0.0, 0.02, 0.0, 0.0, 0.0]
        backend.step(Command())
        truth = backend.truth()
        for finger in truth.fingers:
            f_t = math.hypot(finger.force[1], finger.force[2])
            factors.append(f_t / (0.4 * normal_force(finger)))
            wanted.append(texture.factor(0.0, 0.0, finger.position[2] - truth.position[2]))
    assert np.ptp(wanted) > 1.9 * amplitude
    assert np.array(factors[200:]) == pytest.approx(np.array(wanted[200:]), abs=0.03)


def test_what_the_plant_does_not_serve_rubs_by_mujocos_law():
    model = scene_of().model
    assert sorted(model.pair_dim.tolist()) == [1, 1, 3]


def test_what_cannot_be_is_refused():
    with pytest.raises(InvalidValueError, match="texture without friction"):
        build_grasp_scene(two_finger_hand(), HeldObject(BOX), texture=Grating(0.01, 0.1))
    with pytest.raises(InvalidValueError, match="RK4"):
        HandBackend(scene_of(fidelity=Fidelity(1e-3, Integrator.RK4)))
    with pytest.raises(InvalidValueError, match=r"bristle stiffness = 20000 N/m.* take a stiffness of at most"):
        held(scene_of(FrictionLaw(0.5, 0.5), three_finger_hand(), SphereObject(0.03)))
