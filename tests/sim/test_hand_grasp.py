"""A hand and what it holds: force balance, Coulomb's threshold, creep, full slip, what fingertips feel."""

import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from palpate.kinematics.pose import Pose
from palpate.runtime.data import Command
from palpate.sensing.compensation import SensorPayload, contact_wrench
from palpate.sensing.solver import contact_from_wrench
from palpate.sim import Box, CylinderObject, Lift, SphereObject
from palpate.sim.fidelity import GRAVITY, Fidelity
from palpate.sim.hand.backend import HandBackend
from palpate.sim.hand.contact import FRICTION_STEP, GraspContact, grasp_pair_parameters
from palpate.sim.hand.hand import finger_name, three_finger_hand, two_finger_hand
from palpate.sim.hand.scene import HeldObject, build_grasp_scene
from palpate.sim.objects.table import Table
from palpate.surfaces import Ellipsoid

BOX = Box((0.06, 0.05, 0.06))
HANDS = pytest.mark.parametrize(
    ("hand", "shape"),
    [(two_finger_hand(), BOX), (three_finger_hand(), SphereObject(0.03))],
    ids=["two fingers", "three fingers"],
)


def standing(hand, shape, mass=0.1, law=None, carrier=None):
    scene = build_grasp_scene(hand, HeldObject(shape, mass), law, carrier or Lift(), Table(-0.03))
    backend = HandBackend(scene)
    backend.start()
    return backend


def press(backend, force, seconds=1.0, start=0.0, rate=10.0):
    """Ramp the grip from `start` to `force` and hold it."""
    n, way = backend.scene.hand.fingers, math.copysign(rate * backend.period, force - start)
    for i in range(math.ceil(abs(force - start) / abs(way))):
        backend.step(Command(grip_force=(start + (i + 1) * way,) * n))
    for _ in range(round(seconds / backend.period)):
        sample = backend.step(Command(grip_force=(force,) * n))
    return sample


def held(hand, shape, force, mass=0.1, law=None):
    """An object lifted off its table by a centimetre, at rest."""
    backend = standing(hand, shape, mass, law)
    press(backend, force, 2.0)
    for _ in range(500):
        backend.step(Command((0.0, 0.0, 0.02)))
    for _ in range(500):
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


def pull(backend, force):
    body = backend.scene.model.body("object").id
    backend._data.xfrc_applied[body, :3] = force


@pytest.mark.slow
@HANDS
@pytest.mark.parametrize("rate", [5.0, 20.0, 100.0])
def test_the_grip_force_is_reached_and_left_within_the_stated_accuracy(hand, shape, rate):
    backend = standing(hand, shape)
    press(backend, 1.0, 1.5)
    for force, start in ((8.0, 1.0), (4.0, 8.0), (6.0, 4.0)):
        press(backend, force, 0.5, start, rate)
        truth = backend.truth()
        for finger, q in zip(truth.fingers, truth.joint_position, strict=True):
            stated = hand.grip_accuracy(rate, backend.scene.law.stiffness, q)
            assert normal_force(finger) == pytest.approx(force, abs=stated)


@HANDS
def test_the_first_blow_stays_within_the_friction_band(hand, shape):
    backend = standing(hand, shape)
    press(backend, 2.0, 3.0)
    band = hand.grip_band(2.0) + hand.grip_accuracy(0.0, 20e3)
    for finger in backend.truth().fingers:
        assert 2.0 - hand.grip_accuracy(0.0, 20e3) <= normal_force(finger) <= 2.0 + band


@HANDS
def test_friction_in_the_gear_holds_a_grip_that_nobody_commands_any_more(hand, shape):
    """Without the friction model the command would let go at once; a push within the band moves no finger."""
    backend = standing(hand, shape)
    press(backend, 5.0, 2.0)
    before = backend.truth().joint_position
    for _ in range(300):
        backend.step(Command())
    pull(backend, (0.3 * hand.grip_band(5.0), 0.0, 0.0))
    for _ in range(500):
        backend.step(Command())
    # the first finger is pushed; the others follow the object, which their drive was about to do anyway
    moved = (backend.truth().joint_position[0] - before[0]) / hand.finger.ratio
    assert abs(moved) * hand.finger.lever(0.0, hand.tip_along) < 1e-5  # what the bristle gives way


