"""Objects that are not convex: one contact, where and how deep the exact surface has it, and not the hull's."""

import math

import mujoco
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from palpate.sim import ContactLaw, Stage, Tip, build_scene
from palpate.sim.objects.heights import HeightField, bumps, height_field
from palpate.sim.objects.mesh import TracedMesh
from palpate.sim.objects.mesh_file import Triangles
from palpate.sim.objects.torus import Torus
from palpate.sim.objects.traced import Trace
from palpate.sim.scene import OBJECT_GEOM
from palpate.sim.tip import TIP_GEOM
from palpate.surfaces import Sphere

RADIUS, DEPTH = 0.008, 1e-4
TORUS, BUMPS = Torus(0.03, 0.012), bumps()
RATE, HEIGHT = 2.0 * math.pi / 0.06, 0.003


def torus_grid(n):
    """A mesh of `TORUS`, vertices on it."""
    u, v = (k.ravel() for k in np.meshgrid(np.arange(2 * n), np.arange(n), indexing="ij"))
    a, b = np.pi * u / n, 2.0 * np.pi * v / n
    out = 0.03 + 0.012 * np.cos(b)
    vertices = np.stack([out * np.cos(a), out * np.sin(a), 0.012 * np.sin(b)], axis=1)
    i, j, k, m = u * n + v, (u + 1) % (2 * n) * n + v, (u + 1) % (2 * n) * n + (v + 1) % n, u * n + (v + 1) % n
    return Triangles(vertices, np.concatenate([np.stack([i, j, k], axis=1), np.stack([i, k, m], axis=1)]))


TORUS_MESH = TracedMesh(torus_grid(48))


def torus_points(n=200):
    rng = np.random.default_rng(0)
    u, v = rng.uniform(0.0, 2.0 * np.pi, n), rng.uniform(0.1, np.pi - 0.1, n)
    normals = np.stack([np.cos(u) * np.cos(v), np.sin(u) * np.cos(v), np.sin(v)], axis=1)
    return 0.03 * np.stack([np.cos(u), np.sin(u), 0.0 * u], axis=1) + 0.012 * normals, normals


def bump_points(x, y):
    """Points of `BUMPS` above places, and their normals."""
    sx, cx, sy, cy = np.sin(RATE * x), np.cos(RATE * x), np.sin(RATE * y), np.cos(RATE * y)
    normals = np.stack([-HEIGHT * RATE * cx * sy, -HEIGHT * RATE * sx * cy, np.ones_like(x)], axis=1)
    points = np.stack([x, y, HEIGHT * sx * sy], axis=1)
    return points, normals / np.linalg.norm(normals, axis=1, keepdims=True)


class Touching:
    """A spherical tip on a stage over an object, placed anywhere."""

    def __init__(self, target, start=(0.0, 0.0, 0.1), law=None, surface=None):
        scene = build_scene(Tip(surface or Sphere(RADIUS)), target, law or ContactLaw(), start)
        self.model, self.start = scene.model, np.array(start)
        self.data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, self.data)
        self.trace = Trace(target, self.model, self.data, TIP_GEOM, OBJECT_GEOM)

    def contacts(self, center):
        self.data.qpos[:3] = np.asarray(center) - self.start
        self.trace.place()
        mujoco.mj_forward(self.model, self.data)
        return list(self.data.contact[: self.data.ncon])

    def into_tip(self, contact):
        """Unit normal that points from the object into the tip."""
        towards = -1.0 if contact.geom[0] == self.model.geom(TIP_GEOM).id else 1.0
        return towards * contact.frame[:3]


@pytest.mark.parametrize(
    ("target", "points", "allowed"),
    [
        (TORUS, torus_points(), 1e-12),
        (BUMPS, bump_points(*np.random.default_rng(1).uniform(-0.04, 0.04, (2, 200))), 1e-7),
    ],
    ids=["torus", "bumps"],
)
def test_a_contact_is_one_where_and_how_deep_and_how_inclined_the_exact_surface_has_it(target, points, allowed):
    touching = Touching(target)
    for point, normal in zip(*points, strict=True):
        (contact,) = touching.contacts(point + (RADIUS - DEPTH) * normal)
        assert contact.dist == pytest.approx(-DEPTH, abs=allowed)
        assert np.allclose(contact.pos, point - 0.5 * DEPTH * normal, rtol=0, atol=allowed)
        # a normal off by an angle a puts the point off by a times the tip's radius
        assert np.allclose(touching.into_tip(contact), normal, rtol=0, atol=1e-9 + allowed / 1e-2)
        assert not touching.contacts(point + (RADIUS + 1e-6) * normal)


