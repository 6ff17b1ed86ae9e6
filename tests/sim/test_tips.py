"""Tips of every surface kind: the geom is the surface, where it is, and weighs what such a solid weighs."""

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from palpate.runtime import Command
from palpate.sim import ContactLaw, MujocoBackend, Tip, build_scene
from palpate.sim.objects.primitives import Box, EllipsoidObject
from palpate.sim.objects.target import StaticObject
from palpate.sim.objects.torus import Torus
from palpate.sim.tip import TIP_GEOM
from palpate.sim.tip_boundary import lattice
from palpate.surfaces import (
    Capsule,
    Composite,
    Cylinder,
    Ellipsoid,
    Hyperboloid,
    MeshSurface,
    Paraboloid,
    Patch,
    Plane,
    RoundedBox,
    Sphere,
    Superellipsoid,
)

CENTER = np.array([0.001, -0.002, 0.01])
TILT = Rotation.from_rotvec([0.3, -0.2, 0.5]).as_matrix()
FRAME = {"center": CENTER, "rotation": TILT}
CORNER, HALF = 0.002, np.array([0.010, 0.008, 0.006])


def ellipsoid_support(axes):
    return lambda n: np.linalg.norm(np.asarray(axes) * n, axis=1)


def superellipsoid_support(axes, p):
    q = p / (p - 1.0)  # the dual norm
    return lambda n: np.sum(np.abs(np.asarray(axes) * n) ** q, axis=1) ** (1.0 / q)


SUPPORTS = {
    "sphere": (Sphere(0.008, **FRAME), ellipsoid_support([0.008] * 3)),
    "ellipsoid": (Ellipsoid((0.007, 0.008, 0.012), **FRAME), ellipsoid_support([0.007, 0.008, 0.012])),
    "cylinder": (Cylinder(0.008, **FRAME), lambda n: 0.008 * np.hypot(n[:, 0], n[:, 1]) + 0.02 * np.abs(n[:, 2])),
    "slab": (Plane(0.006, **FRAME), lambda n: np.abs(n) @ [0.02, 0.02, 0.006]),
    "capsule": (Capsule(0.008, 0.02, **FRAME), lambda n: 0.008 + np.maximum(-0.02 * n[:, 2], 0.0)),
    "rounded box": (RoundedBox(HALF, CORNER, **FRAME), lambda n: CORNER + np.abs(n) @ (HALF - CORNER)),
    "superellipsoid": (
        Superellipsoid((0.010, 0.009, 0.008), 4.0, **FRAME),
        superellipsoid_support([0.010, 0.009, 0.008], 4.0),
    ),
}
"""Surfaces, and h(n) = max n.x over the closed solid, in its own frame [m]."""

OPEN = {
    "paraboloid": Paraboloid((0.008, 0.010), **FRAME),
    "hyperboloid": Hyperboloid((0.008, 0.009, 0.010), **FRAME),
}


def compiled(surface, **options):
    spec = mujoco.MjSpec()
    tip = Tip(surface, **options)
    tip.add_assets(spec)
    tip.add_to(spec.worldbody.add_body(name="carrier"))
    plane = spec.worldbody.add_body(name="plane", mocap=True)
    plane.add_geom(name="plane", type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.2, 0.2, 0.01], contype=0, conaffinity=0)
    spec.add_pair(geomname1=TIP_GEOM, geomname2="plane", condim=1, margin=1.0)
    return tip, spec.compile()


def measured_support(tip, model, normals):
    """Largest n.x of the tip's geom for normals in the sensor frame: contacts with a wall across each of them."""
    data = mujoco.MjData(model)
    placer = tip.placer(model, data, TIP_GEOM, Box())
    found = []
    for n in normals:
        turn = Rotation.align_vectors([-n], [[0.0, 0.0, 1.0]])[0].as_matrix()
        mujoco.mju_mat2Quat(data.mocap_quat[0], turn.ravel())
        far = 0.05
        for gap in (0.0, 1e-4):  # a sphere that rolls in a tip is where it nearly touches
            data.mocap_pos[0] = (far + gap + 0.01) * n
            placer.place()
            mujoco.mj_fwdPosition(model, data)
            far = far + gap - min(contact.dist for contact in data.contact[: data.ncon])
        found.append(far)
    return np.array(found)


@pytest.mark.slow
@pytest.mark.parametrize("kind", SUPPORTS)
def test_the_geom_reaches_as_far_as_the_surface_in_every_direction(kind):
    """Supports determine a convex body: equal ones in many directions are the same tip."""
    surface, support = SUPPORTS[kind]
    normals = lattice(150)
    found = measured_support(*compiled(surface), normals)
    wanted = normals @ CENTER + support(normals @ TILT)
    assert np.allclose(found, wanted, rtol=0, atol=1e-7)