@HANDS
def test_the_currents_respect_their_limit_and_the_largest_grip_is_what_it_leaves(hand, shape):
    backend = standing(hand, shape)
    servo = hand.finger.servo
    n, currents = hand.fingers, []
    force = 1.0
    for _ in range(6000):
        force = min(100.0, force + 0.01)
        backend.step(Command(grip_force=(force,) * n))
        currents += [abs(finger.current) for finger in backend.truth().fingers]
    assert max(currents) <= servo.current_limit
    # beyond stall current by what back-EMF helps while the finger swings back
    assert max(currents) == pytest.approx(servo.largest_current, rel=1e-3)
    for finger in backend.truth().fingers:
        assert normal_force(finger) == pytest.approx(hand.largest_grip, rel=0.03)


@pytest.mark.slow
@HANDS
def test_a_hand_that_opens_does_not_squeeze_first(hand, shape):
    """The servo's profile has run on to behind the object: the full current would press until it is back."""
    backend = standing(hand, shape)
    press(backend, 2.0, 2.0)
    most = 0.0
    for _ in range(9000):
        backend.step(Command(grip_force=(0.0,) * hand.fingers))
        most = max(most, *(normal_force(finger) for finger in backend.truth().fingers))
    assert most < 2.0 + hand.grip_band(2.0)
    assert not any(finger.touching for finger in backend.truth().fingers)


@HANDS
@pytest.mark.parametrize("mass", [0.05, 0.3])
def test_a_held_object_creeps_less_than_a_micrometre_per_second(hand, shape, mass):
    backend = held(hand, shape, 1.5 * mass * GRAVITY + 1.0, mass, GraspContact(stiffness=10e3))
    first = backend.truth()
    for _ in range(1000):
        backend.step(Command())
    last = backend.truth()
    sunk = first.position[2] - last.position[2]
    # minus what the hand itself moved: it stands
    assert 0.0 < sunk / (last.time - first.time) < 1e-6
    assert sunk / (last.time - first.time) == pytest.approx(
        GRAVITY * backend.scene.pair.creep_speed / 0.5 * mass / hand.fingers, rel=0.3
    )