@pytest.mark.parametrize("n", [24, 48])
def test_a_mesh_of_a_torus_is_touched_as_the_torus_within_its_sag_and_facets(n):
    """Vertices on the surface, edges of angle 2 pi / n on the tube: a sag of tube (1 - cos(pi / n)) and as much
    again along the ring; normals within the angle of half an edge each way."""
    touching = Touching(TracedMesh(torus_grid(n)))
    # around the hole, facets stand out instead, by less than
    over = 0.03 * (1 - math.cos(math.pi / (2 * n)))
    sag = 0.012 * (1 - math.cos(math.pi / n)) + 0.042 * (1 - math.cos(math.pi / (2 * n)))
    angle = math.hypot(math.pi / n, math.pi / (2 * n))
    worst = 0.0
    for point, normal in zip(*torus_points(), strict=True):
        depth = sag + DEPTH
        (contact,) = touching.contacts(point + (RADIUS - depth) * normal)
        assert DEPTH - 1e-9 <= -contact.dist <= depth + over
        off = np.linalg.norm(touching.into_tip(contact) - normal)
        assert off <= angle
        worst = max(worst, off)
    assert worst > 0.1 * angle  # facets show


@settings(max_examples=60, deadline=None)
@given(st.floats(-0.06, 0.06), st.floats(-0.06, 0.06), st.floats(-0.06, 0.06))
@example(5e-324, 5e-324, 0.0)  # on the axis, but for denormal numbers
def test_a_mesh_of_a_torus_measures_as_the_torus_inside_and_out(x, y, z):
    point = np.array([[x, y, z]])
    exact, found = TORUS.signed_distance(point)[0], TORUS_MESH.signed_distance(point)[0]
    assert found == pytest.approx(
        exact, abs=0.012 * (1 - math.cos(math.pi / 48)) + 0.042 * (1 - math.cos(math.pi / 96))
    )


def test_what_is_not_convex_is_not_its_hull():
    """In the middle of a ring, between hills: a tip falls through or in, where the hull would hold it."""
    ring = Touching(TracedMesh(torus_grid(48)))
    assert not ring.contacts((0.0, 0.0, 0.0))
    assert not Touching(TORUS).contacts((0.0, 0.0, 0.0))
    hollow = (0.015, -0.015)
    field = Touching(BUMPS)
    assert not field.contacts((*hollow, -HEIGHT + RADIUS + 1e-6))
    (contact,) = field.contacts((*hollow, -HEIGHT + RADIUS - DEPTH))
    assert contact.dist == pytest.approx(-DEPTH, abs=1e-7)


@pytest.mark.parametrize("depth", [2e-5, 1e-4, 4e-4])
def test_the_force_is_the_contact_law_s_at_every_depth(depth):
    """MuJoCo's own height field and SDF collisions give 2 to 30 times the stiffness, depending on the depth."""
    law = ContactLaw(stiffness=20e3)
    hollow = Touching(BUMPS, law=law)
    normal_force = law.stiffness * depth
    # the stage's servo holds against the contact's force: at equilibrium the law is felt without dynamics
    stage, tip_mass = Stage(), 0.03
    start = np.array([0.015, -0.015, -HEIGHT + RADIUS - depth])
    hollow.data.qpos[:3] = start - hollow.start
    command = start - hollow.start - [0.0, 0.0, normal_force / stage.stiffness(tip_mass)]
    hollow.data.ctrl[:] = command
    for _ in range(1200):
        hollow.trace.place()
        mujoco.mj_step(hollow.model, hollow.data)
    force = np.zeros(6)
    mujoco.mj_contactForce(hollow.model, hollow.data, 0, force)
    assert force[0] == pytest.approx(normal_force, rel=1e-3)
    assert hollow.data.qpos[2] + hollow.start[2] == pytest.approx(start[2], abs=1e-3 * depth)


