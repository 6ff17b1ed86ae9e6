"""A hand on its carrier: kinematics, mass, what it does at rest, in motion, under load, and its samples."""

import math

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.kinematics.pose import Pose, rotvec_from_rotation
from palpate.kinematics.servo_model import PULSE
from palpate.runtime.data import Command
from palpate.sensing.compensation import SensorPayload, contact_wrench
from palpate.sim import ArmCarrier, Fixed, Lift, SphereObject, Stage, TurningStage
from palpate.sim.fidelity import GRAVITY
from palpate.sim.friction.law import FrictionLaw
from palpate.sim.hand.backend import HandBackend
from palpate.sim.hand.hand import finger_name, three_finger_hand, two_finger_hand
from palpate.sim.hand.hand_file import HANDS, HandFile
from palpate.sim.hand.load import NO_LOAD, LoadDrive, RampLoad, ShakenLoad, SumOfLoads
from palpate.sim.hand.scene import OBJECT, HeldObject, build_grasp_scene
from palpate.sim.hand.turning_hand import TurningHand, sideways_name, turning_hand
from palpate.sim.sensor.model import white_noise
from palpate.sim.tip import Tip
from palpate.spatial import IDENTITY, ZERO, cross, subtract
from palpate.surfaces import Sphere
from support.held_object import BOX, object_in_hand, press, slipped, standing, wrench_of_fingers
from support.simulated import angle_between, move

BALL = SphereObject(0.03)
TWO, THREE, SIDEWAYS = two_finger_hand(), three_finger_hand(), turning_hand()
INDEX = HandFile(HANDS / "pinch-and-index.xml", ("index_sensor", "left_sensor", "right_sensor")).read(
    [Tip(Sphere(0.008), mass=0.015)] * 3
)
PALM = (0.1, -0.2, 0.3)
CARRIERS = {
    "fixed": Fixed(),
    "lift": Lift(),
    "stage": Stage(),
    "turning stage": TurningStage(),
    "arm": ArmCarrier(),
}
QUARTER_ABOUT_X = ((1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0))
GROWING = RampLoad((0.0, 0.0, 0.0), (0.0, 0.3, -2.0), 1.2, 0.2, point=(0.0, 0.004, 0.01))

ARM, TURNING = CARRIERS["arm"], CARRIERS["turning stage"]
hands = pytest.mark.parametrize(("hand", "shape"), [(TWO, BOX), (THREE, BALL)], ids=["two", "three"])


def pairs(*names):
    """Carriers with hands of two and three fingers by turns, the arm with both."""
    rows = [(CARRIERS[name], *((TWO, BOX) if i % 2 else (THREE, BALL))) for i, name in enumerate(names)]
    return pytest.mark.parametrize(
        ("carrier", "hand", "shape"), [*rows, (ARM, TWO, BOX)], ids=[*names, "arm, two"]
    )


def contact_wrenches(sample, hand):
    """Wrenches of a sample without the tips' weight and inertia."""
    payload = SensorPayload(hand.tip.mass, hand.tip.center_of_mass)
    return np.array([contact_wrench(each.wrench, each.acceleration, payload) for each in sample.wrenches])


JOINTS = {
    "two": (TWO, [finger_name(i) for i in range(2)]),
    "three": (THREE, [finger_name(i) for i in range(3)]),
    "sideways": (SIDEWAYS, [name(i) for name in (finger_name, sideways_name) for i in range(3)]),
    "two sideways": (TurningHand(fingers=2), [name(i) for name in (finger_name, sideways_name) for i in range(2)]),
    "from a file": (INDEX, [name for i in range(3) for name in INDEX.joint_names(i)]),
}
MODELS = {
    name: build_grasp_scene(hand, HeldObject(SphereObject(0.01), 0.2), palm=PALM).model
    for name, (hand, _) in JOINTS.items()
}


@settings(max_examples=30, deadline=None)
@given(st.sampled_from(list(JOINTS)), st.lists(st.floats(0.0, 1.0), min_size=6, max_size=6))
def test_the_kinematics_of_a_hand_are_its_scenes(name, shares):
    hand, joints = JOINTS[name]
    model, data = MODELS[name], mujoco.MjData(MODELS[name])
    ranges = np.array(
        [model.joint(joint).range if model.joint(joint).limited else (-0.3, 0.3) for joint in joints]
    )
    q = ranges[:, 0] + np.array(shares[: len(joints)]) * np.ptp(ranges, axis=1)
    for joint, position in zip(joints, q, strict=True):
        data.joint(joint).qpos[0] = position
    mujoco.mj_kinematics(model, data)
    poses = hand.sensor_poses((*q.tolist(), 0.3, 0.4) if name in ("two", "three") else tuple(q.tolist()))
    for i, pose in enumerate(poses):
        site = data.site(f"finger{i}_sensor")
        assert site.xpos == pytest.approx(np.add(pose.position, PALM), abs=1e-12)
        assert site.xmat.reshape(3, 3) == pytest.approx(np.array(pose.rotation), abs=1e-12)


