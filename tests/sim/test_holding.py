"""A hand and the object it holds, with either friction: force balance, slip threshold, creep, sensed contacts."""

import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from palpate.errors import InvalidValueError
from palpate.kinematics.pose import Pose
from palpate.runtime.data import Command
from palpate.sensing.compensation import SensorPayload, contact_wrench
from palpate.sensing.solver import contact_from_wrench
from palpate.sim import CylinderObject, SphereObject
from palpate.sim.fidelity import GRAVITY, Fidelity
from palpate.sim.friction.law import FrictionLaw
from palpate.sim.friction.texture import Grating
from palpate.sim.hand.contact import FRICTION_STEP, LARGEST_CONTACT_STEP, GraspContact, grasp_pair_parameters
from palpate.sim.hand.hand import three_finger_hand, two_finger_hand
from palpate.sim.hand.scene import HeldObject, build_grasp_scene
from palpate.surfaces import Ellipsoid
from support.held_object import (
    BOX,
    held,
    lead_object,
    led,
    normal_force,
    press,
    pull,
    standing,
    wrench_of_fingers,
)
from support.simulated import move

TWO, THREE, BALL = two_finger_hand(), three_finger_hand(), SphereObject(0.03)
OBLONG = replace(TWO, tip=replace(TWO.tip, surface=Ellipsoid((0.008, 0.009, 0.012), center=(0, 0, 0.014))))
HANDS = pytest.mark.parametrize(("hand", "shape"), [(TWO, BOX), (THREE, BALL)], ids=["two", "three"])
SOFT, STIFF = GraspContact(stiffness=10e3), GraspContact(stiffness=40e3)
COULOMB = FrictionLaw(0.5, 0.5, spin_length=0.004, stiffness=5e3)
RUBBER = FrictionLaw(0.6, 0.4, spin_length=0.003, load_exponent=0.3, norm_exponent=1.4, stiffness=5e3)
SLIDING = replace(RUBBER, static_friction=0.4)
"""Rubber without stick-slip."""

HOLDS = {
    "two, light": {"force": 1.75, "mass": 0.05, "law": SOFT},
    "ellipsoids": {"force": 4.0, "mass": 0.2, "law": STIFF, "hand": OBLONG},
    "three": {"force": 4.0, "mass": 0.2, "law": STIFF, "hand": THREE, "shape": BALL},
    "Coulomb": {"force": 5.0, "friction": COULOMB},
    "rubber": {"force": 5.0, "friction": RUBBER},
    "three, Coulomb": {"force": 5.0, "friction": COULOMB, "hand": THREE, "shape": BALL},
}


@pytest.mark.slow
@pytest.mark.parametrize(("hand", "shape", "rate"), [(TWO, BOX, 5.0), (THREE, BALL, 20.0), (TWO, BOX, 100.0)])
def test_the_grip_force_is_reached_and_left_within_the_stated_accuracy(hand, shape, rate):
    backend = standing(hand, shape)
    press(backend, 2.0, 3.0)
    static = hand.grip_accuracy(0.0, 20e3)
    for finger in backend.truth().fingers:
        assert 2.0 - static <= normal_force(finger) <= 2.0 + hand.grip_band(2.0) + static
    press(backend, 1.0, 1.5, 2.0)
    for force, start in ((8.0, 1.0), (4.0, 8.0), (6.0, 4.0)):
        press(backend, force, 0.5, start, rate)
        truth = backend.truth()
        for finger, q in zip(truth.fingers, truth.joint_position, strict=True):
            stated = hand.grip_accuracy(rate, backend.scene.law.stiffness, q)
            assert normal_force(finger) == pytest.approx(force, abs=stated)