@HANDS
def test_fingers_and_weight_balance_on_a_held_object(hand, shape):
    backend = held(hand, shape, 4.0, 0.2)
    truth = backend.truth()
    on_object = -np.sum([finger.force for finger in truth.fingers], axis=0)
    assert on_object == pytest.approx([0.0, 0.0, 0.2 * GRAVITY], abs=2e-4)
    about = sum(
        np.cross(np.subtract(f.position, truth.position), f.force) + np.array(f.torque) for f in truth.fingers
    )
    assert about == pytest.approx([0.0, 0.0, 0.0], abs=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("friction", [0.3, 0.6])
@pytest.mark.parametrize("mass", [0.2, 0.4])
def test_an_object_slips_when_two_mu_f_no_longer_carries_it(mass, friction):
    """2 mu F = m g: the grip is let down until the object falls."""
    law = GraspContact(stiffness=10e3, friction=friction)
    least = mass * GRAVITY / (2 * friction)
    force = 1.5 * least + 1.0
    backend = held(two_finger_hand(), BOX, force, mass, law)
    while abs(backend.truth().velocity[2]) < 1e-4:
        grips = [normal_force(finger) for finger in backend.truth().fingers]
        force -= 1e-4 * least
        assert force > 0.0
        backend.step(Command(grip_force=(force, force)))
    assert min(grips) == pytest.approx(least, rel=0.01)


@pytest.mark.parametrize(("share", "slips"), [(0.97, False), (1.03, True)])
def test_a_pull_slips_at_coulombs_threshold(share, slips):
    mass = 0.1
    backend = held(two_finger_hand(), BOX, 5.0, mass)
    capacity = 0.5 * sum(normal_force(finger) for finger in backend.truth().fingers)
    pull(backend, (0.0, share * math.sqrt(capacity**2 - (mass * GRAVITY) ** 2), 0.0))
    if slips:
        pull(backend, (0.0, share * capacity, 0.0))
    for _ in range(200):
        backend.step(Command())
    assert (math.hypot(*backend.truth().velocity) > 0.01) == slips


@pytest.mark.slow
@pytest.mark.parametrize("friction", [0.2, 0.5, 1.0])
@pytest.mark.parametrize("angle", np.linspace(0.0, 90.0, 10).tolist())
def test_full_slip_lies_on_the_limit_surface(friction, angle):
    """(f_t / mu f_n)^2 + (torque / mu e f_n)^2 = 1 within 0.5 %, from pulling over mixed to twisting."""
    law = GraspContact(friction=friction)
    backend = held(two_finger_hand(), BOX, 5.0, law=law)
    direction, e = math.radians(angle), law.spin_length
    v, w = 0.02 * math.cos(direction), 0.02 * math.sin(direction) / e
    lead_object(backend)
    at = int(backend.scene.model.joint("object").dofadr[0])
    points = []
    for _ in range(30):
        # the object is led: translating along y, turning about the line of contacts
        backend._data.qvel[at : at + 6] = [0.0, v, 0.0, w, 0.0, 0.0]
        backend.step(Command())
        for finger in backend.truth().fingers:
            f_n, f_t = abs(finger.force[0]), math.hypot(finger.force[1], finger.force[2])
            points.append((f_t / (friction * f_n), abs(finger.torque[0]) / (friction * e * f_n)))
    points = np.array(points[20:])
    assert np.hypot(points[:, 0], points[:, 1]) == pytest.approx(1.0, abs=5e-3)
    # slip is normal to the limit surface: (f_t, torque / e) along (v, e w), but for what the object's sag of some
    # hundredths of a millimetre makes of a turn about its own centre
    assert np.degrees(np.arctan2(points[:, 1], points[:, 0])) == pytest.approx(angle, abs=2.0)


TIPS = {
    "sphere": two_finger_hand().tip,
    "ellipsoid": replace(two_finger_hand().tip, surface=Ellipsoid((0.008, 0.009, 0.012), center=(0, 0, 0.014))),
}


@pytest.mark.parametrize("tip", TIPS.values(), ids=TIPS)
@HANDS
def test_what_each_fingertip_feels_is_what_happens(hand, shape, tip):
    hand = replace(hand, tip=tip)
    backend = held(hand, shape, 4.0, 0.2, GraspContact(stiffness=40e3))
    sample, truth = backend.step(Command()), backend.truth()
    palm = Pose(sample.arm.position_base_tip, sample.arm.rotation_base_tip)
    payload = SensorPayload(tip.mass, tip.center_of_mass)
    sensors = hand.sensor_poses(truth.joint_position)
    for given, finger, sensor in zip(sample.wrenches, truth.fingers, sensors, strict=True):
        wrench = contact_wrench(given.wrench, given.acceleration, payload)
        contact = contact_from_wrench(tip.surface, np.array(wrench))
        pose = palm @ sensor
        rotation = np.array(pose.rotation)
        assert rotation @ contact.force == pytest.approx(finger.force, abs=1e-6)
        centroid = pose.position + rotation @ contact.centroid
        # penetration is F/K = 0.1 mm, of which facts of simulation leave half, sqrt(1 + mu^2) times
        assert centroid == pytest.approx(finger.position, abs=0.07e-3)
        normal = rotation @ contact.normal
        assert normal @ np.subtract(truth.position, finger.position) > 0.0  # into the object
        assert contact.normal_force == pytest.approx(normal_force(finger), rel=2e-3)


@pytest.mark.parametrize("q", [0.0, 0.1, 0.3])
@pytest.mark.parametrize(
    ("hand", "i"), [(hand, i) for hand in (two_finger_hand(), three_finger_hand()) for i in range(hand.fingers)]
)
def test_the_hands_kinematics_are_the_scenes(hand, i, q):
    q *= hand.finger.ratio
    scene = build_grasp_scene(hand, HeldObject(SphereObject(0.01)), palm=(0.1, -0.2, 0.3))
    model, data = scene.model, mujoco.MjData(scene.model)
    data.qpos[model.joint(finger_name(i)).qposadr[0]] = q
    mujoco.mj_kinematics(model, data)
    site = data.site(f"{finger_name(i)}_sensor")
    pose = hand.pose_hand_sensor(i, q)
    assert site.xpos == pytest.approx(np.add(pose.position, (0.1, -0.2, 0.3)), abs=1e-12)
    assert site.xmat.reshape(3, 3) == pytest.approx(np.array(pose.rotation), abs=1e-12)


@pytest.mark.parametrize("hand", [two_finger_hand(), three_finger_hand()])
@pytest.mark.parametrize("q", [0.0, 0.2])
def test_the_lever_is_how_fast_the_tip_closes(hand, q):
    """Virtual work: torque per force is motion per angle."""
    q *= hand.finger.ratio
    step = 1e-6 * hand.finger.ratio

    def radius(q):
        center = hand.pose_hand_sensor(0, q) @ Pose(hand.tip.center_of_mass)
        return math.hypot(*center.position[:2])

    slope = (radius(q - step) - radius(q + step)) / 2e-6
    assert hand.finger.lever(q, hand.tip_along) == pytest.approx(slope, rel=1e-6)
    assert radius(hand.finger.closed(hand.opening, hand.tip_along)) == pytest.approx(0.0, abs=1e-12)


def test_three_fingers_share_evenly():
    fingers = held(three_finger_hand(), SphereObject(0.03), 4.0).truth().fingers
    forces = np.array([finger.force for finger in fingers])
    assert np.ptp(np.hypot(forces[:, 0], forces[:, 1])) < 1e-3
    assert np.ptp(forces[:, 2]) < 1e-3


def test_a_cylinder_is_held_across_its_axis():
    """It lies along x; turned by 90 degrees it lies across the closing direction."""
    across = Pose(rotation=((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
    target = HeldObject(CylinderObject(0.025, 0.06), 0.1, across)
    backend = HandBackend(build_grasp_scene(two_finger_hand(), target, carrier=Lift(), table=Table(-0.025)))
    backend.start()
    press(backend, 3.0, 2.0)
    for _ in range(1000):
        backend.step(Command((0.0, 0.0, 0.02)))
    assert backend.truth().position[2] == pytest.approx(0.02, abs=1e-3)


@pytest.mark.parametrize("step", [0.5, 1.0])
@pytest.mark.parametrize("mass", [0.1, 1.0])
def test_twice_the_largest_contact_step_is_still_sound(mass, step, monkeypatch):
    """What `LARGEST_CONTACT_STEP` leaves in hand: neither noise in a hold nor lift-off in a slip."""
    monkeypatch.setattr("palpate.sim.hand.contact.LARGEST_CONTACT_STEP", 2.0)
    law = GraspContact(stiffness=mass * (step / 1e-3) ** 2)
    backend = held(two_finger_hand(), BOX, 3.0 * mass * GRAVITY, mass, law)
    still = [backend.step(Command()).wrenches[0].wrench[0] for _ in range(200)]
    assert np.std(still) < 1e-6
    capacity = 0.5 * sum(normal_force(finger) for finger in backend.truth().fingers)
    pull(backend, (0.0, 0.0, mass * GRAVITY - 1.2 * capacity))
    for _ in range(40):
        backend.step(Command())
        for finger in backend.truth().fingers:
            assert normal_force(finger) == pytest.approx(capacity, rel=0.5)


@pytest.mark.parametrize("time_step", [0.5e-3, 1e-3])
def test_the_preset_is_that_of_the_facts(time_step):
    pair = grasp_pair_parameters(GraspContact(), 10.0, time_step)
    assert pair.solimp[:2] == (0.5, 0.5)
    assert pair.impratio == 1e6
    assert pair.friction_damping * time_step == pytest.approx(FRICTION_STEP)
    model = build_grasp_scene(two_finger_hand(), HeldObject(BOX), fidelity=Fidelity(time_step)).model
    assert model.opt.noslip_iterations == 0
    assert model.opt.cone == mujoco.mjtCone.mjCONE_ELLIPTIC
    assert model.opt.integrator == mujoco.mjtIntegrator.mjINT_IMPLICITFAST


def test_a_scene_holds_only_what_it_names():
    model = build_grasp_scene(two_finger_hand(), HeldObject(BOX)).model
    assert (model.npair, model.nv, model.nu) == (2, 8, 2)
    assert not model.geom_contype.any()
    assert not model.geom_conaffinity.any()
    target = HeldObject(SphereObject(0.03))
    model = build_grasp_scene(three_finger_hand(), target, carrier=Lift(), table=Table(-0.03)).model
    assert (model.npair, model.nv, model.nu) == (4, 10, 4)