@pytest.mark.parametrize("speed", [0.01, 0.02])
def test_a_tip_that_slides_over_bumps_keeps_in_one_contact_and_rubs_as_friction_says(speed):
    law = ContactLaw(stiffness=20e3, friction=0.3)
    ride = Touching(BUMPS, law=law)
    found, slope = [], []
    for i in range(2000):
        # the tip's centre over the profile, pressed 0.1 mm deep; in y = -15 mm it is a plane motion
        (foot,), (normal,) = bump_points(np.array([speed * i * 5e-4]), np.array([-0.015]))
        target = foot + (RADIUS - 1e-4) * normal
        ride.data.ctrl[:] = target - ride.start
        if i == 0:
            ride.data.qpos[:3] = target - ride.start
        ride.trace.place()
        mujoco.mj_step(ride.model, ride.data)
        if i > 600:
            assert ride.data.ncon == 1
            force = np.zeros(6)
            mujoco.mj_contactForce(ride.model, ride.data, 0, force)
            found.append(math.hypot(force[1], force[2]) / force[0])
            slope.append(ride.into_tip(ride.data.contact[0]))
    assert np.allclose(found, 0.3, rtol=2e-3)
    assert np.ptp(np.array(slope)[:, 0]) > 0.05  # it went over hill and dale


@settings(max_examples=60, deadline=None)
@given(st.floats(-0.05, 0.05), st.floats(-0.05, 0.05), st.floats(1e-5, 0.015))
def test_a_height_field_measures_along_its_normals(x, y, distance):
    """A point at a distance along the normal, nearer than the tightest hollow's radius, is that far away."""
    (point,), (normal,) = bump_points(np.array([x]), np.array([y]))
    points = np.array([point + distance * normal, point - distance * normal])
    assert np.allclose(BUMPS.signed_distance(points), [distance, -distance], rtol=0, atol=1e-8)


def test_heights_are_met_at_the_samples_and_between_them():
    rng = np.random.default_rng(5)
    heights = 0.002 * rng.normal(size=(9, 7))
    field = HeightField(heights, 0.06, 0.08)
    x, y = np.meshgrid(np.linspace(-0.03, 0.03, 7), np.linspace(-0.04, 0.04, 9))
    assert np.allclose(field.height(x, y), heights, rtol=0, atol=1e-9)
    assert np.isnan(field.height(np.array([0.031]), np.array([0.0]))).all()
    u, v = rng.uniform(-0.05, 0.05, (2, 400))
    assert np.allclose(BUMPS.height(u, v), HEIGHT * np.sin(RATE * u) * np.sin(RATE * v), rtol=0, atol=2e-9)
    plane = height_field(lambda x, y: 0.2 * x - 0.1 * y, 0.1, 0.01)
    assert np.allclose(plane.height(u, v), 0.2 * u - 0.1 * v, rtol=0, atol=1e-12)  # to its very edges


@pytest.mark.parametrize(
    ("target", "top", "error", "reachable", "beyond"),
    [
        (TORUS, 0.012, 1e-15, (0.0, 0.03), [(0.0, 0.0), (0.05, 0.0)]),
        (BUMPS, HEIGHT, 1e-14, (0.01, 0.02), [(0.085, 0.0)]),
        (TORUS_MESH, 0.012, 1e-8, (0.0, 0.03), [(0.0, 0.0)]),
    ],
    ids=["torus", "bumps", "mesh"],
)
def test_tops_are_on_the_surface_and_reach_is_refused_where_it_is_steep_or_beside(
    target, top, error, reachable, beyond
):
    assert target.top == pytest.approx(top, abs=error)
    assert target.reachable(*reachable, RADIUS)
    assert not any(target.reachable(*point, RADIUS) for point in beyond)
    x = np.array([0.0, 0.03, 0.025])
    assert target is BUMPS or np.allclose(
        target.height(x, 0 * x), TORUS.height(x, 0 * x), atol=1e-4, equal_nan=True
    )


def test_pictures_are_seen_and_touch_nothing():
    for target in (TORUS, BUMPS, TORUS_MESH):
        spec = mujoco.MjSpec()
        target.add_assets(spec, "object")
        target.add_geom(spec.worldbody.add_body(name="object"), "object")
        model = spec.compile()
        assert model.geom("object_picture").contype == 0
        assert model.geom("object_picture").conaffinity == 0
        assert model.geom("object").rgba[3] == 0.0
