"""What pulls at a held object: what it is as a function of time, that it acts as told, and that runs repeat."""

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.runtime.data import Command
from palpate.sim import Box, Lift
from palpate.sim.fidelity import GRAVITY
from palpate.sim.friction.law import FrictionLaw
from palpate.sim.hand.backend import HandBackend
from palpate.sim.hand.hand import two_finger_hand
from palpate.sim.hand.load import NO_LOAD, LoadDrive, RampLoad, ShakenLoad, SumOfLoads
from palpate.sim.hand.scene import OBJECT, HeldObject, build_grasp_scene
from palpate.sim.objects.table import Table
from palpate.spatial import IDENTITY

BOX = HeldObject(Box((0.06, 0.05, 0.06)), 0.1)
MUJOCO = build_grasp_scene(two_finger_hand(), BOX, carrier=Lift(), table=Table(-0.03))
BRISTLES = build_grasp_scene(
    two_finger_hand(),
    BOX,
    carrier=Lift(),
    table=Table(-0.03),
    friction=FrictionLaw(0.5, 0.5, spin_length=0.004, stiffness=5e3),
)
SCENES = pytest.mark.parametrize("scene", [MUJOCO, BRISTLES], ids=["MuJoCo's friction", "friction plant"])
QUARTER_ABOUT_X = ((1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0))
GROWING = RampLoad((0.0, 0.0, 0.0), (0.0, 0.3, -2.0), 1.2, 0.2, point=(0.0, 0.004, 0.01))


def gripped(scene, load, force=8.0, periods=1200):
    backend = HandBackend(scene, load=load)
    backend.start()
    for _ in range(periods):
        backend.step(Command((0.0, 0.0, 0.02 if backend.truth().time > 0.9 else 0.0), grip_force=(force, force)))
    return backend


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


def test_a_weight_on_a_hook_turns_no_more_when_it_hangs_below():
    """The force keeps its direction, its lever turns with the object."""
    load = RampLoad((0.0, 0.0, -1.0), (0.0, 0.0, -1.0), 0.0, 0.0, point=(0.0, -0.01, 0.0))
    assert load.wrench(1.0, IDENTITY) == pytest.approx((0.0, 0.0, -1.0, 0.01, 0.0, 0.0))
    assert load.wrench(1.0, QUARTER_ABOUT_X) == pytest.approx((0.0, 0.0, -1.0, 0.0, 0.0, 0.0))


def test_loads_add():
    both = SumOfLoads((GROWING, ShakenLoad((0.0, 1.0, 0.0), 3.0, point=(0.01, 0.0, 0.0))))
    one, other = (load.wrench(1.33, QUARTER_ABOUT_X) for load in both.loads)
    assert both.wrench(1.33, QUARTER_ABOUT_X) == pytest.approx(np.add(one, other))
    assert SumOfLoads(()).wrench(0.0, IDENTITY) == NO_LOAD


@SCENES
def test_fingers_bear_weight_and_load(scene):
    """Force and moment about the object's origin, as told, off centre; through the plant's loads as well."""
    backend = gripped(scene, GROWING)
    assert backend.pull == pytest.approx(NO_LOAD)
    for _ in range(1000):
        backend.step(Command())
    truth, pull = backend.truth(), np.array(backend.pull)
    assert pull[:3] == pytest.approx([0.0, 0.3, -2.0])
    force = sum(np.array(finger.force) for finger in truth.fingers)
    moment = sum(
        np.cross(np.subtract(finger.position, truth.position), finger.force) + np.array(finger.torque)
        for finger in truth.fingers
    )
    assert truth.position[2] > 0.003  # off the table
    # what the object exerts on the fingers is what acts on it
    assert force == pytest.approx([*pull[:2], pull[2] - 0.1 * GRAVITY], abs=5e-3)
    assert moment == pytest.approx(pull[3:], abs=5e-5)
    assert abs(pull[3]) > 5e-3


def test_it_acts_about_the_centre_of_mass_wherever_the_frame_is():
    """A free body with its frame off its centre: a force at that frame's origin turns it all the same."""
    spec = mujoco.MjSpec()
    spec.option.gravity = [0.0, 0.0, 0.0]
    body = spec.worldbody.add_body(name=OBJECT)
    body.add_freejoint()
    body.explicitinertial = True
    body.mass, body.ipos, body.inertia = 2.0, [0.1, 0.0, 0.0], [0.01, 0.02, 0.03]
    model = spec.compile()
    data = mujoco.MjData(model)
    drive = LoadDrive(RampLoad((0.0, 0.0, 0.0), (0.0, 1.5, 0.0), 0.0, 0.0), model, data, OBJECT)
    drive.advance()
    mujoco.mj_forward(model, data)
    # about the centre of mass the moment of a force at (-0.1, 0, 0) from it is -0.15 about z
    assert data.qacc[5] == pytest.approx(-0.1 * 1.5 / 0.03)
    assert drive.last == pytest.approx((0.0, 1.5, 0.0, 0.0, 0.0, 0.0))


def test_a_load_that_is_too_much_drops_the_object():
    """2 mu F bears 3.5 N of weight and load, not 13, gear friction (`Hand.grip_band`) included."""
    for most, falls in ((2.5, False), (12.0, True)):
        backend = gripped(MUJOCO, RampLoad((0.0, 0.0, 0.0), (0.0, 0.0, -most), 1.2, 0.2), 4.0)
        for _ in range(600):
            backend.step(Command())
        assert (backend.truth().position[2] < 1e-3) == falls  # back on the table, or lifted
