"""Objects in scenes: moving, free, sprung and several at once; their forces, poses and permitted starts."""

import math

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.errors import InvalidValueError
from palpate.runtime import Command
from palpate.sim import (
    Box,
    ContactLaw,
    Mount,
    ObjectBody,
    SphereObject,
    SprungTarget,
    Stage,
    Table,
    Tip,
    Torus,
    build_scene,
)
from palpate.sim.fidelity import GRAVITY
from palpate.sim.friction.law import FrictionLaw
from palpate.sim.friction.pairs import FrictionPair
from palpate.sim.friction.plant import FrictionContact
from palpate.sim.friction.resultant import resultant
from palpate.sim.objects.fixed_pieces import FixedPieces
from palpate.sim.objects.motion import DrivenJoint, JointKind, MovingTarget, Ramp, Sine
from palpate.sim.objects.posed import PosedGeom
from palpate.surfaces import Sphere
from support.simulated import move, started

RADIUS = 0.008

TIP = Tip(Sphere(RADIUS))

PLATE = Box((0.2, 0.2, 0.02))

PRESSED = (0.03, 0.0, 0.01 + RADIUS - 1e-4)
"""Where a tip presses on the plate, beside its middle."""


def driven(kind, axis, motion):
    """A plate that one joint moves."""
    return MovingTarget(PLATE, [DrivenJoint(kind, axis, motion)])


def ratio(backend):
    """Tangential over normal force of a tip on a level surface, as a vector (x, y)."""
    x, y, z = backend.truth().force
    return np.array([x, y]) / z


def block(mass=0.5, friction=0.1, size=(0.06, 0.06, 0.04)):
    return ObjectBody(Box(size), mass, friction, mount=Mount.FREE, position=(0.0, 0.0, size[2] / 2))


def pushing(mass=0.5, mu=0.3, friction=None):
    """A block on a table, the tip just behind it."""
    law, start = ContactLaw(stiffness=5e3), (-0.03 - RADIUS - 5e-4, 0.0, 0.015)
    return started(build_scene(TIP, block(mass), law, start, friction=friction, table=Table(friction=mu)))


@pytest.mark.parametrize("friction", [None, FrictionLaw()], ids=["mujoco", "plant"])
@pytest.mark.parametrize(
    ("target", "direction"),
    [
        (driven(JointKind.SLIDE, (1.0, 0.0, 0.0), Ramp(0.02)), (1.0, 0.0)),
        (driven(JointKind.SLIDE, (0.0, -1.0, 0.0), Ramp(0.02)), (0.0, -1.0)),
        (driven(JointKind.HINGE, (0.0, 0.0, 1.0), Ramp(1.0)), (0.0, 1.0)),
    ],
    ids=["forward", "aside", "turning"],
)
def test_a_target_that_moves_drags_the_tip_with_it(target, direction, friction):
    """Coulomb's mu f_n along the surface's own velocity where the tip is; a mocap body would not rub at all."""
    backend = started(build_scene(TIP, target, ContactLaw(friction=0.3), PRESSED, friction=friction))
    move(backend, 400)
    # a turning plate spins under the tip, too: that takes (e w / v)^2 / 2 = 1 % of the force
    assert np.allclose(ratio(backend), 0.3 * np.array(direction), rtol=0, atol=5e-3)
    assert backend.truth().force[2] > 0.5


@settings(max_examples=10, deadline=None, derandomize=True)
@given(
    st.floats(-math.pi, math.pi), st.floats(0.01, 0.04), st.tuples(st.floats(-0.02, 0.02), st.floats(-0.02, 0.02))
)
def test_friction_goes_by_the_relative_velocity_alone(heading, speed, common):
    """Galilei: tip and target may share any further velocity."""
    slip = speed * np.array([math.cos(heading), math.sin(heading)])
    (vx, vy), (ux, uy) = slip + common, common
    target = MovingTarget(
        PLATE,
        [DrivenJoint(JointKind.SLIDE, (1, 0, 0), Ramp(vx)), DrivenJoint(JointKind.SLIDE, (0, 1, 0), Ramp(vy))],
    )
    scene = build_scene(TIP, target, ContactLaw(), PRESSED, friction=FrictionLaw())
    backend = started(scene)
    move(backend, 250, (ux, uy, 0.0))
    (contact,) = backend._plant.contacts
    assert np.allclose(contact.slip_velocity[:2], slip, rtol=0, atol=2e-4)
    assert np.allclose(ratio(backend), 0.3 * slip / speed, rtol=0, atol=5e-3)


def test_an_object_rubs_by_its_own_friction():
    thing = ObjectBody(PLATE, friction=0.6)
    backend = started(build_scene(TIP, thing, ContactLaw(friction=0.2), PRESSED))
    move(backend, 300, (0.02, 0.0, 0.0))
    assert np.allclose(ratio(backend), (-0.6, 0.0), rtol=0, atol=2e-3)


