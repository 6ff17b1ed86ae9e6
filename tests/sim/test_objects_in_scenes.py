"""Objects that move, may be pushed or stand on a table, behind the seam: friction, truth, snapshots."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.runtime import Command
from palpate.sim import (
    Box,
    ContactLaw,
    Mount,
    MujocoBackend,
    ObjectBody,
    SphereObject,
    Stage,
    Tip,
    Torus,
    build_scene,
)
from palpate.sim.fidelity import GRAVITY
from palpate.sim.friction.law import FrictionLaw
from palpate.sim.objects.motion import DrivenJoint, JointKind, MovingTarget, Ramp, Sine
from palpate.sim.objects.table import Table
from palpate.surfaces import Sphere

RADIUS = 0.008
TIP = Tip(Sphere(RADIUS))
PLATE = Box((0.2, 0.2, 0.02))
PRESSED = (0.03, 0.0, 0.01 + RADIUS - 1e-4)
"""Where a tip presses on the plate, beside its middle."""


def along(axis, motion):
    return MovingTarget(PLATE, [DrivenJoint(JointKind.SLIDE, axis, motion)])


def about(axis, motion):
    return MovingTarget(PLATE, [DrivenJoint(JointKind.HINGE, axis, motion)])


def run(backend, periods, velocity=(0.0, 0.0, 0.0)):
    return [backend.step(Command(velocity)) for _ in range(periods)]


def ratio(backend):
    """Tangential over normal force of a tip on a level surface, as a vector (x, y)."""
    x, y, z = backend.truth().force
    return np.array([x, y]) / z


def block(mass=0.5, friction=0.1, size=(0.06, 0.06, 0.04)):
    return ObjectBody(Box(size), mass, friction, mount=Mount.FREE, position=(0.0, 0.0, size[2] / 2))


def pushing(mass=0.5, mu=0.3, friction=None):
    """A block on a table, the tip just behind it."""
    law, start = ContactLaw(stiffness=5e3), (-0.03 - RADIUS - 5e-4, 0.0, 0.015)
    return MujocoBackend(build_scene(TIP, block(mass), law, start, friction=friction, table=Table(friction=mu)))


# --- rubbing on what moves ---


@pytest.mark.parametrize("friction", [None, FrictionLaw()], ids=["mujoco", "plant"])
@pytest.mark.parametrize(
    ("target", "direction"),
    [
        (along((1.0, 0.0, 0.0), Ramp(0.02)), (1.0, 0.0)),
        (along((0.0, -1.0, 0.0), Ramp(0.02)), (0.0, -1.0)),
        (about((0.0, 0.0, 1.0), Ramp(1.0)), (0.0, 1.0)),
    ],
    ids=["forward", "aside", "turning"],
)
def test_a_target_that_moves_drags_the_tip_with_it(target, direction, friction):
    """Coulomb's mu f_n along the surface's own velocity where the tip is; a mocap body would not rub at all."""
    backend = MujocoBackend(build_scene(TIP, target, ContactLaw(friction=0.3), PRESSED, friction=friction))
    backend.start()
    run(backend, 400)
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
    backend = MujocoBackend(scene)
    backend.start()
    run(backend, 250, (ux, uy, 0.0))
    (contact,) = backend._plant.contacts
    assert np.allclose(contact.slip_velocity[:2], slip, rtol=0, atol=2e-4)
    assert np.allclose(ratio(backend), 0.3 * slip / speed, rtol=0, atol=5e-3)


def test_an_object_rubs_by_its_own_friction():
    thing = ObjectBody(PLATE, friction=0.6)
    backend = MujocoBackend(build_scene(TIP, thing, ContactLaw(friction=0.2), PRESSED))
    backend.start()
    run(backend, 300, (0.02, 0.0, 0.0))
    assert np.allclose(ratio(backend), (-0.6, 0.0), rtol=0, atol=2e-3)


# --- pushing ---


@pytest.mark.parametrize(
    ("mass", "mu", "rubs"), [(0.5, 0.3, None), (1.0, 0.2, FrictionLaw(0.02, 0.02, stiffness=5e3))]
)
def test_a_block_is_pushed_over_a_table_with_coulomb_s_force(mass, mu, rubs):
    backend = pushing(mass, mu, rubs)
    backend.start()
    run(backend, 1000, (0.01, 0.0, 0.0))
    forces = []
    for _ in range(500):
        backend.step(Command((0.01, 0.0, 0.0)))
        forces.append(backend.truth().force)
    x, _, z = np.mean(forces, axis=0)
    assert -x == pytest.approx(mu * mass * GRAVITY, rel=0.01)
    # what the tip rubs downwards on the block's side adds to its weight
    assert -x == pytest.approx(mu * (mass * GRAVITY + z), rel=2e-4)
    # behind what is commanded by the servo's lag, and by how far contact and servo give way
    stage = Stage()
    behind = 0.01 * stage.lag - x / 5e3 - x / stage.stiffness(TIP.mass)
    pose = backend.truth().pose_base_object
    assert pose.position[0] == pytest.approx(1.5 * 0.01 - 5e-4 - behind, abs=2e-5)
    assert pose.position[1] == pytest.approx(0.0, abs=1e-6)
    assert backend.truth().position_object[0] == pytest.approx(-0.03, abs=2e-4)


def test_a_block_that_nobody_pushes_stays_and_weighs_on_the_table():
    backend = pushing(0.5)
    backend.start()
    run(backend, 1000)
    position = backend.truth().pose_base_object.position
    assert position[:2] == pytest.approx((0.0, 0.0), abs=1e-9)
    assert position[2] == pytest.approx(0.02 - 0.5 * GRAVITY / (4 * 5e3), abs=1e-7)  # on four corners


def test_a_free_object_without_a_table_falls_and_a_fixed_one_does_not():
    fixed = ObjectBody(SphereObject(), position=(0.1, 0.0, 0.02))
    for target, falls in ((block(), True), (SphereObject(), False), (Torus(), False), (fixed, False)):
        backend = MujocoBackend(build_scene(TIP, target, ContactLaw(stiffness=5e3), (0.0, 0.0, 0.2)))
        backend.start()
        before, now = backend.truth().pose_base_object.position[2], run(backend, 100)[-1]
        fallen = before - backend.truth().pose_base_object.position[2]
        assert fallen == pytest.approx(
            falls * 0.5 * GRAVITY * now.time**2, abs=falls * GRAVITY * now.time * 0.5e-3
        )
    assert backend.truth().pose_base_object.position == (0.1, 0.0, 0.02)


def test_the_stiffness_is_the_law_s_on_a_free_object_too():
    """Both bodies give way: with only the tip's mass in the contact's scale, the stiffness would be half."""
    law = ContactLaw(stiffness=5e3)
    target = block(0.5)
    backend = MujocoBackend(build_scene(TIP, target, law, (0.0, 0.0, 0.04 + RADIUS - 3e-4), table=Table()))
    now = backend.start()
    now = run(backend, 1500)[-1]
    truth = backend.truth()
    depth = truth.pose_base_object.position[2] + 0.02 + RADIUS - now.arm.position_base_tip[2]
    assert truth.force[2] == pytest.approx(law.stiffness * depth, rel=1e-3)


# --- truth ---


@pytest.mark.parametrize("friction", [None, FrictionLaw()], ids=["mujoco", "plant"])
def test_the_truth_says_where_a_moving_target_is_and_where_on_it_the_contact_is(friction):
    motion = Sine(0.3, 0.7, 0.4)
    scene = build_scene(TIP, about((0.0, 0.0, 1.0), motion), ContactLaw(), PRESSED, friction=friction)
    backend = MujocoBackend(scene)
    backend.start()
    assert backend.truth().pose_base_object.rotation[1][0] == pytest.approx(math.sin(motion.at(0.0)[0]), abs=1e-12)
    angle, _, _ = motion.at(run(backend, 60)[-1].time)
    c, s = math.cos(angle), math.sin(angle)
    truth = backend.truth()
    assert np.allclose(truth.pose_base_object.rotation, [[c, -s, 0], [s, c, 0], [0, 0, 1]], rtol=0, atol=1e-12)
    x, y, _ = truth.position
    assert np.allclose(truth.position_object[:2], (c * x + s * y, c * y - s * x), rtol=0, atol=1e-12)
    assert truth.touching


# --- the same run again ---


# --- what is in a scene ---


def test_a_scene_holds_only_what_it_names():
    law, start = ContactLaw(stiffness=5e3), (0.0, 0.0, 0.2)
    for target, table, pairs, geoms in (
        (PLATE, None, 1, 2),
        (PLATE, Table(), 1, 3),
        (ObjectBody(PLATE), Table(), 1, 3),
        (along((1.0, 0.0, 0.0), Ramp(0.1)), Table(), 1, 3),
        (block(), None, 1, 2),
        (block(), Table(), 2, 3),
    ):
        model = build_scene(TIP, target, law, start, table=table).model
        assert (model.npair, model.ngeom) == (pairs, geoms)
        assert not model.geom_contype.any()
        assert not model.geom_conaffinity.any()