@pytest.mark.parametrize("name", ["two", "three", "sideways", "two sideways"])
def test_a_hand_knows_its_mass_and_its_centre_of_mass(name):
    (hand, _), model = JOINTS[name], MODELS[name]
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    palm = model.body("palm").id
    assert model.body_subtreemass[palm] == pytest.approx(hand.mass, rel=1e-12)
    assert data.subtree_com[palm] - data.xpos[palm] == pytest.approx(hand.center_of_mass, abs=1e-12)
    # palm, six servos, racks, fingers, tips
    assert SIDEWAYS.mass == pytest.approx(0.05 + 6 * 0.018 + 3 * (0.03 + 0.03 + 0.015))


@pytest.mark.parametrize("hand", [TWO, THREE])
@pytest.mark.parametrize("q", [0.0, 0.2])
def test_the_lever_is_how_fast_the_tip_closes(hand, q):
    """Virtual work: torque per force is motion per angle."""
    ratio = hand.finger.ratio

    def radius(q):
        return math.hypot(*(hand.pose_hand_sensor(0, q) @ Pose(hand.tip.center_of_mass)).position[:2])

    slope = (radius((q - 1e-6) * ratio) - radius((q + 1e-6) * ratio)) / 2e-6
    assert hand.finger.lever(q * ratio, hand.tip_along) == pytest.approx(slope, rel=1e-6)
    assert radius(hand.finger.closed(hand.opening, hand.tip_along)) == pytest.approx(0.0, abs=1e-12)


@pairs("fixed", "lift", "stage", "turning stage", "arm")
def test_a_hand_starts_upright_where_it_was_placed_and_does_not_sag(carrier, hand, shape):
    backend = standing(hand, shape, carrier=carrier)
    sample = move(backend, 500)
    assert sample.arm.position_base_tip == pytest.approx(backend.scene.palm, abs=2e-7)
    assert len(sample.arm.joint_position) == (6 if carrier is ARM else 0)
    assert np.allclose(sample.arm.rotation_base_tip, IDENTITY, atol=2e-6)
    assert contact_wrenches(sample, hand) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.slow
@pairs("stage", "turning stage", "arm")
def test_a_held_object_is_lifted_and_moved_and_stays_when_the_back_end_closes(carrier, hand, shape):
    with standing(hand, shape, carrier=carrier) as backend:
        press(backend, 4.0, 1.5)
        sample = move(backend, 500, (0.0, 0.0, 0.02))
        before, start = object_in_hand(backend, sample), sample.arm.position_base_tip
        move(backend, 500, (0.03, -0.02, 0.02))
        sample = move(backend, 300)
        assert np.subtract(sample.arm.position_base_tip, start) == pytest.approx((0.015, -0.01, 0.01), abs=1.2e-3)
        moved, turned = slipped(object_in_hand(backend, sample), before)
        assert moved < 0.05e-3
        assert turned < 2e-3
        on_object = -np.sum([finger.force for finger in backend.truth().fingers], axis=0)
        assert on_object == pytest.approx([0.0, 0.0, 0.1 * GRAVITY], abs=2e-3)
        move(backend, 100, (0.0, 0.0, 0.02))
        grip = math.hypot(*backend.truth().fingers[0].force[:2])
    backend.close()
    move(backend, 300)
    height = backend.truth().position[2]
    sample = move(backend, 500)
    assert backend.truth().position[2] == pytest.approx(height, abs=1e-6)
    assert sample.arm.velocity_base_tip == pytest.approx(ZERO, abs=1e-7)
    assert math.hypot(*backend.truth().fingers[0].force[:2]) == pytest.approx(grip, rel=0.01)


