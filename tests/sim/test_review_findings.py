"""What a review of the simulated back ends found: absurd commands, foreign states, targets on several joints."""

import math

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.errors import InvalidValueError
from palpate.runtime import Command
from palpate.sim import (
    ArmCarrier,
    Box,
    ContactLaw,
    Fixed,
    Lift,
    MujocoBackend,
    SphereObject,
    Stage,
    Tip,
    TurningStage,
    build_scene,
)
from palpate.sim.friction.law import FrictionLaw
from palpate.sim.hand.backend import HandBackend
from palpate.sim.hand.hand import two_finger_hand
from palpate.sim.hand.scene import HeldObject, build_grasp_scene
from palpate.sim.objects.motion import DrivenJoint, JointKind, MovingTarget, Sine
from palpate.surfaces import Sphere

TIP = Tip(Sphere(0.008))
ABOVE = (0.0, 0.0, 0.06)


def on(carrier, friction=None):
    return MujocoBackend(build_scene(TIP, SphereObject(0.04), ContactLaw(), ABOVE, carrier, friction=friction))


def hand_on(carrier, friction=None):
    held = HeldObject(Box((0.06, 0.05, 0.06)))
    return HandBackend(build_grasp_scene(two_finger_hand(), held, carrier=carrier, friction=friction))


ABSURD = [
    Command((math.nan, 0.0, 0.0)),
    Command((0.0, 0.0, -math.inf)),
    Command((1e9, 0.0, 0.0)),
    Command(angular_velocity_base_tip=(0.0, math.nan, 0.0)),
    Command(angular_velocity_base_tip=(math.inf, -math.inf, 0.0)),
]


@pytest.mark.parametrize("command", ABSURD, ids=repr)
@pytest.mark.parametrize(
    ("make", "carrier"),
    [
        *((on, carrier) for carrier in (Stage(), TurningStage(), ArmCarrier(), Lift())),
        *((hand_on, carrier) for carrier in (Stage(), TurningStage(), ArmCarrier(), Lift(), Fixed())),
    ],
)
def test_an_absurd_command_is_refused_and_leaves_no_trace(make, carrier, command):
    """MuJoCo sends servos whose reference is no number to 0: the tip would jump back to where it started."""
    backend, undisturbed = make(carrier), make(carrier)
    move = Command() if isinstance(carrier, Fixed) else Command((0.0, 0.0, 0.01))
    for each in (backend, undisturbed):
        each.start()
        for _ in range(20):
            each.step(move)
    with pytest.raises(InvalidValueError, match=r"velocity_base_tip = .*must be numbers, all together below"):
        backend.step(command)
    assert [backend.step(move) for _ in range(5)] == [undisturbed.step(move) for _ in range(5)]


@pytest.mark.parametrize("make", [on, hand_on])
def test_a_state_with_other_friction_is_refused(make):
    """The simulations are of one size: bristles would stay as they were, stretched by another run."""
    plain, rubbing = make(TurningStage()), make(TurningStage(), FrictionLaw(stiffness=2e3))
    plain.start()
    rubbing.start()
    with pytest.raises(InvalidValueError, match="MuJoCo's own friction, this one has a friction plant"):
        rubbing.restore(plain.snapshot())
    with pytest.raises(InvalidValueError, match="a friction plant, this one has none"):
        plain.restore(rubbing.snapshot())


@pytest.mark.parametrize("friction", [None, FrictionLaw()], ids=["mujoco", "plant"])
def test_a_scene_in_which_nothing_can_move_is_refused_with_what_to_take(friction):
    with pytest.raises(InvalidValueError, match="neither can move.*take a carrier that moves, or an object"):
        build_scene(TIP, SphereObject(), ContactLaw(), ABOVE, Fixed(), friction=friction)


directions = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: math.hypot(*v) > 0.1)
motions = st.builds(Sine, st.floats(0.005, 0.1), st.floats(0.2, 3.0), st.floats(-3.0, 3.0))
joints = st.builds(
    DrivenJoint, st.sampled_from(JointKind), directions, motions, st.tuples(*[st.floats(-0.1, 0.1)] * 3)
)


@settings(max_examples=25, deadline=None)
@given(st.lists(joints, min_size=1, max_size=3))
def test_a_target_accelerates_as_told_whatever_its_joints_do_to_one_another(joints):
    """What it was told is what contacts reckon with: neither inertia that axes share nor centrifugal forces."""
    backend = MujocoBackend(build_scene(TIP, MovingTarget(Box(), joints), ContactLaw(), (0.0, 0.0, 0.5)))
    backend.start()
    model, data = backend.scene.model, backend._data
    dofs = [int(model.joint(f"object_{i}").dofadr[0]) for i in range(len(joints))]
    for _ in range(5):
        for _ in range(30):
            backend.step(Command())
        backend._target.place()
        mujoco.mj_forward(model, data)
        _, velocity, acceleration = np.transpose([joint.motion.at(data.time) for joint in joints])
        assert np.allclose(data.qvel[dofs], velocity, rtol=0, atol=0)
        assert np.allclose(data.qacc[dofs], acceleration, rtol=0, atol=1e-4 * (1.0 + np.abs(acceleration).max()))
