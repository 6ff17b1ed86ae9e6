"""Scenes of one's own: the surface that is known is the one that MuJoCo simulates, and nothing else changes."""

from pathlib import Path

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from palpate.errors import InvalidValueError
from palpate.sim import (
    ContactLaw,
    ConvexMesh,
    FrozenScene,
    SceneFile,
    SceneTarget,
    SphereObject,
    StaticObject,
    Tip,
    build_scene,
)
from palpate.sim.objects.posed import PosedGeom
from palpate.surfaces import Sphere
from support.refusals import check_refusals
from support.simulated import move, started

SCENES = Path(__file__).parents[2] / "examples" / "scenes"
KINDS = [
    getattr(mujoco.mjtGeom, f"mjGEOM_{kind}") for kind in ("SPHERE", "ELLIPSOID", "BOX", "CYLINDER", "CAPSULE")
]
TIP = 0.008
DOWN = (0.0, 0.0, -0.01)


@pytest.fixture
def scene(tmp_path):
    """Write a scene, and read it."""

    def write(inside, before="", kind=SceneFile):
        path = tmp_path / "own.xml"
        path.write_text(f"<mujoco>{before}<worldbody>{inside}</worldbody></mujoco>")
        return kind.read(path)

    return write


def over(target, x=0.0, stiffness=20e3):
    top = target.shape.top
    return started(build_scene(Tip(Sphere(TIP)), target, ContactLaw(stiffness), (x, 0.0, top + TIP + 1e-3)))


def lowered(backend, periods):
    return move(backend, periods, DOWN), backend.truth()


@settings(max_examples=40, deadline=None)
@given(kind=st.sampled_from(KINDS), seed=st.integers(0, 2**32 - 1))
def test_the_surface_of_a_placed_geom_is_the_one_that_mujoco_collides(kind, seed):
    rng = np.random.default_rng(seed)
    size, turn = rng.uniform(0.01, 0.05, 3), Rotation.random(random_state=rng)
    geom = PosedGeom(kind, size, rng.uniform(-0.1, 0.1, 3), turn.as_matrix())
    x, y = geom.position[:2, None] + rng.uniform(-0.05, 0.05, (2, 50))
    z = geom.height(x, y)
    met = np.isfinite(z)
    upper, lower = [np.stack([x, y, z + side], axis=1)[met] for side in (1e-5, -1e-9)]
    assert (geom.signed_distance(upper) > 0.0).all()
    assert (geom.signed_distance(lower) < 1e-12).all()
    assert geom.bottom <= z[met].min(initial=np.inf)
    assert z[met].max(initial=-np.inf) <= geom.top + 1e-12

    spec = mujoco.MjSpec()
    geom.add_geom(spec.worldbody, "own")
    point = geom.position + rng.normal(size=3) * 0.06
    spec.worldbody.add_geom(name="ball", size=[1e-3, 0.0, 0.0], pos=point)
    model = spec.compile()
    model.opt.ccd_tolerance = 1e-9
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    known = float(geom.signed_distance(point[None])[0])
    if known > 1e-3 + 1e-5:
        found = mujoco.mj_geomDistance(model, data, 0, 1, 1.0, None)
        assert found + 1e-3 == pytest.approx(known, abs=2e-6)


def test_a_ball_from_a_file_is_pressed_like_the_built_in_one(scene):
    ball = scene('<body pos="0.3 0.2 1" euler="10 20 30"><geom name="ball" size="0.04"/></body>')
    (felt, there), (wanted, known) = (
        lowered(over(it), 250) for it in (SceneTarget.of(ball, "ball"), StaticObject(SphereObject(0.04)))
    )
    assert known.force[2] > 1.0
    assert there.force == pytest.approx(known.force, abs=1e-9)
    assert np.subtract(there.position, known.position) == pytest.approx([0.0, 0.0, 0.04], abs=1e-12)
    assert felt.wrenches[0].wrench[:3] == pytest.approx(wanted.wrenches[0].wrench[:3], abs=1e-9)