@pytest.mark.parametrize(
    ("carrier", "friction"),
    [(TURNING, None), (ARM, None), (TURNING, FrictionLaw(0.5, 0.5, spin_length=0.004, stiffness=5e3))],
    ids=["stage", "arm", "stage, plant"],
)
def test_a_held_box_turns_with_the_hand_about_itself(carrier, friction):
    """omega x r about the object: it stays where it is, in the hand and in the room, while the hand turns.

    MuJoCo's friction goes by velocities and misses omega^2 L dt, 0.1 mm/s here. The plant goes by poses: turned
    back, the bristles return it to where it was.
    """
    backend = standing(carrier=carrier, friction=friction)
    press(backend, 6.0, 1.5)
    move(backend, 1500, (0.0, 0.0, 0.02))
    sample = move(backend, 300)
    before, place = object_in_hand(backend, sample), backend.truth().position
    for sign in (1.0,) if friction is None else (1.0, -1.0):
        rate = (sign * 0.3, sign * 0.2, sign * 0.4)
        for _ in range(1000):
            lever = subtract(sample.arm.position_base_tip, place)
            sample = backend.step(Command(cross(rate, lever), angular_velocity_base_tip=rate))
        if sign > 0.0:
            assert math.hypot(*rotvec_from_rotation(sample.arm.rotation_base_tip)) > 0.5
    if friction is None:
        assert math.dist(backend.truth().position, place) < 0.5e-3
    else:
        sample = move(backend, 500)
    moved, turned = slipped(object_in_hand(backend, sample), before)
    assert moved < (0.2e-3 if friction is None else 20e-6)
    assert turned < (5e-3 if friction is None else 1e-3)


@pairs("turning stage", "arm")
def test_a_turned_hand_does_not_sag_and_its_sensors_feel_nothing(carrier, hand, shape):
    """The carrier lifts the load at its centre of mass, however it hangs; fingers may give way."""
    backend = standing(hand, shape, carrier=carrier, palm=(0.0, 0.0, 0.3))
    move(backend, 1000, rate=(0.6, -0.3, 0.2))
    at_rest, later = move(backend, 300), move(backend, 300)
    assert math.dist(at_rest.arm.position_base_tip, (0.0, 0.0, 0.3)) < 20e-6
    assert math.dist(at_rest.arm.position_base_tip, later.arm.position_base_tip) < 1e-6
    assert angle_between(at_rest.arm.rotation_base_tip, later.arm.rotation_base_tip) < 1e-5
    assert np.abs(rotvec_from_rotation(later.arm.rotation_base_tip)).max() > 0.4
    assert contact_wrenches(later, hand) == pytest.approx(0.0, abs=1e-4)


def test_the_lift_follows_a_ramp_with_the_lag_of_its_servo():
    backend = standing()
    sample = move(backend, 500, (0.0, 0.0, 0.02))
    rise = sample.arm.position_base_tip[2] - backend.scene.palm[2]
    assert 0.02 * sample.time - rise == pytest.approx(0.02 * 2.0 / Lift().bandwidth, abs=5e-5)
    assert sample.arm.velocity_base_tip == pytest.approx((0.0, 0.0, 0.02), abs=1e-6)


def test_fingers_do_not_share_their_noise():
    backend = standing(sensor=white_noise(0.01, 1e-4))
    noise = [[each.wrench[0] for each in backend.step(Command()).wrenches] for _ in range(500)]
    assert abs(np.corrcoef(np.array(noise).T)[0, 1]) < 0.2


@pytest.mark.parametrize("periods", [1, 5])
def test_the_truth_is_that_of_its_sample(periods):
    backend = HandBackend(standing().scene, periods * 1e-3)
    for k in range(50):
        sample = backend.step(Command(grip_force=(1.0, 1.0))) if k else backend.start()
        assert backend.truth().time == sample.time == pytest.approx(k * backend.period)


@hands
def test_joint_positions_are_as_fine_and_as_old_as_encoder_and_bus_make_them(hand, shape):
    backend = standing(hand, shape)
    samples = [backend.step(Command(grip_force=(2.0,) * hand.fingers)) for _ in range(1000)]
    steps = [q / (PULSE * hand.finger.ratio) for sample in samples for q in sample.hand.joint_position]
    assert steps == pytest.approx(np.round(steps), abs=1e-9)
    assert max(steps) > 2
    ages = {round((sample.time - sample.hand.time) / backend.period) for sample in samples}
    assert ages == set(range(round(hand.bus_period / backend.period)))


# --- loads ---