@HANDS
def test_gear_friction_holds_a_grip_without_commands(hand, shape):
    """Without the friction model the fingers would let go at once; a push within the band moves no finger."""
    backend = standing(hand, shape)
    press(backend, 5.0, 2.0)
    before = backend.truth().joint_position
    move(backend, 300)
    pull(backend, 0.3 * hand.grip_band(5.0), 0.0, 0.0)
    move(backend, 500)
    # the first finger is pushed; the others follow the object, as their drive was about to do anyway
    moved = (backend.truth().joint_position[0] - before[0]) / hand.finger.ratio
    assert abs(moved) * hand.finger.lever(0.0, hand.tip_along) < 1e-5  # the bristle gives way


@HANDS
def test_the_current_limit_leaves_the_largest_grip(hand, shape):
    backend, servo, currents = standing(hand, shape), hand.finger.servo, []
    for i in range(6000):
        backend.step(Command(grip_force=(min(100.0, 1.01 + 0.01 * i),) * hand.fingers))
        currents += [abs(finger.current) for finger in backend.truth().fingers]
    assert max(currents) <= servo.current_limit
    # beyond stall current by the help of back-EMF while the finger swings back
    assert max(currents) == pytest.approx(servo.largest_current, rel=1e-3)
    for finger in backend.truth().fingers:
        assert normal_force(finger) == pytest.approx(hand.largest_grip, rel=0.03)


@pytest.mark.slow
@HANDS
def test_a_hand_opens_without_squeezing_first(hand, shape):
    """The servo's profile has run on to behind the object: the full current would press until it is back."""
    backend, most = standing(hand, shape), 0.0
    press(backend, 2.0, 2.0)
    assert all(finger.touching for finger in backend.truth().fingers)
    for _ in range(9000):
        backend.step(Command(grip_force=(0.0,) * hand.fingers))
        most = max(most, *map(normal_force, backend.truth().fingers))
    assert most < 2.0 + hand.grip_band(2.0)
    assert not any(finger.touching for finger in backend.truth().fingers)
    assert backend.truth().joint_position[0] / hand.finger.ratio == pytest.approx(0.0, abs=0.05)


@pytest.fixture(scope="module", params=HOLDS)
def hold(request):
    """One held object: options, back end, the truth two seconds apart, and the last sample."""
    options = HOLDS[request.param]
    backend = held(seconds=2.0, **options)
    first = backend.truth()
    sample = move(backend, 2000)
    return options, backend, first, sample, backend.truth()


def test_a_held_object_creeps_only_as_far_as_its_friction_model_does(hold):
    """Below its limit surface a bristle carries for ever; MuJoCo's friction creeps at a known speed."""
    options, backend, first, _, last = hold
    speed = (first.position[2] - last.position[2]) / (last.time - first.time)
    if "friction" in options:
        assert abs(speed) < 1e-9
    else:
        creep = GRAVITY * backend.scene.pair.creep_speed / 0.5 * options["mass"] / backend.scene.hand.fingers
        assert 0.0 < speed < 1e-6
        assert speed == pytest.approx(creep, rel=0.3)
    assert last.position[2] > 0.005  # it was lifted


def test_finger_forces_balance_the_weight_and_share_it(hold):
    options, _, _, _, truth = hold
    forces, weight = np.array([finger.force for finger in truth.fingers]), options.get("mass", 0.1) * GRAVITY
    rest = np.add(wrench_of_fingers(truth), [0.0, 0.0, weight, 0.0, 0.0, 0.0])
    assert np.all(np.abs(rest) <= np.repeat([2e-4, 1e-5], 3))
    assert np.ptp(np.hypot(forces[:, 0], forces[:, 1])) < 1e-3
    assert -forces[:, 2] == pytest.approx(weight / len(forces), abs=1e-3)