@pytest.mark.parametrize("kind", OPEN)
def test_an_open_quadric_is_met_near_its_apex(kind):
    surface = OPEN[kind]
    a, b, beta, eta = surface.coefficients
    # points of given normals: p ~ (x/a^2, y/b^2, beta z + eta), so x, y, z from the normal (u, v, w), w > 0
    turn, steep = np.meshgrid(np.linspace(0.0, 6.0, 13), np.linspace(0.0, 0.6, 7))
    n = np.stack([np.sin(steep) * np.cos(turn), np.sin(steep) * np.sin(turn), np.cos(steep)], axis=-1).reshape(
        -1, 3
    )
    s = (a * n[:, 0]) ** 2 + (b * n[:, 1]) ** 2  # x = a^2 u k, y = b^2 v k, beta z + eta = w k
    k = np.sqrt(eta**2 / (n[:, 2] ** 2 + beta * s)) if beta else eta / n[:, 2]
    z = (n[:, 2] * k - eta) / beta if beta else -s * k**2 / (2.0 * eta)
    points = np.stack([a**2 * n[:, 0] * k, b**2 * n[:, 1] * k, z], axis=1)
    value = (points[:, 0] / a) ** 2 + (points[:, 1] / b) ** 2 + beta * z**2 + 2.0 * eta * z
    assert np.allclose(value, 0.0, atol=1e-12)
    wanted = np.sum(points * n, axis=1) + (n @ TILT.T) @ CENTER
    found = measured_support(*compiled(surface), n @ TILT.T)
    assert np.allclose(found, wanted, rtol=0, atol=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("kind", [*SUPPORTS, *OPEN])
def test_inertia_is_that_of_the_solid(kind):
    """MuJoCo's own integrals over the geom, at the density that gives the mass."""
    surface = SUPPORTS[kind][0] if kind in SUPPORTS else OPEN[kind]
    tip, model = compiled(surface, mass=0.05)
    spec = mujoco.MjSpec()
    tip.add_assets(spec)
    body = tip.add_to(spec.worldbody.add_body(name="carrier"))
    # whatever the body says
    spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE
    body.geoms[-1].mass = 0.05  # what is seen of it, where a sphere rolls in it
    for geom in body.geoms[:-1]:
        geom.mass = 0.0
    truth = spec.compile()
    k = model.body("tip").id

    def inertia(m):
        turn = np.zeros(9)
        mujoco.mju_quat2Mat(turn, m.body_iquat[k])
        turn = turn.reshape(3, 3)
        return turn @ np.diag(m.body_inertia[k]) @ turn.T

    assert np.allclose(model.body_ipos[k], truth.body_ipos[k], rtol=0, atol=1e-9)
    assert np.allclose(tip.center_of_mass, truth.body_ipos[k], rtol=0, atol=1e-9)
    scale = np.abs(inertia(truth)).max()
    assert np.allclose(inertia(model), inertia(truth), rtol=0, atol=1e-6 * scale)
    assert model.body_mass[k] == 0.05


@pytest.mark.slow
def test_an_icosphere_given_as_a_mesh_surface_is_taken_as_it_is():
    trimesh = pytest.importorskip("trimesh")
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.008)
    surface = MeshSurface(np.array(ball.vertices), np.array(ball.faces), **FRAME)
    tip, model = compiled(surface)
    assert "1280 facets, up to 5.4" in tip.approximation
    normals = lattice(50)
    wanted = (normals @ (CENTER + ball.vertices @ TILT.T).T).max(axis=1)
    assert np.allclose(measured_support(tip, model, normals), wanted, rtol=0, atol=1e-7)


def test_a_composite_of_ones_own_is_met_at_its_patches():
    """A thimble of an ellipsoidal cap on an elliptic cylinder with a flat end: as far as its patches say."""
    up, down = [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]
    cap = Patch(Ellipsoid((0.007, 0.007, 0.010)), np.array([[*down, 0.0]]))
    tube = Patch(Cylinder(0.007), np.array([[*up, 0.0], [*down, 0.015]]))
    normals = lattice(300)
    normals = normals[normals[:, 2] > 0.01]
    found = measured_support(*compiled(Composite((cap, tube))), normals)
    wanted = np.linalg.norm([0.007, 0.007, 0.010] * normals, axis=1)
    assert np.allclose(found, wanted, rtol=0, atol=1e-7)


@pytest.mark.parametrize("target", [EllipsoidObject(), Torus(), StaticObject(Box())], ids=str)
def test_a_sphere_that_rolls_in_a_sphere_touches_as_it_does(target):
    """A superellipsoid of exponent 2 is an ellipsoid: pushed down and drawn along, both feel the same."""
    felt = []
    for surface in (Sphere(0.008, **FRAME), Superellipsoid((0.008,) * 3, 2.0, **FRAME)):
        top = target.shape.top if isinstance(target, StaticObject) else target.top
        aside = 0.03 if isinstance(target, Torus) else 0.005
        start = tuple(np.array([aside, 0.002, top + 0.0079]) - CENTER)
        backend = MujocoBackend(build_scene(Tip(surface), target, ContactLaw(), start))
        backend.start()
        for _ in range(60):
            found = backend.step(Command((0.02, 0.01, -0.005)))
        felt.append((found.wrenches[0].wrench, backend.truth()))
    (exact, truth), (rolled, rolled_truth) = felt
    assert truth.touching
    assert rolled_truth.touching
    assert np.allclose(rolled[:3], exact[:3], rtol=0, atol=2e-3)
    assert np.allclose(rolled[3:], exact[3:], rtol=0, atol=2e-5)
    assert np.allclose(rolled_truth.position, truth.position, rtol=0, atol=1e-7)