def test_the_tip_meets_what_stands_around_and_the_truth_is_of_what_is_touched(scene):
    both = scene('<geom name="ball" size="0.04"/><geom type="box" size="0.1 0.1 0.04" pos="0.2 0 0"/>')
    found, truth = lowered(over(SceneTarget.of(both, "ball"), x=0.2), 300)
    assert not truth.touching
    assert np.linalg.norm(found.wrenches[0].wrench[:3]) > 1.0


def test_a_lever_turns_under_the_tip():
    backend = over(SceneTarget.of(SceneFile.read(SCENES / "handle.xml"), "lever"), stiffness=4e3)
    _, first = lowered(backend, 300)
    _, truth = lowered(backend, 50)
    assert first.touching
    assert truth.pose_base_object.rotation[2][0] < first.pose_base_object.rotation[2][0] < -1e-3
    # the contact is where the lever's own frame has its surface, on top of a capsule of 10 mm
    assert truth.position_object[2] == pytest.approx(0.01, abs=5e-4)
    fixed = over(SceneTarget.of(FrozenScene.read(SCENES / "handle.xml"), "handle"))
    assert fixed.scene.model.nv == 3  # the stage's


def test_what_a_log_keeps_is_the_same_scene_without_its_files(tmp_path):
    for path in (*SCENES.glob("bottle.*"), *SCENES.glob("handle.*")):
        (tmp_path / path.name).write_bytes(path.read_bytes())
    (tmp_path / "all.xml").write_text('<mujoco><include file="bottle.xml"/><include file="handle.xml"/></mujoco>')
    read = SceneFile.read(tmp_path / "all.xml")
    for path in tmp_path.iterdir():
        path.unlink()
    again = SceneFile.kept("scene.xml", read.text, read.files_text())
    one, other = (over(SceneTarget.of(each, "bottle")).scene.model for each in (read, again))
    assert (one.geom_pos == other.geom_pos).all()
    assert (one.mesh_vert == other.mesh_vert).all()


@pytest.mark.parametrize(
    ("inside", "touch", "words"),
    [
        ('<geom name="a" size="0.04"/>', "b", "touch = 'b': .*own.xml has no such geom or body; geoms: a"),
        ('<geom name="a" size="40"/>', "a", "line 1: a is 80 m across, must be 0.001 to 2 m; is it"),
        ('<geom name="a" size="0.04"/><body><geom name="b" size="0.04"/></body>', "", "2 geoms: .*: a, b"),
        ('<body name="c"><geom size="0.1"/><geom size="0.2"/></body>', "c", "'c'.* 2 geoms: must be one"),
        ('<geom name="a" type="plane" size="1 1 1"/>', "a", "a is a plane: must be a sphere, ellipsoid, box"),
        ('<body><joint/><geom name="a" size="0.04" mass="0"/></body>', "a", "mass and inertia of moving bodies"),
        ('<geom name="a" size="0"/>', "a", "MuJoCo refuses it: size 0 must be positive"),
    ],
)  # fmt: skip
def test_a_scene_that_cannot_be_is_refused_in_one_line(scene, inside, touch, words):
    with pytest.raises(InvalidValueError, match=words) as caught:
        SceneTarget.of(scene(inside), touch)
    assert "\n" not in str(caught.value)
    assert "own.xml" in str(caught.value)


def test_files_that_are_not_there_and_starts_that_are_taken_are_refused(scene):
    check_refusals(
        (
            r"own.xml, line 1: gone.stl: cannot be read: No such file",
            lambda: scene("", '<asset><mesh name="m" file="gone.stl"/></asset>'),
        ),
        ("MuJoCo refuses it: XML Error", lambda: scene("<ball/>")),
        ("not convex", lambda: SceneTarget.of(SceneFile.read(SCENES / "bottle.xml"), "bottle", ConvexMesh)),
    )
    below = scene('<geom name="a" size="0.04"/><geom name="lid" type="box" size="0.1 0.1 0.01" pos="0 0 0.05"/>')
    with pytest.raises(InvalidValueError, match=r"tip starts .* inside geom 'lid'"):
        over(SceneTarget.of(below, "a"))