@pytest.mark.parametrize(
    ("mass", "mu", "rubs"), [(0.5, 0.3, None), (1.0, 0.2, FrictionLaw(0.02, 0.02, stiffness=5e3))]
)
def test_a_block_is_pushed_over_a_table_with_coulomb_s_force(mass, mu, rubs):
    backend = pushing(mass, mu, rubs)
    move(backend, 1000, (0.01, 0.0, 0.0))
    forces = []
    for _ in range(500):
        backend.step(Command((0.01, 0.0, 0.0)))
        forces.append(backend.truth().force)
    x, _, z = np.mean(forces, axis=0)
    assert -x == pytest.approx(mu * mass * GRAVITY, rel=0.01)
    # what the tip rubs downwards on the block's side adds to its weight
    assert -x == pytest.approx(mu * (mass * GRAVITY + z), rel=2e-4)
    # behind the command by the servo's lag, and by how far contact and servo give way
    stage = Stage()
    behind = 0.01 * stage.lag - x / 5e3 - x / stage.stiffness(TIP.mass)
    pose = backend.truth().pose_base_object
    assert pose.position[0] == pytest.approx(1.5 * 0.01 - 5e-4 - behind, abs=2e-5)
    assert pose.position[1] == pytest.approx(0.0, abs=1e-6)
    assert backend.truth().position_object[0] == pytest.approx(-0.03, abs=2e-4)


def test_a_block_without_a_push_stays_and_weighs_on_the_table():
    backend = pushing(0.5)
    move(backend, 1000)
    height = 0.02 - 0.5 * GRAVITY / (4 * 5e3)  # on four corners
    position = backend.truth().pose_base_object.position
    np.testing.assert_array_less(np.abs(np.subtract(position, (0.0, 0.0, height))), (1e-9, 1e-9, 1e-7))


def test_a_free_object_without_a_table_falls_and_a_fixed_one_does_not():
    fixed = ObjectBody(SphereObject(), position=(0.1, 0.0, 0.02))
    for target, falls in ((block(), True), (SphereObject(), False), (Torus(), False), (fixed, False)):
        backend = started(build_scene(TIP, target, ContactLaw(stiffness=5e3), (0.0, 0.0, 0.2)))
        before, now = backend.truth().pose_base_object.position[2], move(backend, 100)
        fallen = before - backend.truth().pose_base_object.position[2]
        assert fallen == pytest.approx(
            falls * 0.5 * GRAVITY * now.time**2, abs=falls * GRAVITY * now.time * 0.5e-3
        )
    assert backend.truth().pose_base_object.position == (0.1, 0.0, 0.02)


@pytest.mark.parametrize("friction", [None, FrictionLaw()], ids=["mujoco", "plant"])
def test_the_truth_says_where_a_moving_target_is_and_where_on_it_the_contact_is(friction):
    motion = Sine(0.3, 0.7, 0.4)
    target = driven(JointKind.HINGE, (0.0, 0.0, 1.0), motion)
    backend = started(build_scene(TIP, target, ContactLaw(), PRESSED, friction=friction))
    assert backend.truth().pose_base_object.rotation[1][0] == pytest.approx(math.sin(motion.at(0.0)[0]), abs=1e-12)
    angle, _, _ = motion.at(move(backend, 60).time)
    c, s = math.cos(angle), math.sin(angle)
    truth = backend.truth()
    assert np.allclose(truth.pose_base_object.rotation, [[c, -s, 0], [s, c, 0], [0, 0, 1]], rtol=0, atol=1e-12)
    x, y, _ = truth.position
    assert np.allclose(truth.position_object[:2], (c * x + s * y, c * y - s * x), rtol=0, atol=1e-12)
    assert truth.touching


WIDE = Box((0.2, 0.2, 0.04))


def sprung_model(target):
    spec = mujoco.MjSpec()
    spec.option.timestep = 1e-4
    target.add_to(spec, "object")
    return spec.compile()


@pytest.mark.parametrize(("stiffness", "mass"), [(2e3, 1.0), (500.0, 3.0)])
def test_it_swings_at_its_own_frequency_and_its_swings_decay_as_its_damping_says(stiffness, mass):
    ratio = 0.1
    target = SprungTarget(WIDE, stiffness, 2.0 * ratio * math.sqrt(stiffness * mass), mass)
    assert target.damping_ratio == pytest.approx(ratio)
    model = sprung_model(target)
    data = mujoco.MjData(model)
    data.qpos[0] = 1e-3
    heights = []
    for _ in range(20000):
        mujoco.mj_step(model, data)
        heights.append(float(data.qpos[0]))
    z = np.array(heights)
    rate = math.sqrt(stiffness / mass * (1.0 - ratio**2))
    crossings = np.flatnonzero((z[:-1] < 0.0) & (z[1:] >= 0.0))[:5]
    assert np.diff(crossings) * 1e-4 == pytest.approx(2.0 * math.pi / rate, rel=5e-3)
    first, second = z[crossings[0] : crossings[1]].max(), z[crossings[1] : crossings[2]].max()
    assert math.log(first / second) == pytest.approx(2.0 * math.pi * ratio / math.sqrt(1.0 - ratio**2), rel=0.02)


def test_nothing_holds_its_weight_but_it_does_not_fall():
    model = sprung_model(SprungTarget(WIDE))
    data = mujoco.MjData(model)
    for _ in range(1000):
        mujoco.mj_step(model, data)
    assert data.qpos[0] == pytest.approx(0.0, abs=1e-9)


