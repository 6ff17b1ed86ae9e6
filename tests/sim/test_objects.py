"""Objects: distances and inertia against closed forms, meshes and their files, prescribed motion."""

import math

import mujoco
import numpy as np
import pytest
import trimesh
from hypothesis import example, given, settings
from hypothesis import strategies as st

from palpate.errors import InvalidValueError
from palpate.sim import Box, ContactLaw, CylinderObject, EllipsoidObject, SphereObject
from palpate.sim.objects.body import ObjectBody
from palpate.sim.objects.mesh import ConvexMesh
from palpate.sim.objects.mesh_file import Triangles, read_triangles
from palpate.sim.objects.motion import Ramp, Sine
from palpate.sim.objects.table import Table
from support.meshes import joined
from support.refusals import check_refusals

FLAT, NEEDLE, ROUND = (0.05, 0.04, 0.0005), (0.001, 0.001, 0.1), (0.03, 0.03, 0.03)

DEFAULT = (0.05, 0.04, 0.03)


def ellipsoid_point(axes, direction):
    """A point of the surface and the outward unit normal there."""
    axes = np.array(axes)
    point = axes * direction / np.linalg.norm(direction)
    normal = point / axes**2
    return point, normal / np.linalg.norm(normal)


def nearest_by_sampling(axes, point, n=200):
    """Distance to the surface by search over directions, refined: an upper bound, accurate to ~1e-9.

    Directions are those to three faces of a cube: angles would not tell one another apart at the poles.
    """
    point, least = np.abs(point), np.inf
    for face in range(3):
        s, t = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n))
        step = 1 / (n - 1)
        for _ in range(12):
            to = np.insert(np.stack([s, t], axis=-1), face, 1.0, axis=-1)
            d = np.linalg.norm(to / np.linalg.norm(to, axis=-1, keepdims=True) * axes - point, axis=-1)
            least = min(least, d.min())
            i = np.unravel_index(d.argmin(), d.shape)
            w = np.linspace(-2 * step, 2 * step, 41)
            s, t = np.meshgrid(np.clip(s[i] + w, 0, 1), np.clip(t[i] + w, 0, 1))
            step /= 10
    return least


axes_strategy = st.one_of(st.tuples(*[st.floats(0.005, 0.1)] * 3), st.sampled_from([FLAT, NEEDLE, ROUND, DEFAULT]))

octant = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda d: np.linalg.norm(d) > 0.1)


@settings(max_examples=200, deadline=None, derandomize=True)
@given(axes_strategy, octant, st.floats(0.0, 0.2), st.floats(0.0, 0.99))
def test_the_distance_to_an_ellipsoid_is_that_along_its_normal(axes, direction, outside, part):
    # no two normals meet nearer to the surface than its smallest radius of curvature, min^2/max
    inside = part * min(axes) ** 2 / max(axes)
    point, normal = ellipsoid_point(axes, direction)
    found = EllipsoidObject(axes).signed_distance(point + np.array([outside, -inside])[:, None] * normal)
    rounding = 1e-15 + 1e-13 * max(axes)
    assert found[0] == pytest.approx(outside, rel=1e-9, abs=rounding)
    assert found[1] == pytest.approx(-inside, rel=1e-7, abs=rounding)


def test_the_center_of_an_ellipsoid_lies_its_least_semi_axis_deep():
    for axes in (DEFAULT, FLAT, NEEDLE, ROUND):
        assert EllipsoidObject(axes).signed_distance(np.zeros((1, 3)))[0] == pytest.approx(-min(axes), rel=1e-9)


