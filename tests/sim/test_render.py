"""Pictures of a scene: every body is drawn where it is, and the arrow is the force."""

import ctypes.util

import mujoco
import numpy as np
import pytest
import trimesh
from PIL import Image, ImageSequence

from palpate.errors import InvalidValueError
from palpate.experiments.kit.scene import scene_view
from palpate.kinematics import Pose
from palpate.kinematics.pose import rotation_from_rotvec
from palpate.kinematics.posture import Posture
from palpate.sim import (
    Box,
    ContactLaw,
    CylinderObject,
    EllipsoidObject,
    SphereObject,
    Tip,
    TurningStage,
)
from palpate.sim.carriers.arm_carrier import ArmCarrier
from palpate.sim.objects.body import ObjectBody
from palpate.sim.objects.motion import DrivenJoint, JointKind, MovingTarget, Sine
from palpate.sim.render.files import write_gif, write_png
from palpate.sim.render.gl import NoRendererError, offscreen_context
from palpate.sim.render.place import ScenePlacement
from palpate.sim.render.renderer import ARROW_LENGTH, GROUND, Camera, ContactForce, SceneRenderer
from palpate.sim.render.shapes import shapes_of
from palpate.sim.scene import build_scene
from palpate.surfaces import Ellipsoid, Sphere

START = (0.0, 0.0, 0.06)
SIDE = Camera((0.0, 0.0, 0.04), 0.3, azimuth_deg=90.0, elevation_deg=0.0)
"""Looks along y: x to the right, z up."""

PIXELS_PER_METRE = 480 / (2.0 * 0.3 * np.tan(np.radians(22.5)))
"""In the plane that `SIDE` looks at: MuJoCo's field of view is 45 degrees."""


def at(position):
    return Posture(Pose(position))


def stage(target=None, tip=None):
    return build_scene(tip or Tip(Sphere(0.008)), target or SphereObject(0.03), ContactLaw(), START)


@pytest.fixture(scope="module")
def renderer():
    try:
        made = SceneRenderer(stage().model, camera=SIDE)
    except NoRendererError as error:
        pytest.skip(f"no pictures here: {error}")
    with made:
        yield made


def difference(a, b):
    """Middle and extent of what differs between two pictures: columns, rows."""
    rows, columns = np.nonzero((a != b).any(axis=2))
    return columns.min(), columns.max(), rows.min(), rows.max()


def test_the_tip_is_drawn_where_it_is(renderer):
    empty = renderer.picture(at((0.0, 0.0, 9.0)))
    for x, z in ((0.0, 0.06), (0.03, 0.06), (-0.05, 0.09)):
        left, right, top, bottom = difference(empty, renderer.picture(at((x, 0.0, z))))
        assert (left + right) / 2 - 320 == pytest.approx(PIXELS_PER_METRE * x, abs=2.0)
        assert 240 - (top + bottom) / 2 == pytest.approx(PIXELS_PER_METRE * (z - 0.04), abs=2.0)
        assert right - left == pytest.approx(PIXELS_PER_METRE * 0.016, rel=0.1)


def test_the_arrow_is_as_long_as_the_force_and_has_its_direction(renderer):
    away = at((0.0, 0.0, 9.0))
    empty, point = renderer.picture(away), (0.0, 0.0, 0.04)
    for force in (1.0, 2.0, 4.0):
        length = PIXELS_PER_METRE * ARROW_LENGTH * force
        left, right, top, bottom = difference(
            empty, renderer.picture(away, [ContactForce(point, (force, 0.0, 0.0))])
        )
        assert right - 320 == pytest.approx(length, abs=4.0), force
        upward = difference(empty, renderer.picture(away, [ContactForce((0.0, -0.04, 0.04), (0.0, 0.0, force))]))
        assert upward[2] < 240 - length + 4.0, "the arrow is in front of the object, nearer, so longer"
        assert top > 220, (top, bottom)
        assert left >= 300, "an arrow begins where the force acts"


def test_a_force_too_small_to_see_is_not_drawn(renderer):
    plain = renderer.picture(at(START))
    assert (renderer.picture(at(START), [ContactForce(START, (0.0, 0.0, 0.0))]) == plain).all()
    assert (plain[0, 0] == GROUND).all()


