"""Objects with weight, tables, convex meshes and files of meshes, targets that move."""

import math

import mujoco
import numpy as np
import pytest
import trimesh

from palpate.errors import InvalidValueError
from palpate.sim import Box, ContactLaw, CylinderObject, EllipsoidObject, SphereObject
from palpate.sim.contact_law import pair_parameters
from palpate.sim.objects.body import Mount, ObjectBody
from palpate.sim.objects.mesh import ConvexMesh, TracedMesh
from palpate.sim.objects.mesh_file import Triangles, read_triangles
from palpate.sim.objects.motion import DrivenJoint, JointKind, MovingTarget, Ramp, Sine, TargetDrive
from palpate.sim.objects.table import Table

TRIANGLES = {n: trimesh.creation.icosphere(subdivisions=n, radius=0.04) for n in (2, 3, 4)}
DT = 0.5e-3


def ball(n):
    return Triangles(np.array(TRIANGLES[n].vertices), np.array(TRIANGLES[n].faces))


def sag(n):
    """How deep the deepest facet's middle lies under the sphere [m]."""
    return 0.04 - np.linalg.norm(np.array(TRIANGLES[n].triangles_center), axis=1).min()


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
    box, mesh = Box((0.08, 0.06, 0.04)), trimesh.creation.box((0.08, 0.06, 0.04))
    same = ConvexMesh(Triangles(np.array(mesh.vertices), np.array(mesh.faces)))
    assert np.allclose(
        ObjectBody(same).inertia(), ObjectBody(box).inertia(), rtol=0, atol=1e-11
    )  # float32 vertices
    points = np.random.default_rng(0).uniform(-0.08, 0.08, (500, 3))
    assert np.allclose(same.signed_distance(points), box.signed_distance(points), rtol=0, atol=1e-12)
    x, y = points[:, 0], points[:, 1]
    assert np.allclose(same.height(x, y), box.height(x, y), equal_nan=True)


@pytest.mark.parametrize(
    "target", [CylinderObject(), Table(0.05), ConvexMesh(ball(3))], ids=["cylinder", "table", "mesh"]
)
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
    top = np.stack([x, 0.0 * x, target.height(x, 0.0 * x)], axis=1)
    assert np.allclose(target.signed_distance(top), 0.0, atol=1e-12)
    assert not target.reachable(0.3, 0.0, 0.008)


@pytest.mark.parametrize("n", [2, 3, 4])
def test_a_mesh_of_a_sphere_is_touched_as_the_sphere_within_its_sag(n):
    """One contact; depth within the sag, normal within the angle that a facet of that sag spans."""
    spec = mujoco.MjSpec()
    mesh = ConvexMesh(ball(n))
    mesh.add_assets(spec, "object")
    mesh.add_geom(spec.worldbody.add_body(name="object"), "object")
    tip = spec.worldbody.add_body(name="tip", mocap=True)
    tip.add_geom(name="tip", type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.008, 0.0, 0.0], contype=0, conaffinity=0)
    spec.add_pair(geomname1="tip", geomname2="object", condim=1)
    model = spec.compile()
    data = mujoco.MjData(model)
    depth, normals = sag(n) + 1e-4, np.random.default_rng(4).normal(size=(200, 3))
    for normal in normals / np.linalg.norm(normals, axis=1, keepdims=True):
        data.mocap_pos[0] = (0.048 - depth) * normal
        mujoco.mj_forward(model, data)
        assert data.ncon == 1
        assert 1e-4 - 1e-6 <= -data.contact[0].dist <= depth + 1e-6
        off = np.linalg.norm(np.cross(data.contact[0].frame[:3], normal))
        assert off <= 1.2 * math.sqrt(2.0 * sag(n) / 0.04)


def test_a_free_object_falls_and_a_fixed_one_does_not():
    spec = mujoco.MjSpec()
    ObjectBody(SphereObject(0.02), mount=Mount.FREE, position=(0.0, 0.0, 1.0)).add_to(spec, "free")
    ObjectBody(SphereObject(0.02), position=(0.0, 0.1, 1.0)).add_to(spec, "fixed")
    model = spec.compile()
    data = mujoco.MjData(model)
    while data.time < 0.1:
        mujoco.mj_step(model, data)
    assert data.qpos[2] == pytest.approx(1.0 - 9.81 * data.time**2 / 2, abs=9.81 * 0.1 * model.opt.timestep)
    assert data.body("fixed").xpos.tolist() == [0.0, 0.1, 1.0]
    assert model.body("free").mass[0] == pytest.approx(0.1)
    assert model.geom("free").contype == 0


def test_an_object_brings_its_friction_and_nothing_else_to_a_law():
    press = ContactLaw(stiffness=50e3)
    law = ObjectBody(Box(), friction=0.7, spin_length=0.002).law(press)
    assert (law.friction, law.spin_length, law.stiffness) == (0.7, 0.002, 50e3)


