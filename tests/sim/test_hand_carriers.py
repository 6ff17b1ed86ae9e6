"""A hand on whatever carries it: it starts where it was told, is moved and turned, and holds what it holds."""

import math

import mujoco
import numpy as np
import pytest

from palpate.kinematics.pose import Pose, rotvec_from_rotation, times, transposed
from palpate.runtime.data import Command
from palpate.sensing.compensation import SensorPayload, contact_wrench
from palpate.sim import ArmCarrier, Box, Fixed, Lift, SphereObject, Stage, TurningStage
from palpate.sim.fidelity import GRAVITY
from palpate.sim.hand.backend import HandBackend
from palpate.sim.hand.hand import three_finger_hand, two_finger_hand
from palpate.sim.hand.scene import HeldObject, build_grasp_scene
from palpate.sim.objects.table import Table
from palpate.spatial import IDENTITY, ZERO, cross, subtract

BOX = Box((0.06, 0.05, 0.06))
CARRIERS = {"stage": Stage(), "turning stage": TurningStage(), "arm": ArmCarrier()}
ALL = {"fixed": Fixed(), "lift": Lift(), **CARRIERS}

carriers = pytest.mark.parametrize("carrier", CARRIERS.values(), ids=CARRIERS)
every = pytest.mark.parametrize("carrier", ALL.values(), ids=ALL)
turning = pytest.mark.parametrize("carrier", [CARRIERS["turning stage"], CARRIERS["arm"]], ids=["stage", "arm"])
hands = pytest.mark.parametrize(
    ("hand", "shape"), [(two_finger_hand(), BOX), (three_finger_hand(), SphereObject(0.03))], ids=["two", "three"]
)


def backend_of(carrier, hand=None, shape=BOX, **more):
    scene = build_grasp_scene(
        hand or two_finger_hand(), HeldObject(shape), carrier=carrier, table=Table(-0.03), **more
    )
    backend = HandBackend(scene)
    backend.start()
    return backend


def grip(backend, force=4.0, periods=1500):
    n = backend.scene.hand.fingers
    for _ in range(periods):
        sample = backend.step(Command(grip_force=(force,) * n))
    return sample


def move(backend, periods, velocity=ZERO, rate=ZERO):
    for _ in range(periods):
        sample = backend.step(Command(velocity, angular_velocity_base_tip=rate))
    return sample


def object_in_hand(backend, sample):
    """Where the held object is in the hand frame."""
    truth = backend.truth()
    flat = np.zeros(9)
    mujoco.mju_quat2Mat(flat, truth.quat_wxyz)
    rotation = tuple(map(tuple, flat.reshape(3, 3).tolist()))
    palm = Pose(sample.arm.position_base_tip, sample.arm.rotation_base_tip)
    return palm.inverse() @ Pose(truth.position, rotation)


def slipped(after, before):
    """How far the object has moved and turned in the hand [m, rad]."""
    turn = rotvec_from_rotation(times(after.rotation, transposed(before.rotation)))
    return math.dist(after.position, before.position), math.hypot(*turn)


@every
@hands
def test_it_starts_upright_where_it_was_placed_and_stays_there(carrier, hand, shape):
    """Its weight is known to what carries it: nothing sags, empty or not yet closed."""
    backend = backend_of(carrier, hand, shape)
    sample = move(backend, 500)
    assert sample.arm.position_base_tip == pytest.approx(backend.scene.palm, abs=2e-7)
    assert np.allclose(sample.arm.rotation_base_tip, IDENTITY, atol=2e-6)
    for given in sample.wrenches:
        felt = contact_wrench(
            given.wrench, given.acceleration, SensorPayload(hand.tip.mass, hand.tip.center_of_mass)
        )
        assert felt == pytest.approx((0.0,) * 6, abs=1e-6)


@hands
def test_a_hand_knows_its_mass_and_where_its_centre_is(hand, shape):
    model = build_grasp_scene(hand, HeldObject(shape)).model
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    palm = model.body("palm").id
    assert model.body_subtreemass[palm] == pytest.approx(hand.mass, rel=1e-12)
    center = data.subtree_com[palm] - data.xpos[palm]
    assert center == pytest.approx(hand.center_of_mass, abs=1e-12)


@pytest.mark.slow
@carriers
@hands
def test_a_held_object_is_lifted_moved_and_let_down(carrier, hand, shape):
    backend = backend_of(carrier, hand, shape)
    grip(backend)
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


@turning
def test_a_held_box_turns_with_the_hand_about_itself(carrier):
    """omega x r about the object: it stays where it is, in the hand and in the room, while the hand goes round.

    But for what MuJoCo's friction does not see, as it goes by velocities: omega^2 L dt, 0.1 mm/s here, half of it
    with half the time step. The friction plant goes by poses: see test_hand_friction.
    """
    backend = backend_of(carrier)
    grip(backend, 6.0)
    sample = move(backend, 1500, (0.0, 0.0, 0.02))
    sample = move(backend, 300)
    before, place = object_in_hand(backend, sample), backend.truth().position
    rate = (0.3, 0.2, 0.4)
    for _ in range(1000):
        arm = subtract(sample.arm.position_base_tip, place)
        sample = backend.step(Command(cross(rate, arm), angular_velocity_base_tip=rate))
    turned = rotvec_from_rotation(sample.arm.rotation_base_tip)
    assert math.hypot(*turned) > 0.5
    assert math.dist(backend.truth().position, place) < 0.5e-3
    moved, turn = slipped(object_in_hand(backend, sample), before)
    assert moved < 0.2e-3
    assert turn < 5e-3


@turning
@hands
def test_a_turned_hand_does_not_sag_and_its_sensors_feel_nothing(carrier, hand, shape):
    """The carrier lifts the load at its centre of mass, whichever way it hangs; fingers may give way."""
    backend = backend_of(carrier, hand, shape, palm=(0.0, 0.0, 0.3))
    sample = move(backend, 1000, rate=(0.6, -0.3, 0.2))
    at_rest = move(backend, 300)
    later = move(backend, 300)
    assert math.dist(at_rest.arm.position_base_tip, (0.0, 0.0, 0.3)) < 20e-6
    assert math.dist(at_rest.arm.position_base_tip, later.arm.position_base_tip) < 1e-6
    turned = times(at_rest.arm.rotation_base_tip, transposed(later.arm.rotation_base_tip))
    assert math.hypot(*rotvec_from_rotation(turned)) < 1e-5
    assert np.abs(rotvec_from_rotation(sample.arm.rotation_base_tip)).max() > 0.4
    for given in later.wrenches:
        felt = contact_wrench(
            given.wrench, given.acceleration, SensorPayload(hand.tip.mass, hand.tip.center_of_mass)
        )
        assert felt == pytest.approx((0.0,) * 6, abs=1e-4)


@every
def test_closing_stops_it_and_drops_nothing(carrier):
    backend = backend_of(carrier)
    with backend:
        grip(backend)
        if not isinstance(carrier, Fixed):
            move(backend, 500, (0.0, 0.0, 0.02))
    backend.close()
    sample = move(backend, 300)
    height = backend.truth().position[2]
    sample = move(backend, 500)
    assert backend.truth().position[2] == pytest.approx(height, abs=1e-6)
    assert sample.arm.velocity_base_tip == pytest.approx(ZERO, abs=1e-7)
    assert all(finger.touching for finger in backend.truth().fingers)


def test_an_arm_with_a_hand_tells_its_joints():
    backend = backend_of(ArmCarrier())
    assert len(grip(backend, periods=1).arm.joint_position) == 6