def test_two_renderers_disturb_neither_one_another_nor_their_model(renderer):
    plain, model = renderer.picture(at(START)), stage(Box()).model
    before = [np.array(model.geom_rgba), np.array(model.vis.headlight.ambient), model.vis.global_.offwidth]
    with SceneRenderer(model, 1000, 700) as other:
        box = other.picture(at(START))
        assert box.shape == (700, 1000, 3)
        assert (renderer.picture(at(START)) == plain).all()
        assert (other.picture(at(START)) == box).all()
    assert (renderer.picture(at(START)) == plain).all()
    after = [np.array(model.geom_rgba), np.array(model.vis.headlight.ambient), model.vis.global_.offwidth]
    assert all(np.array_equal(a, b) for a, b in zip(before, after, strict=True))
    other.close()
    with pytest.raises(InvalidValueError, match="closed"):
        other.picture(at(START))


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        (None, r"EGL: no such library; OSMesa: no such library.*apt install libegl1"),
        ("osmesa", r"^(?!.*EGL: no such)"),
    ],
)
def test_without_libraries_the_message_names_the_remedy(monkeypatch, asked, message):
    monkeypatch.setattr(ctypes.util, "find_library", lambda name: None)
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    if asked:
        monkeypatch.setenv("MUJOCO_GL", asked)
    with pytest.raises(NoRendererError, match=message):
        offscreen_context(64, 48)


def test_links_are_where_the_simulation_has_them():
    carrier = ArmCarrier()
    scene = build_scene(Tip(Sphere(0.008)), SphereObject(0.03), ContactLaw(), START, carrier)
    placement, random = ScenePlacement(scene.model), np.random.default_rng(2)
    assert placement.start.arm == pytest.approx(carrier.joint_start(START), abs=1e-12)
    for _ in range(10):
        joints = tuple(random.uniform(-3.0, 3.0, 6).tolist())
        tip = carrier.arm.kinematics.pose(joints)
        poses = placement.poses(Posture(tip, joints))
        assert poses["tip"] == tip
        data = placement.place(Posture(Pose((9.0, 9.0, 9.0)), joints))
        assert data.site("sensor").xpos == pytest.approx(tip.position, abs=1e-12)
        assert {"arm/shoulder", "arm/forearm", "arm/wrist_3"} < set(poses)
        for name, pose in poses.items():
            assert data.body(name).xpos == pytest.approx(pose.position, abs=1e-9)
            assert data.body(name).xmat == pytest.approx(np.ravel(pose.rotation), abs=1e-9)
    with pytest.raises(InvalidValueError, match="has 6 joints that turn"):
        placement.place(at(START))


def test_a_target_that_with_prescribed_motion_is_where_it_belongs_at_that_time():
    slide, turn = Sine(0.05, 1.0), Sine(0.5, 2.0)
    joints = [
        DrivenJoint(JointKind.SLIDE, (1.0, 0.0, 0.0), slide),
        DrivenJoint(JointKind.HINGE, (0, 0, 1.0), turn),
    ]
    spec = mujoco.MjSpec()
    Tip(Sphere(0.008)).add_to(spec.worldbody.add_body(name="wall", pos=START))
    MovingTarget(Box(), joints, (0.0, 0.1, 0.0)).add_to(spec, "plate")
    placement = ScenePlacement(spec.compile(), {"plate_0": slide, "plate_1": turn})
    for time in (0.0, 0.1, 0.37):
        pose = placement.poses(Posture(Pose(START), time=time))["plate"]
        angle = turn.at(time)[0]
        assert pose.position == pytest.approx((slide.at(time)[0], 0.1, 0.0), abs=1e-12)
        assert pose.rotation[0] == pytest.approx((np.cos(angle), -np.sin(angle), 0.0), abs=1e-12)


def test_what_is_fixed_elsewhere_is_drawn_there_and_keeps_its_colour():
    spec = mujoco.MjSpec()
    Tip(Sphere(0.008)).add_to(spec.worldbody.add_body(name="wall", pos=START))
    ObjectBody(SphereObject(0.02), position=(0.3, 0.0, 0.0), colour=(1.0, 0.0, 0.0, 1.0)).add_to(spec, "ball")
    scene = scene_view("t", spec.compile())
    ball = next(part for part in scene.parts if part.body == "" and part.colour != (230, 159, 0))
    assert ball.vertices.mean(axis=0) == pytest.approx((0.3, 0.0, 0.0), abs=1e-9)
    assert ball.colour == (255, 0, 0)


@pytest.mark.parametrize(
    ("target", "volume"),
    [
        (SphereObject(0.03), 4 / 3 * np.pi * 0.03**3),
        (EllipsoidObject((0.05, 0.04, 0.03)), 4 / 3 * np.pi * 0.05 * 0.04 * 0.03),
        (Box((0.08, 0.06, 0.04)), 0.08 * 0.06 * 0.04),
        (CylinderObject(0.02, 0.1), np.pi * 0.02**2 * 0.1),
    ],
)
def test_shapes_lie_on_the_surfaces_they_show(target, volume):
    shape = next(one for one in shapes_of(stage(target).model) if one.name == "object")
    assert not shape.moves
    on_surface = shape.vertices[np.unique(shape.triangles)]
    distance = target.signed_distance(on_surface)
    flat_ends = isinstance(
        target, CylinderObject
    )  # the middle of a flat end is inside its rim, on the surface too
    assert np.abs(distance).max() < 1e-9 or (flat_ends and distance.max() < 1e-9)
    mesh = trimesh.Trimesh(shape.vertices, shape.triangles)
    assert mesh.volume == pytest.approx(volume, rel=0.01), "triangles are counter-clockwise from outside"