@given(st.floats(0.0, 1.0), st.floats(0.0, 0.3))
def test_a_ramp_never_leaves_the_line_from_its_beginning_to_its_end(time, duration):
    load = RampLoad((0.0, 0.0, -0.5), (1.0, 0.0, -4.0), 0.2, duration)
    share = load.force(time)[0]
    assert 0.0 <= share <= 1.0
    assert load.force(time)[2] == pytest.approx(-0.5 - 3.5 * share)
    assert share == (0.0 if time < 0.2 else 1.0 if time - 0.2 >= duration else share)


def test_a_shaken_load_has_no_mean_and_ends():
    load = ShakenLoad((0.0, 2.0, 0.0), 5.0, begin=0.1, end=1.1)
    forces = np.array([load.force(t) for t in np.arange(0.1, 1.1, 1e-3)])
    assert forces.mean(axis=0) == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)
    assert np.abs(forces).max() == pytest.approx(2.0, rel=1e-3)
    assert load.force(0.05) == load.force(1.1) == (0.0, 0.0, 0.0)


def test_a_load_keeps_its_direction_while_its_lever_turns_and_loads_add():
    hook = RampLoad((0.0, 0.0, -1.0), (0.0, 0.0, -1.0), 0.0, 0.0, point=(0.0, -0.01, 0.0))
    assert hook.wrench(1.0, IDENTITY) == pytest.approx((0.0, 0.0, -1.0, 0.01, 0.0, 0.0))
    assert hook.wrench(1.0, QUARTER_ABOUT_X) == pytest.approx((0.0, 0.0, -1.0, 0.0, 0.0, 0.0))
    both = SumOfLoads((GROWING, ShakenLoad((0.0, 1.0, 0.0), 3.0, point=(0.01, 0.0, 0.0))))
    one, other = (load.wrench(1.33, QUARTER_ABOUT_X) for load in both.loads)
    assert both.wrench(1.33, QUARTER_ABOUT_X) == pytest.approx(np.add(one, other))
    assert SumOfLoads(()).wrench(0.0, IDENTITY) == NO_LOAD


@pytest.mark.parametrize("friction", [None, FrictionLaw(0.5, 0.5, spin_length=0.004, stiffness=5e3)])
def test_fingers_carry_weight_and_load(friction):
    """Force and moment about the object's origin, off centre; through the plant's loads as well."""
    backend = standing(load=GROWING, friction=friction)
    press(backend, 8.0, 0.1)
    move(backend, 300, (0.0, 0.0, 0.02))
    assert backend.pull == pytest.approx(NO_LOAD)
    move(backend, 1000)
    truth, load = backend.truth(), np.array(backend.pull)
    assert truth.position[2] > 0.003  # off the table
    assert load[:3] == pytest.approx([0.0, 0.3, -2.0])
    # the object passes on to the fingers the loads that act on it
    rest = np.add(wrench_of_fingers(truth) - load, [0.0, 0.0, 0.1 * GRAVITY, 0.0, 0.0, 0.0])
    assert np.all(np.abs(rest) <= np.repeat([5e-3, 5e-5], 3))
    assert abs(load[3]) > 5e-3


def test_a_load_acts_about_the_centre_of_mass_wherever_the_frame_is():
    """A free body with its frame off its centre: a force at that frame's origin turns it all the same."""
    text = """<mujoco><option gravity="0 0 0"/><worldbody><body name="object"><freejoint/>
        <inertial pos="0.1 0 0" mass="2" diaginertia="0.01 0.02 0.03"/></body></worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    drive = LoadDrive(RampLoad((0.0, 0.0, 0.0), (0.0, 1.5, 0.0), 0.0, 0.0), model, data, OBJECT)
    assert drive.last == NO_LOAD
    drive.advance()
    mujoco.mj_forward(model, data)
    # about the centre of mass the moment of a force at (-0.1, 0, 0) from it is -0.15 about z
    assert data.qacc[5] == pytest.approx(-0.1 * 1.5 / 0.03)
    assert drive.last == pytest.approx((0.0, 1.5, 0.0, 0.0, 0.0, 0.0))


def test_a_load_that_is_too_much_drops_the_object():
    """2 mu F carries 3.5 N of weight and load, not 13, gear friction (`Hand.grip_band`) included."""
    for most, falls in ((2.5, False), (12.0, True)):
        backend = standing(load=RampLoad((0.0, 0.0, 0.0), (0.0, 0.0, -most), 1.2, 0.2))
        press(backend, 4.0, 0.5)
        move(backend, 300, (0.0, 0.0, 0.02))
        move(backend, 600)
        assert (backend.truth().position[2] < 1e-3) == falls  # back on the table, or lifted
