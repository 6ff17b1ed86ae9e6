"""Tips of every surface kind: the geom is the surface, where it is, and weighs what such a solid weighs."""

import math

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from palpate.errors import InvalidValueError
from palpate.sim import Tip
from palpate.sim.tip import SAG, TIP_GEOM
from palpate.sim.tip_mesh import lattice, tip_mesh
from palpate.surfaces import (
    Capsule,
    CompliantTip,
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
EXACT = {"sphere", "ellipsoid", "cylinder", "slab", "capsule"}


def compiled(surface, **options):
    spec = mujoco.MjSpec()
    tip = Tip(surface, **options)
    tip.add_assets(spec)
    tip.add_to(spec.worldbody.add_body(name="carrier"))
    plane = spec.worldbody.add_body(name="plane", mocap=True)
    plane.add_geom(name="plane", type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.2, 0.2, 0.01], contype=0, conaffinity=0)
    spec.add_pair(geomname1=TIP_GEOM, geomname2="plane", condim=1, margin=1.0)
    return tip, spec.compile()


def measured_support(model, normals):
    """Largest n.x of the tip's geom for normals in the sensor frame: contacts with a wall across each of them."""
    data = mujoco.MjData(model)
    far, found = 0.05, []
    for n in normals:
        turn = Rotation.align_vectors([-n], [[0.0, 0.0, 1.0]])[0].as_matrix()
        quat = np.zeros(4)
        mujoco.mju_mat2Quat(quat, turn.ravel())
        data.mocap_pos[0], data.mocap_quat[0] = (far + 0.01) * n, quat
        mujoco.mj_fwdPosition(model, data)
        found.append(far - min(contact.dist for contact in data.contact[: data.ncon]))
    return np.array(found)


@pytest.mark.slow
@pytest.mark.parametrize("kind", SUPPORTS)
def test_the_geom_reaches_as_far_as_the_surface_in_every_direction(kind):
    """Supports determine a convex body: equal ones in many directions, within the stated sag, are the same tip."""
    surface, support = SUPPORTS[kind]
    _, model = compiled(surface)
    normals = lattice(150)
    found = measured_support(model, normals)
    wanted = normals @ CENTER + support(normals @ TILT)
    # a mesh has its vertices on the surface, and is nowhere outside
    assert np.all(found <= wanted + 1e-7)
    assert np.all(found >= wanted - (1e-7 if kind in EXACT else SAG + 1e-7))


@pytest.mark.parametrize("sag", [2e-5, 4e-6])
@pytest.mark.parametrize("kind", OPEN)
def test_an_open_quadric_is_met_near_its_apex_and_the_mesh_keeps_to_its_sag(kind, sag):
    surface = OPEN[kind]
    _, model = compiled(surface, sag=sag)
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
    found = measured_support(model, n @ TILT.T)
    assert np.all(found <= wanted + 1e-7)
    assert np.all(found >= wanted - sag - 1e-7)
    assert (wanted - found).max() > 0.02 * sag  # no finer than asked for


def test_a_finer_mesh_is_nearer():
    surface, support = SUPPORTS["rounded box"]
    normals = lattice(2000)
    wanted = normals @ CENTER + support(normals @ TILT)
    sags = (4e-5, 1e-5, 2.5e-6)
    gaps = [np.max(wanted - (normals @ tip_mesh(surface, 0.02, sag).T).max(axis=1)) for sag in sags]
    assert gaps[0] > 2.0 * gaps[1] > 4.0 * gaps[2]
    for gap, sag in zip(gaps, sags, strict=True):
        assert gap <= sag


@pytest.mark.slow
@pytest.mark.parametrize("kind", [*SUPPORTS, *OPEN])
def test_inertia_is_that_of_the_solid(kind):
    """MuJoCo's own integrals over the geom, at the density that gives the mass."""
    surface = SUPPORTS[kind][0] if kind in SUPPORTS else OPEN[kind]
    tip, model = compiled(surface, mass=0.05, sag=1e-5)
    spec = mujoco.MjSpec()
    tip.add_assets(spec)
    body = tip.add_to(spec.worldbody.add_body(name="carrier"))
    # whatever the body says
    spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE
    body.geoms[0].mass = 0.05
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
    assert np.allclose(tip_mesh(surface, 0.02, SAG), CENTER + ball.vertices @ TILT.T)
    _, model = compiled(surface)
    normals = lattice(50)
    wanted = (normals @ (CENTER + ball.vertices @ TILT.T).T).max(axis=1)
    assert np.allclose(measured_support(model, normals), wanted, rtol=0, atol=1e-7)


def test_a_composite_of_ones_own_is_meshed_from_its_patches():
    """A thimble of an ellipsoidal cap on an elliptic cylinder with a flat end: as far as its patches say."""
    up, down = [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]
    cap = Patch(Ellipsoid((0.007, 0.007, 0.010)), np.array([[*down, 0.0]]))
    tube = Patch(Cylinder(0.007), np.array([[*up, 0.0], [*down, 0.015]]))
    normals = lattice(500)
    found = (normals @ tip_mesh(Composite((cap, tube)), 0.02, SAG).T).max(axis=1)
    across = 0.007 * np.hypot(normals[:, 0], normals[:, 1])
    on_cap = np.linalg.norm([0.007, 0.007, 0.010] * normals, axis=1)
    wanted = np.where(normals[:, 2] > 0.0, on_cap, across - 0.015 * normals[:, 2])
    assert np.all(found <= wanted + 1e-12)
    assert np.all(found >= wanted - SAG)


def test_what_cannot_be_simulated_is_refused_by_name():
    with pytest.raises(InvalidValueError, match="CompliantTip: in a simulation the contact"):
        Tip(CompliantTip(Sphere(0.008), 1e4))
    with pytest.raises(InvalidValueError, match="endless elliptic cylinder"):
        Tip(Ellipsoid((0.007, 0.008, math.inf)))
    with pytest.raises(InvalidValueError, match="surface is a str"):
        Tip("sphere")
    with pytest.raises(
        InvalidValueError, match=r"sag = 1e-09 m deep asks for \d+ vertices.*is the tip that large.*at least"
    ):
        Tip(RoundedBox(HALF, CORNER), sag=1e-9)
    endless = Composite((Patch(Cylinder(0.007), np.array([[0.0, 0.0, 1.0, 0.0]])),))
    with pytest.raises(InvalidValueError, match="no end along its axis"):
        Tip(endless)
    for name in ("mass", "reach", "sag"):
        with pytest.raises(InvalidValueError, match=name):
            Tip(Sphere(0.008), **{name: 0.0})


def test_a_recommended_sag_is_accepted():
    with pytest.raises(InvalidValueError, match="at least") as refused:
        Tip(RoundedBox(HALF, CORNER), sag=1e-9)
    Tip(RoundedBox(HALF, CORNER), sag=float(str(refused.value).split("at least ")[1].split()[0]))