def table_under_tip(joint, mu=0.3):
    """A tip pressed on a plate that moves, carried by a stage of springs that stays where it is."""
    plate = MovingTarget(Table(0.0, (0.3, 0.3, 0.02)), [joint])
    spec = mujoco.MjSpec()
    spec.option.timestep, spec.option.cone = DT, mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.integrator, spec.option.gravity = mujoco.mjtIntegrator.mjINT_IMPLICITFAST, [0.0, 0.0, -9.81]
    plate.add_to(spec, "plate")
    tip = spec.worldbody.add_body(name="tip", pos=[0.03, 0.0, 0.008 - 1e-4], gravcomp=1.0)
    tip.add_geom(
        name="tip", type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.008, 0, 0], mass=5.0, contype=0, conaffinity=0
    )
    for i, axis in enumerate(np.eye(3)):
        tip.add_joint(
            name=f"tip_{i}",
            type=mujoco.mjtJoint.mjJNT_SLIDE,
            axis=axis,
            stiffness=[5e6, 0, 0],
            damping=[1e4, 0, 0],
        )
    pair = pair_parameters(ContactLaw(friction=mu), 1.0 / 5.0, DT)
    spec.option.impratio = pair.impratio
    spec.add_pair(
        geomname1="tip", geomname2="plate", condim=4, friction=pair.friction, solref=pair.solref,
        solreffriction=pair.solreffriction, solimp=pair.solimp,
    )  # fmt: skip
    model = spec.compile()
    return plate, model, mujoco.MjData(model)


@pytest.mark.parametrize(
    ("joint", "direction"),
    [
        (DrivenJoint(JointKind.SLIDE, (1.0, 0.0, 0.0), Ramp(0.02)), (1.0, 0.0)),
        (DrivenJoint(JointKind.SLIDE, (0.0, -2.0, 0.0), Ramp(0.02)), (0.0, -1.0)),
        (DrivenJoint(JointKind.HINGE, (0.0, 0.0, 1.0), Ramp(1.0)), (0.0, 1.0)),
    ],
)
def test_a_plate_that_moves_drags_the_tip_along_with_it(joint, direction):
    """Friction of mu f_n in the direction of the plate's own velocity; a mocap plate would not rub at all."""
    plate, model, data = table_under_tip(joint)
    drive = TargetDrive(plate, model, data, "plate")
    force = np.zeros(6)
    for _ in range(600):
        drive.place()
        mujoco.mj_step(model, data)
    mujoco.mj_contactForce(model, data, 0, force)
    frame = data.contact[0].frame.reshape(3, 3)
    tangential = frame.T @ [0.0, force[1], force[2]]
    towards_plate = data.contact[0].geom[0] == model.geom("tip").id  # the force is on the second geom
    on_tip = (-1.0 if towards_plate else 1.0) * tangential
    assert force[0] > 0.5
    assert np.hypot(*force[1:3]) <= 0.3 * force[0] * (1 + 1e-6)
    assert np.allclose(on_tip[:2] / force[0], 0.3 * np.array(direction), atol=0.02)


@pytest.mark.parametrize("motion", [Ramp(0.03, 0.05), Sine(0.004, 2.0, 0.3)])
def test_the_target_is_where_the_motion_says_whatever_pushes(motion):
    joint = DrivenJoint(JointKind.SLIDE, (0.0, 0.0, 1.0), motion)
    plate, model, data = table_under_tip(joint)
    drive = TargetDrive(plate, model, data, "plate")
    dof = model.joint("plate_0").dofadr[0]
    for _ in range(400):
        drive.place()
        before = data.time
        q, v, _ = motion.at(before)
        assert (data.qpos[dof], data.qvel[dof]) == (q, v)
        mujoco.mj_step(model, data)
        # nothing to correct by the next step: gravity and the tip's push do not move it
        q, v, _ = motion.at(data.time)
        if not (isinstance(motion, Ramp) and before < motion.begin <= data.time):
            assert data.qvel[dof] == pytest.approx(v, abs=2e-5)
            assert data.qpos[dof] == pytest.approx(q, abs=1e-6)


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


def test_bad_files_are_refused_by_name(tmp_path):
    good = TRIANGLES[2]
    cases = {}
    hole = trimesh.Trimesh(good.vertices, good.faces[1:], process=False)
    cases["hole"] = (hole, r"hole\.ply: not watertight, 3 edges")
    flipped = good.faces.copy()
    flipped[0] = flipped[0][::-1]
    cases["flip"] = (trimesh.Trimesh(good.vertices, flipped, process=False), r"flip\.ply: not watertight.*senses")
    inside_out = trimesh.Trimesh(good.vertices, good.faces[:, ::-1], process=False)
    cases["inside"] = (inside_out, r"inside\.ply: volume -.*turn its triangles")
    broken = good.vertices.copy()
    broken[5] = np.nan
    cases["nan"] = (trimesh.Trimesh(broken, good.faces, process=False), r"nan\.ply: vertex 5 is \[nan")
    for name, (mesh, message) in cases.items():
        path = tmp_path / f"{name}.ply"
        mesh.export(path)
        with pytest.raises(InvalidValueError, match=message):
            read_triangles(path)
    (tmp_path / "empty.obj").write_text("")
    (tmp_path / "noise.stl").write_bytes(b"\x00\x01\x02")
    for name in ("empty.obj", "noise.stl", "missing.stl"):
        with pytest.raises(InvalidValueError, match=name):
            read_triangles(tmp_path / name)
    with pytest.raises(InvalidValueError, match="mesh: empty"):
        Triangles(np.empty((0, 3)), np.empty((0, 3), np.int64))


def test_a_mesh_that_is_not_convex_is_not_taken_for_its_hull():
    torus = trimesh.creation.torus(0.03, 0.012)
    triangles = Triangles(np.array(torus.vertices), np.array(torus.faces))
    with pytest.raises(InvalidValueError, match=r"not convex.*TracedMesh"):
        ConvexMesh(triangles)
    assert TracedMesh(triangles).signed_distance(np.zeros((1, 3)))[0] == pytest.approx(0.018, rel=0.01)