def test_a_tip_off_its_frame_is_shown_off_its_frame():
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    surface = Ellipsoid((0.01, 0.006, 0.008), center=np.array([0.0, 0.0, -0.02]), rotation=turn)
    shape = next(one for one in shapes_of(stage(tip=Tip(surface)).model) if one.name == "tip")
    assert shape.moves
    assert shape.vertices.mean(axis=0) == pytest.approx([0.0, 0.0, -0.02], abs=1e-9)
    assert np.ptp(shape.vertices, axis=0) == pytest.approx([0.012, 0.02, 0.016], rel=0.01)


def test_capsules_meshes_and_height_fields_have_their_extent():
    spec = mujoco.MjSpec()
    world = spec.worldbody
    world.add_geom(name="capsule", type=mujoco.mjtGeom.mjGEOM_CAPSULE, size=[0.02, 0.05, 0.0], pos=[1.0, 0.0, 0.0])
    world.add_geom(name="endless", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0.0, 0.0, 1.0])
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]]) * 0.1
    spec.add_mesh(name="corner", uservert=corners.ravel())
    world.add_geom(name="mesh", type=mujoco.mjtGeom.mjGEOM_MESH, meshname="corner", pos=[0.0, 2.0, 0.0])
    heights = np.array([0.0, 0.5, 1.0, 0.0, 0.5, 1.0], np.float32)
    spec.add_hfield(name="ramp", nrow=2, ncol=3, size=[0.2, 0.1, 0.05, 0.01], userdata=heights)
    world.add_geom(name="ramp", type=mujoco.mjtGeom.mjGEOM_HFIELD, hfieldname="ramp")
    found = {shape.name: shape for shape in shapes_of(spec.compile())}
    assert set(found) == {"capsule", "mesh", "ramp"}
    low, high = found["capsule"].vertices.min(axis=0), found["capsule"].vertices.max(axis=0)
    assert low == pytest.approx([0.98, -0.02, -0.07], abs=1e-4)
    assert high == pytest.approx([1.02, 0.02, 0.07], abs=1e-4)
    assert found["mesh"].vertices.min(axis=0) == pytest.approx([0.0, 2.0, 0.0], abs=1e-6)
    ramp = found["ramp"].vertices
    # it rises along x, to the highest of size
    assert ramp[:, 2] == pytest.approx((ramp[:, 0] + 0.2) / 0.4 * 0.05, abs=1e-7)


def test_a_still_comes_back_as_it_was(tmp_path):
    picture = np.random.default_rng(0).integers(0, 256, (20, 30, 3), np.uint8)
    write_png(picture, tmp_path / "a.png")
    assert (np.asarray(Image.open(tmp_path / "a.png")) == picture).all()


def test_a_video_has_its_pictures_and_its_pace(tmp_path):
    pictures = [np.full((20, 30, 3), 20 * i, np.uint8) for i in range(7)]
    assert write_gif(iter(pictures), tmp_path / "a.gif", 0.05) == 7
    with Image.open(tmp_path / "a.gif") as video:
        assert len(list(ImageSequence.Iterator(video))) == 7
        assert video.info["duration"] == 50
        assert video.info["loop"] == 0


def test_a_video_that_fails_halfway_leaves_nothing(tmp_path):
    def pictures():
        yield np.zeros((2, 2, 3), np.uint8)
        raise OSError("the scene is gone")

    with pytest.raises(OSError, match="gone"):
        write_gif(pictures(), tmp_path / "a.gif", 0.05)
    assert not list(tmp_path.iterdir())


def test_a_turned_tip_is_drawn_turned():
    """A stage that turns is placed where the sample says."""
    model = build_scene(Tip(Sphere(0.008)), Box(), ContactLaw(), START, TurningStage()).model
    pose = Pose((0.01, -0.02, 0.03), rotation_from_rotvec((0.6, -0.4, 0.5)))
    data = ScenePlacement(model).place(Posture(pose))
    assert data.site("sensor").xpos == pytest.approx(pose.position, abs=1e-9)
    assert data.site("sensor").xmat == pytest.approx(np.ravel(pose.rotation), abs=1e-9)
