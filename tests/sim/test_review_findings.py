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
    Mount,
    MujocoBackend,
    ObjectBody,
    SphereObject,
    Stage,
    Table,
    Tip,
    TurningStage,
    build_scene,
)
from palpate.sim.friction.law import FrictionLaw
from palpate.sim.friction.pairs import FrictionPair
from palpate.sim.friction.plant import FrictionContact
from palpate.sim.friction.resultant import resultant
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


@pytest.mark.parametrize(
    ("make", "carrier", "command"),
    [
        *zip([on] * 5, (Stage(), TurningStage(), ArmCarrier(), Lift(), ArmCarrier()), ABSURD, strict=True),
        *zip([hand_on] * 5, (Lift(), Fixed(), TurningStage(), Stage(), ArmCarrier()), ABSURD, strict=True),
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


def test_what_would_start_inside_something_else_is_refused_with_where_to_put_it():
    """A block half inside its table was shot 80 mm up, and nobody was told."""
    law, above, table = ContactLaw(stiffness=10e3), (0.0, 0.0, 0.2), Table(top=0.01)
    for shape, height in ((Box((0.06, 0.06, 0.04)), 0.03), (SphereObject(0.03), 0.04)):

        def standing(z, shape=shape):
            return ObjectBody(shape, 0.5, mount=Mount.FREE, position=(0.0, 0.0, z))

        with pytest.raises(
            InvalidValueError, match=rf"z = 0.02 m: .* inside the table.*put it at z = {height:g} m"
        ):
            build_scene(TIP, standing(0.02), law, above, table=table)
        backend = MujocoBackend(build_scene(TIP, standing(height), law, above, table=table))
        backend.start()
        for _ in range(300):
            backend.step(Command())
            assert backend.truth().pose_base_object.position[2] <= height + 1e-9
    with pytest.raises(
        InvalidValueError, match=r"start = .*0.01 m inside the object.*highest point is at z = 0.04 m"
    ):
        build_scene(TIP, SphereObject(0.04), law, (0.0, 0.0, 0.03))


def rubbing_at(position, normal, pressed, tangential, spin):
    pair = FrictionPair("tip", "object", FrictionLaw())
    return FrictionContact(pair, position, normal, pressed, tangential, spin, (0.0, 0.0, 0.0), 0.0, True)


vectors = st.tuples(*[st.floats(-1.0, 1.0)] * 3)
rubbing = st.builds(
    rubbing_at,
    vectors,
    vectors.filter(lambda v: math.hypot(*v) > 0.1).map(
        lambda v: tuple((np.array(v) / np.linalg.norm(v)).tolist())
    ),
    st.floats(0.1, 10.0),
    vectors,
    st.floats(-0.1, 0.1),
)


@settings(max_examples=50, deadline=None)
@given(st.lists(rubbing, min_size=1, max_size=5))
def test_a_resultant_does_to_a_body_what_all_its_contacts_do(contacts):
    """The same force, and the same moment about the origin (Varignon); at the centroid of what presses."""
    position, force, torque = (np.array(part) for part in resultant(contacts))
    forces = [np.array(c.tangential_force) - c.normal_force * np.array(c.normal) for c in contacts]
    moments = [
        np.cross(c.position, f) + c.spin_torque * np.array(c.normal) for c, f in zip(contacts, forces, strict=True)
    ]
    assert np.allclose(force, np.sum(forces, axis=0), rtol=0, atol=1e-12)
    assert np.allclose(np.cross(position, force) + torque, np.sum(moments, axis=0), rtol=0, atol=1e-12)
    pressed = [c.normal_force for c in contacts]
    assert np.allclose(position, np.average([c.position for c in contacts], axis=0, weights=pressed), atol=1e-12)


directions = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: math.hypot(*v) > 0.1)
motions = st.builds(Sine, st.floats(0.005, 0.1), st.floats(0.2, 3.0), st.floats(-3.0, 3.0))
joints = st.builds(
    DrivenJoint, st.sampled_from(JointKind), directions, motions, st.tuples(*[st.floats(-0.1, 0.1)] * 3)
)


@settings(max_examples=25, deadline=None)
@given(st.lists(joints, min_size=1, max_size=3))
def test_a_target_accelerates_as_prescribed_whatever_its_joints_do_to_one_another(joints):
    """What it was told is what contacts reckon with: neither inertia that axes share nor centrifugal forces."""
    backend = MujocoBackend(build_scene(TIP, MovingTarget(Box(), joints), ContactLaw(), (0.0, 0.0, 0.5)))
    backend.start()
    model, data = backend.scene.model, backend._data
    dofs = [int(model.joint(f"object_{i}").dofadr[0]) for i in range(len(joints))]
    for _ in range(5):
        for _ in range(30):
            backend.step(Command())
        for placer in backend._placers:
            placer.place()
        mujoco.mj_forward(model, data)
        _, velocity, acceleration = np.transpose([joint.motion.at(data.time) for joint in joints])
        assert np.allclose(data.qvel[dofs], velocity, rtol=0, atol=0)
        assert np.allclose(data.qacc[dofs], acceleration, rtol=0, atol=1e-4 * (1.0 + np.abs(acceleration).max()))