def test_each_fingertip_senses_its_true_contact(hold):
    options, backend, _, sample, truth = hold
    hand, tip = backend.scene.hand, backend.scene.hand.tip
    palm = Pose(sample.arm.position_base_tip, sample.arm.rotation_base_tip)
    payload, sensors = SensorPayload(tip.mass, tip.center_of_mass), hand.sensor_poses(truth.joint_position)
    for given, finger, sensor in zip(sample.wrenches, truth.fingers, sensors, strict=True):
        wrench = contact_wrench(given.wrench, given.acceleration, payload)
        contact, pose = contact_from_wrench(tip.surface, np.array(wrench)), palm @ sensor
        rotation = np.array(pose.rotation)
        assert rotation @ contact.force == pytest.approx(finger.force, abs=1e-6)
        # half a penetration F/K is left, sqrt(1 + mu^2) times
        depth = options["force"] / backend.scene.law.stiffness
        assert pose.position + rotation @ contact.centroid == pytest.approx(finger.position, abs=0.7 * depth)
        assert rotation @ contact.normal @ np.subtract(truth.position, finger.position) > 0.0  # into the object
        assert contact.normal_force == pytest.approx(normal_force(finger), rel=5e-3)


@pytest.mark.slow
@pytest.mark.parametrize(("friction", "mass"), [(0.3, 0.4), (0.6, 0.2)])
def test_an_object_slips_when_its_fingers_no_longer_carry_it(mass, friction):
    """2 mu F = m g: the grip is reduced until the object falls."""
    least = mass * GRAVITY / (2 * friction)
    force = 1.5 * least + 1.0
    backend = held(force, 2.0, mass=mass, law=GraspContact(stiffness=10e3, friction=friction))
    while abs(backend.truth().velocity[2]) < 1e-4:
        grips = [normal_force(finger) for finger in backend.truth().fingers]
        force -= 1e-4 * least
        assert force > 0.0
        backend.step(Command(grip_force=(force, force)))
    assert min(grips) == pytest.approx(least, rel=0.01)


@pytest.mark.parametrize(
    ("friction", "static"), [(None, 0.5), (FrictionLaw(0.6, 0.3, spin_length=0.004, stiffness=5e3), 0.6)]
)
def test_a_pull_slips_at_static_friction(friction, static):
    backend = held(5.0, friction=friction)
    capacity = static * sum(normal_force(finger) for finger in backend.truth().fingers)
    state = backend.snapshot()
    for share, slips in ((0.97, False), (1.03, True)):
        backend.restore(state)
        along = math.sqrt((share * capacity) ** 2 - (0.1 * GRAVITY) ** 2)
        for i in range(400):  # not at once: a blow on a spring is twice its force
            pull(backend, 0.0, along * min(1.0, i / 250), 0.0)
            backend.step(Command())
        assert (math.hypot(*backend.truth().velocity) > 0.01) == slips


@pytest.mark.slow
@pytest.mark.parametrize("friction", [0.2, 1.0, COULOMB, SLIDING], ids=["0.2", "1.0", "Coulomb", "rubber"])
def test_full_slip_lies_on_the_limit_surface(friction):
    """Within 0.5 %, from pulling over mixed to twisting; slip is normal to the surface."""
    plant = isinstance(friction, FrictionLaw)
    own = {"friction": friction} if plant else {"law": GraspContact(friction=friction)}
    law = friction if plant else FrictionLaw(friction, friction, spin_length=GraspContact().spin_length)
    backend = held(3.0 if plant else 5.0, **own)
    lead_object(backend)
    state = backend.snapshot()
    for angle in (0.0, 20.0, 45.0, 70.0, 90.0):
        backend.restore(state)
        v, w = 0.02 * math.cos(math.radians(angle)), 0.02 * math.sin(math.radians(angle)) / law.spin_length
        *_, truth = led(backend, 100 if plant else 30, 0.0, v, 0.0, w, 0.0, 0.0)
        for finger in truth.fingers:
            f_n, f_t, spin = abs(finger.force[0]), math.hypot(*finger.force[1:]), abs(finger.torque[0])
            mu = law.friction_at(law.slip_speed(f_n, v, w))
            assert law.load_ratio(f_n, f_t, spin, mu) == pytest.approx(1.0, abs=5e-3)
            force, torque = law.slipping_load(f_n, v, w)
            # the object's own centre is not quite on the line of contacts: the slip is not quite (v, w)
            expected = pytest.approx((force, torque / law.spin_length), abs=0.06 * mu * f_n)
            assert (f_t, spin / law.spin_length) == expected