@pytest.mark.slow
@settings(max_examples=40, deadline=None, derandomize=True)
@given(
    st.sampled_from([DEFAULT, ROUND, (0.03, 0.05, 0.04), (0.02, 0.05, 0.02)]),
    st.tuples(*[st.floats(-1.2, 1.2)] * 3),
    st.sampled_from([(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (0, 1, 1), (1, 0, 1), (1, 1, 1)]),
)
@example(DEFAULT, (0.2, 0.2, 1e-20), (1, 1, 1))
@example(DEFAULT, (0.1, 0.0, 0.0), (1, 0, 0))
@example((0.03, 0.05, 0.04), (0.0, 0.001, 0.9882), (0, 1, 1))
@example((0.02, 0.05, 0.02), (0.0, 0.001, 2 / 3), (0, 1, 1))
def test_points_anywhere_on_axes_and_planes_of_symmetry_too(axes, part, mask):
    point = np.array(part) * mask * axes
    found = EllipsoidObject(axes).signed_distance(point[None])[0]
    assert abs(found) == pytest.approx(nearest_by_sampling(np.array(axes), point), rel=1e-5, abs=1e-8)
    level = np.sum((point / axes) ** 2)
    if abs(level - 1.0) > 1e-9:
        assert (found > 0.0) == (level > 1.0)


BOX, CYLINDER = Box((0.08, 0.06, 0.04)), CylinderObject(0.03, 0.12)


@pytest.mark.parametrize(
    ("target", "point", "distance"),
    [
        (BOX, [0.0, 0.0, 0.0], -0.02),
        (BOX, [0.0, 0.0, 0.02], 0.0),
        (BOX, [0.0, 0.0, 0.03], 0.01),
        (BOX, [0.039, 0.0, 0.0], -0.001),
        (BOX, [0.043, 0.034, 0.0], 0.005),  # 3-4-5 over an edge
        (BOX, [0.041, 0.032, 0.022], 0.003),  # 1-2-2 over a corner
        (CYLINDER, [0.0, 0.0, 0.0], -0.03),
        (CYLINDER, [0.05, 0.0, 0.03], 0.0),
        (CYLINDER, [0.0, 0.024, 0.032], 0.01),
        (CYLINDER, [0.0599, 0.0, 0.0], -0.0001),
        (CYLINDER, [0.063, 0.0, 0.034], 0.005),  # 3-4-5 over the rim
    ],
)
def test_a_box_and_a_cylinder_along_x_measure_to_faces_edges_and_corners(target, point, distance):
    assert target.signed_distance(np.array([point]))[0] == pytest.approx(distance, abs=1e-12)


TRIANGLES = {n: trimesh.creation.icosphere(subdivisions=n, radius=0.04) for n in (2, 3, 4)}


CLOSED_FORMS = {
    "sphere": (SphereObject(0.03), [0.4 * 0.03**2] * 3),
    "ellipsoid": (
        EllipsoidObject((0.05, 0.04, 0.03)),
        [(0.04**2 + 0.03**2) / 5, (0.05**2 + 0.03**2) / 5, (0.05**2 + 0.04**2) / 5],
    ),
    "box": (
        Box((0.08, 0.06, 0.04)),
        [(0.06**2 + 0.04**2) / 12, (0.08**2 + 0.04**2) / 12, (0.08**2 + 0.06**2) / 12],
    ),
    "cylinder": (CylinderObject(0.03, 0.12), [0.03**2 / 2, *[0.03**2 / 4 + 0.12**2 / 12] * 2]),
    "table": (Table(0.0, (0.4, 0.3, 0.02)), [(0.3**2 + 0.02**2) / 12, (0.4**2 + 0.02**2) / 12, 0.5**2 / 12]),
}


@pytest.mark.parametrize("kind", CLOSED_FORMS)
def test_inertia_is_the_solid_s(kind):
    shape, moments = CLOSED_FORMS[kind]
    found = ObjectBody(shape, mass=0.2).inertia()
    assert np.allclose(found, 0.2 * np.diag(moments), rtol=0, atol=1e-10 * max(moments))


def test_a_box_as_a_mesh_has_the_box_s_inertia_and_distances():
    box, same = Box((0.08, 0.06, 0.04)), ConvexMesh(joined(trimesh.creation.box((0.08, 0.06, 0.04))))
    assert np.allclose(
        ObjectBody(same).inertia(), ObjectBody(box).inertia(), rtol=0, atol=1e-11
    )  # float32 vertices
    points = np.random.default_rng(0).uniform(-0.08, 0.08, (500, 3))
    assert np.allclose(same.signed_distance(points), box.signed_distance(points), rtol=0, atol=1e-12)
    x, y = points[:, 0], points[:, 1]
    assert np.allclose(same.height(x, y), box.height(x, y), equal_nan=True)


SOLIDS = [
    SphereObject(),
    EllipsoidObject(),
    Box(),
    CylinderObject(),
    Table(0.05),
    ConvexMesh(joined(TRIANGLES[3])),
]


@pytest.mark.parametrize("target", SOLIDS, ids=lambda target: type(target).__name__)
def test_geom_and_exact_surface_agree(target):
    spec = mujoco.MjSpec()
    target.add_assets(spec, "object")
    target.add_geom(spec.worldbody.add_body(name="object"), "object")
    probe = spec.worldbody.add_body(name="probe", mocap=True)
    probe.add_geom(name="probe", type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[1e-3, 0.0, 0.0])
    model = spec.compile()
    data = mujoco.MjData(model)
    points = np.random.default_rng(2).uniform(-0.1, 0.1, size=(200, 3))
    points = points[target.signed_distance(points) > 5e-3]
    assert len(points) > 50
    for point in points:
        data.mocap_pos[0] = point
        mujoco.mj_forward(model, data)
        found = mujoco.mj_geomDistance(model, data, model.geom("probe").id, model.geom("object").id, 1.0, None)
        assert found + 1e-3 == pytest.approx(target.signed_distance(point[None])[0], abs=2e-6)
    x = np.linspace(-0.02, 0.02, 5)
    surface = np.stack([x, 0.0 * x, target.height(x, 0.0 * x)], axis=1)
    assert np.allclose(target.signed_distance(surface), 0.0, atol=1e-12)
    assert surface[:, 2].max() == pytest.approx(target.top, abs=1e-15)
    above = np.random.default_rng(3).uniform(-0.2, 0.2, size=(500, 3))
    above[:, 2] = target.top + 1e-6 + np.abs(above[:, 2])
    assert np.all(target.signed_distance(above) > 0.0)
    assert not target.reachable(0.3, 0.0, 0.008)


def test_an_object_brings_its_friction_and_nothing_else_to_a_law():
    law = ObjectBody(Box(), friction=0.7, spin_length=0.002).law(ContactLaw(stiffness=50e3))
    assert law == ContactLaw(stiffness=50e3, friction=0.7, spin_length=0.002)


@pytest.mark.parametrize("motion", [Ramp(0.03), Sine(0.004, 2.0, 0.3)])
def test_velocity_and_acceleration_are_derivatives(motion):
    h = 1e-5
    for t in (0.1, 0.37):
        (a, va, _), (_, v, acc), (b, vb, _) = motion.at(t - h), motion.at(t), motion.at(t + h)
        assert (b - a) / (2 * h) == pytest.approx(v, abs=1e-7)
        assert (vb - va) / (2 * h) == pytest.approx(acc, abs=1e-6)


@pytest.mark.parametrize("suffix", ["stl", "obj", "ply"])
def test_a_file_in_millimetres_is_read_with_its_unit_and_refused_without(tmp_path, suffix):
    path = tmp_path / f"ball.{suffix}"
    big = TRIANGLES[3].copy()
    big.apply_scale(1000.0)
    big.export(path)
    mesh = ConvexMesh(read_triangles(path, 0.001))
    assert mesh.top == pytest.approx(0.04, rel=1e-3)
    assert mesh.triangles.volume == pytest.approx(4.0 / 3.0 * math.pi * 0.04**3, rel=0.02)
    with pytest.raises(InvalidValueError, match=rf"ball\.{suffix}: 80 m across.*metres_per_unit=0\.001"):
        read_triangles(path)


GOOD, FLIPPED, BROKEN = TRIANGLES[2], TRIANGLES[2].faces.copy(), TRIANGLES[2].vertices.copy()

FLIPPED[0], BROKEN[5] = FLIPPED[0][::-1], np.nan

BAD_MESHES = [
    (GOOD.vertices, GOOD.faces[1:], r"bad\.ply: not watertight, 3 edges"),
    (GOOD.vertices, FLIPPED, r"bad\.ply: not watertight.*senses"),
    (GOOD.vertices, GOOD.faces[:, ::-1], r"bad\.ply: volume -.*turn its triangles"),
    (BROKEN, GOOD.faces, r"bad\.ply: vertex 5 is \[nan"),
]


def test_bad_files_are_refused_by_name(tmp_path):
    path = tmp_path / "bad.ply"
    for vertices, faces, message in BAD_MESHES:
        trimesh.Trimesh(vertices, faces, process=False).export(path)
        with pytest.raises(InvalidValueError, match=message):
            read_triangles(path)
    (tmp_path / "empty.obj").touch()
    (tmp_path / "noise.stl").write_bytes(b"\x00\x01\x02")
    check_refusals(
        ("empty.obj", lambda: read_triangles(tmp_path / "empty.obj")),
        ("noise.stl", lambda: read_triangles(tmp_path / "noise.stl")),
        ("missing.stl", lambda: read_triangles(tmp_path / "folder" / "missing.stl")),
        ("mesh: empty", lambda: Triangles(np.empty((0, 3)), np.empty((0, 3), np.int64))),
    )