LEFT_PLATE = PosedGeom(
    mujoco.mjtGeom.mjGEOM_BOX, np.array([0.03, 0.03, 0.005]), np.array([-0.05, 0.0, -0.005]), np.eye(3)
)
BALL = PosedGeom(mujoco.mjtGeom.mjGEOM_SPHERE, np.array([0.01, 0.0, 0.0]), np.array([0.05, 0.0, 0.02]), np.eye(3))
POST = PosedGeom(mujoco.mjtGeom.mjGEOM_SPHERE, np.array([0.01, 0.0, 0.0]), np.array([0.0, 0.0, 0.02]), np.eye(3))
PIECES = FixedPieces((LEFT_PLATE, BALL), (POST,))


@pytest.mark.parametrize(
    ("target", "x", "top"),
    [
        (WIDE, 0.0, 0.02),
        (block(0.5), 0.0, 0.04),
        (SprungTarget(WIDE, 2e3, 60.0, 1.0), 0.0, 0.02),
        (PIECES, -0.05, 0.0),
        (PIECES, 0.05, 0.03),
    ],
    ids=["fixed", "free", "sprung", "plate of two pieces", "ball of two pieces"],
)
def test_a_tip_presses_by_the_law_of_its_scene_on_whatever_it_meets(target, x, top):
    """A free object gives way, too: with the tip's mass alone in the contact's scale it would be half as stiff."""
    table = Table() if isinstance(target, ObjectBody) else None
    backend = started(build_scene(TIP, target, ContactLaw(5e3), (x, 0.0, top + RADIUS + 1e-4), table=table))
    before = backend.truth().pose_base_object.position[2]
    move(backend, 500, (0.0, 0.0, -0.002))
    now, truth = move(backend, 1500), backend.truth()
    force, sunk = now.wrenches[0].wrench[2] + TIP.mass * GRAVITY, truth.pose_base_object.position[2] - before
    assert force > 0.5
    assert force == pytest.approx(5e3 * (top + sunk + RADIUS - now.arm.position_base_tip[2]), rel=3e-3)
    if isinstance(target, SprungTarget):
        assert target.mount is Mount.SPRUNG
        assert sunk == pytest.approx(-force / 2e3, rel=1e-3)


def test_a_piece_that_is_only_seen_is_passed_through():
    backend = started(build_scene(TIP, PIECES, ContactLaw(), (0.0, 0.0, 0.04)))
    sample = move(backend, 1000, (0.0, 0.0, -0.005))
    assert abs(sample.wrenches[0].wrench[2] + TIP.mass * GRAVITY) < 0.01


def test_the_surface_is_that_of_all_of_them():
    pieces = FixedPieces((LEFT_PLATE, BALL))
    points = np.array([[-0.05, 0.0, 0.004], [0.05, 0.0, 0.05], [0.05, 0.0, 0.02]])
    np.testing.assert_allclose(pieces.signed_distance(points), [0.004, 0.02, -0.01], atol=1e-12)
    assert (pieces.top, pieces.bottom) == pytest.approx((0.03, -0.01))
    height = pieces.height(np.array([-0.05, 0.05, 0.0]), np.zeros(3))
    np.testing.assert_allclose(height, [0.0, 0.03, np.nan], atol=1e-12)


@pytest.mark.parametrize(("shape", "height"), [(Box((0.06, 0.06, 0.04)), 0.03), (SphereObject(0.03), 0.04)])
def test_an_object_that_would_start_inside_its_table_is_refused_with_where_to_put_it(shape, height):
    """A block half inside its table was shot 80 mm up without a message."""

    def standing(z):
        target = ObjectBody(shape, 0.5, mount=Mount.FREE, position=(0.0, 0.0, z))
        return build_scene(TIP, target, ContactLaw(stiffness=10e3), (0.0, 0.0, 0.2), table=Table(top=0.01))

    with pytest.raises(InvalidValueError, match=rf"z = 0.02 m: .* inside the table.*put it at z = {height:g} m"):
        standing(0.02)
    backend = started(standing(height))
    for _ in range(300):
        backend.step(Command())
        assert backend.truth().pose_base_object.position[2] <= height + 1e-9


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
    """Contacts see the prescribed motion: neither inertia that axes share nor centrifugal forces change it."""
    backend = started(build_scene(TIP, MovingTarget(Box(), joints), ContactLaw(), (0.0, 0.0, 0.5)))
    model, data = backend.scene.model, backend._data
    dofs = [int(model.joint(f"object_{i}").dofadr[0]) for i in range(len(joints))]
    for _ in range(5):
        move(backend, 30)
        for placer in backend._placers:
            placer.place()
        mujoco.mj_forward(model, data)
        _, velocity, acceleration = np.transpose([joint.motion.at(data.time) for joint in joints])
        assert np.allclose(data.qvel[dofs], velocity, rtol=0, atol=0)
        assert np.allclose(data.qacc[dofs], acceleration, rtol=0, atol=1e-4 * (1.0 + np.abs(acceleration).max()))