def test_a_texture_is_felt_where_the_fingers_are():
    """Dragged over a grating along z, the friction of both fingers follows it."""
    law, texture = FrictionLaw(0.4, 0.4, spin_length=0.004, stiffness=5e3), Grating(0.01, 0.3, (0.0, 0.0, 1.0))
    backend = held(5.0, friction=law, texture=texture)
    lead_object(backend)
    factors, expected = [], []
    for truth in led(backend, 1000, 0.0, 0.0, 0.02, 0.0, 0.0, 0.0):
        for finger in truth.fingers:
            factors.append(math.hypot(*finger.force[1:]) / (0.4 * normal_force(finger)))
            expected.append(texture.factor(0.0, 0.0, finger.position[2] - truth.position[2]))
    assert np.ptp(expected) > 1.9 * 0.3
    assert np.array(factors[200:]) == pytest.approx(np.array(expected[200:]), abs=0.03)


def test_a_cylinder_is_held_across_its_axis():
    """It lies along x; turned by 90 degrees it lies across the closing direction."""
    across = Pose(rotation=((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
    backend = held(3.0, 2.0, shape=HeldObject(CylinderObject(0.025, 0.06), 0.1, across), table=-0.025)
    assert backend.truth().position[2] == pytest.approx(0.45 * 0.02, abs=1e-3)


@pytest.mark.parametrize(("mass", "step"), [(0.1, 0.5), (1.0, 1.0)])
def test_twice_the_largest_contact_step_is_still_sound(mass, step, monkeypatch):
    """The margin of `LARGEST_CONTACT_STEP`: neither noise in a hold nor lift-off in a slip."""
    assert LARGEST_CONTACT_STEP <= 0.5
    monkeypatch.setattr("palpate.sim.hand.contact.LARGEST_CONTACT_STEP", 2.0)
    law = GraspContact(stiffness=mass * (step / 1e-3) ** 2)
    backend = held(3.0 * mass * GRAVITY, 2.0, mass=mass, law=law)
    still = [backend.step(Command()).wrenches[0].wrench[0] for _ in range(200)]
    assert np.std(still) < 1e-6
    capacity = 0.5 * sum(normal_force(finger) for finger in backend.truth().fingers)
    pull(backend, 0.0, 0.0, mass * GRAVITY - 1.2 * capacity)
    for _ in range(40):
        backend.step(Command())
        for finger in backend.truth().fingers:
            assert normal_force(finger) == pytest.approx(capacity, rel=0.5)


@pytest.mark.parametrize("time_step", [0.5e-3, 1e-3])
def test_a_grasp_scene_has_its_preset(time_step):
    pair = grasp_pair_parameters(GraspContact(), 10.0, time_step)
    assert (*pair.solimp[:2], pair.impratio) == (0.5, 0.5, 1e6)
    assert pair.friction_damping * time_step == pytest.approx(FRICTION_STEP)
    option = build_grasp_scene(TWO, HeldObject(BOX), fidelity=Fidelity(time_step)).model.opt
    expected = (0, mujoco.mjtCone.mjCONE_ELLIPTIC, mujoco.mjtIntegrator.mjINT_IMPLICITFAST)
    assert (option.noslip_iterations, option.cone, option.integrator) == expected


def test_a_bristle_too_stiff_for_a_grasp_is_refused():
    with pytest.raises(InvalidValueError, match=r"bristle stiffness = 20000 N/m.* take a stiffness of at most"):
        held(5.0, hand=THREE, shape=BALL, friction=FrictionLaw(0.5, 0.5))
