"""Tips of every surface kind: the geom is the surface, where it is, and weighs what such a solid weighs."""

import mujoco
import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from palpate.sim import ContactLaw, Tip, build_scene
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
from support.simulated import move, started

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


def near_apex(surface):
    """h(n) of x^2/a^2 + y^2/b^2 + beta z^2 + 2 eta z = 0 near its apex, for normals with n_z > 0."""
    a, b, beta, eta = surface.coefficients

    def support(n):
        # the point of normal n: x = a^2 n_x k, y = b^2 n_y k, beta z + eta = n_z k
        s = (a * n[:, 0]) ** 2 + (b * n[:, 1]) ** 2
        k = np.sqrt(eta**2 / (n[:, 2] ** 2 + beta * s)) if beta else eta / n[:, 2]
        z = (n[:, 2] * k - eta) / beta if beta else -s * k**2 / (2.0 * eta)
        return s * k + n[:, 2] * z

    return support


BALL = trimesh.creation.icosphere(subdivisions=3, radius=0.008)
CAP = Patch(Ellipsoid((0.007, 0.007, 0.010)), np.array([[0.0, 0.0, -1.0, 0.0]]))
TUBE = Patch(Cylinder(0.007), np.array([[0.0, 0.0, 1.0, 0.0], [0.0, 0.0, -1.0, 0.015]]))
PARABOLOID, HYPERBOLOID = Paraboloid((0.008, 0.010), **FRAME), Hyperboloid((0.008, 0.009, 0.010), **FRAME)
PARTLY = {
    "paraboloid": (PARABOLOID, near_apex(PARABOLOID), 0.825),
    "hyperboloid": (HYPERBOLOID, near_apex(HYPERBOLOID), 0.825),
    "thimble": (Composite((CAP, TUBE)), ellipsoid_support([0.007, 0.007, 0.010]), 0.01),
}
"""Surfaces with supports for normals whose z component, in the surface's own frame, exceeds a bound."""

MESH = MeshSurface(np.array(BALL.vertices), np.array(BALL.faces), **FRAME)
WHOLE = {
    **{kind: (*known, -2.0) for kind, known in SUPPORTS.items()},
    "icosphere": (MESH, lambda n: (n @ BALL.vertices.T).max(axis=1), -2.0),
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


@pytest.mark.parametrize(
    "kind", [*(pytest.param(kind, marks=pytest.mark.slow) for kind in WHOLE), *PARTLY], ids=lambda kind: kind
)
def test_the_geom_reaches_as_far_as_the_surface_in_every_direction(kind):
    """Supports determine a convex body: equal ones in many directions are the same tip."""
    surface, support, above = {**WHOLE, **PARTLY}[kind]
    center, rotation = (np.zeros(3), np.eye(3)) if kind == "thimble" else (CENTER, TILT)
    normals = lattice(150)
    normals = normals[normals @ rotation[:, 2] > above]
    tip, model = compiled(surface)
    found = measured_support(tip, model, normals)
    assert len(normals) > 10
    assert np.allclose(found, normals @ center + support(normals @ rotation), rtol=0, atol=1e-7)
    assert kind != "icosphere" or "1280 facets, up to 5.4" in tip.approximation


@pytest.mark.slow
@pytest.mark.parametrize("kind", [*SUPPORTS, "paraboloid", "hyperboloid"])
def test_inertia_is_that_of_the_solid(kind):
    """MuJoCo's own integrals over the geom, at the density that gives the mass."""
    surface = {**WHOLE, **PARTLY}[kind][0]
    tip, model = compiled(surface, mass=0.05)
    spec = mujoco.MjSpec()
    tip.add_assets(spec)
    body = tip.add_to(spec.worldbody.add_body(name="carrier"))
    # whatever the body says
    spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE
    body.geoms[-1].mass = 0.05  # the visible shape, where a sphere rolls in the tip
    for geom in body.geoms[:-1]:
        geom.mass = 0.0
    truth = spec.compile()
    k = model.body("tip").id

    def inertia(m):
        turn = Rotation.from_quat(m.body_iquat[k], scalar_first=True).as_matrix()
        return turn @ np.diag(m.body_inertia[k]) @ turn.T

    assert np.allclose([model.body_ipos[k], tip.center_of_mass], truth.body_ipos[k], rtol=0, atol=1e-9)
    scale = np.abs(inertia(truth)).max()
    assert np.allclose(inertia(model), inertia(truth), rtol=0, atol=1e-6 * scale)
    assert model.body_mass[k] == 0.05


@pytest.mark.parametrize("target", [EllipsoidObject(), Torus(), StaticObject(Box())], ids=str)
def test_a_sphere_that_rolls_in_a_sphere_touches_as_it_does(target):
    """A superellipsoid of exponent 2 is an ellipsoid: pushed down and drawn along, both feel the same."""
    felt = []
    for surface in (Sphere(0.008, **FRAME), Superellipsoid((0.008,) * 3, 2.0, **FRAME)):
        top = target.shape.top if isinstance(target, StaticObject) else target.top
        aside = 0.03 if isinstance(target, Torus) else 0.005
        start = tuple(np.array([aside, 0.002, top + 0.0079]) - CENTER)
        backend = started(build_scene(Tip(surface), target, ContactLaw(), start))
        found = move(backend, 60, (0.02, 0.01, -0.005))
        felt.append((found.wrenches[0].wrench, backend.truth()))
    (exact, truth), (rolled, rolled_truth) = felt
    assert truth.touching
    assert rolled_truth.touching
    assert np.allclose(rolled, exact, rtol=0, atol=np.repeat([2e-3, 2e-5], 3))
    assert np.allclose(rolled_truth.position, truth.position, rtol=0, atol=1e-7)
