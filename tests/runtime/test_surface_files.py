"""Fingertips in robot files that name a mesh, patches, or somebody's class."""

import numpy as np
import pytest
import trimesh

from palpate.errors import InvalidValueError
from palpate.robots.in_scene import check
from palpate.robots.robot import ROBOT_TEXT, load_robot, read_robot
from palpate.surfaces import CompliantTip, Composite, MeshSurface
from palpate.surfaces.symbolic import SymbolicSurface

BALL = trimesh.creation.icosphere(subdivisions=2, radius=0.008)
STAGE = load_robot("stage").texts[ROBOT_TEXT]


def robot_with(folder, surface):
    before, rest = STAGE.split("  - surface:", 1)
    file = folder / "mine.yaml"
    file.write_text(f"{before}  - surface: {surface}\n{rest[rest.index('    payload:') :]}")
    return load_robot(str(file))


@pytest.mark.parametrize("ending", ["stl", "obj", "off", "ply"])
def test_a_mesh_is_read_with_its_robot_and_again_from_the_log_alone(tmp_path, ending):
    BALL.export(tmp_path / f"ball.{ending}")
    robot = robot_with(tmp_path, f"{{kind: mesh, file: ball.{ending}, center_m: [0, 0, 0.01]}}")
    (tmp_path / f"ball.{ending}").unlink()
    check(robot)
    for again in (robot, read_robot(robot.texts)):
        surface = again.file.fingers[0].surface.surface()
        assert isinstance(surface, MeshSurface)
        assert len(surface.triangles) == len(BALL.faces)
        assert np.allclose(surface.half_lengths, 0.008, atol=1e-4)
        assert surface.center.tolist() == [0.0, 0.0, 0.01]
    here, again = (each.file.fingers[0].surface.surface() for each in (robot, read_robot(robot.texts)))
    assert isinstance(here, MeshSurface)
    assert isinstance(again, MeshSurface)
    assert (here.vertices == again.vertices).all()


def test_a_skin_is_put_on_a_mesh_in_millimetres(tmp_path):
    BALL.copy().apply_scale(1000.0).export(tmp_path / "ball.stl")
    mesh = "{kind: mesh, file: ball.stl, scale_m: 0.001}"
    robot = robot_with(tmp_path, f"{{kind: compliant, tip: {mesh}, stiffness_N_per_m: 40000}}")
    check(robot)
    assert isinstance(robot.file.fingers[0].surface.surface(), CompliantTip)
    assert max(robot.file.fingers[0].surface.half_extents) == pytest.approx(0.008, abs=1e-4)


def opened(mesh):
    mesh.update_faces(np.arange(len(mesh.faces)) > 0)


def dented(mesh):
    mesh.vertices = np.where(np.arange(len(mesh.vertices))[:, None] == 0, 0.8, 1.0) * mesh.vertices


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (lambda mesh: mesh.apply_scale(1000.0), ("half lengths are [8.0", "0.5 m", "scale_m: 0.001")),
        (lambda mesh: mesh.invert(), ("counter-clockwise seen from outside",)),
        (opened, ("belongs to one triangle only", "must be closed")),
        (dented, ("not convex", "take its convex hull")),
        (lambda mesh: mesh.apply_translation([0.0, 0.0, 0.02]), ("origin is not inside",)),
    ],
)
def test_a_mesh_that_is_no_fingertip_is_refused_in_one_line(tmp_path, damage, words):
    mesh = BALL.copy()
    damage(mesh)
    mesh.export(tmp_path / "ball.stl")
    with pytest.raises(InvalidValueError) as found:
        robot_with(tmp_path, "{kind: mesh, file: ball.stl}")
    for word in (*words, "mine.yaml: fingers[0].surface: ball.stl", "(line 24, column"):
        assert word in str(found.value)
    assert "\n" not in str(found.value)


@pytest.mark.parametrize(
    ("surface", "words"),
    [
        ("{kind: mesh, file: none.stl}", ("none.stl", "no such file", "line 24")),
        ("{kind: mesh, file: ball.step}", ("ends in .step", ".stl", "line 24")),
        ("{kind: mesh, file: ball.stl, scale_m: 0}", ("scale_m = 0", "line 24")),
        ("{kind: composite, patches: []}", ("patches", "line 24")),
        ("{kind: composite, patches: [{surface: {kind: capsule, radius_m: 0.008, length_m: 0.02}}]}",
         ("kind = capsule", "part of a sphere", "line 24")),
        ("{kind: composite, patches: [{surface: {kind: sphere, radius_m: 0.008}, within: [{normal: [0, 0, 0]}]}]}",
         ("within[0].normal", "above 0", "line 24")),
    ],
)  # fmt: skip
def test_wrong_settings_have_their_line(tmp_path, surface, words):
    with pytest.raises(InvalidValueError) as found:
        robot_with(tmp_path, surface)
    for word in words:
        assert word in str(found.value)


def test_a_thimble_of_patches_is_a_capsule(tmp_path):
    cap = "{surface: {kind: sphere, radius_m: 0.008}, within: [{normal: [0, 0, 2]}]}"
    tube = (
        "{surface: {kind: cylinder, radius_m: 0.008}, "
        "within: [{normal: [0, 0, -1]}, {normal: [0, 0, 1], distance_m: 0.02}]}"
    )
    robot = robot_with(tmp_path, f"{{kind: composite, patches: [{cap}, {tube}]}}")
    check(robot)
    entry = robot.file.fingers[0].surface
    surface = entry.surface()
    assert isinstance(surface, Composite)
    assert entry.half_extents == (0.008,) * 3
    assert surface.patches[0].half_spaces.tolist() == [[0.0, 0.0, 1.0, 0.0]]


EGG = """
import casadi
from palpate.robots.surface_entries import PlacedSurface
from palpate.surfaces.symbolic import SymbolicSurface

class Egg(PlacedSurface, frozen=True, kw_only=True):
    radius_m: float
    def surface(self):
        p = casadi.SX.sym("point", 3)
        x, y, z = (p[i] / self.radius_m for i in range(3))
        return SymbolicSurface(p, x**2 + y**2 + z**2 + 0.1 * z**3 - 1.0, self.radius_m)
"""


@pytest.mark.slow
def test_a_symbolic_surface_of_ones_own_is_named_by_its_class(tmp_path, monkeypatch):
    (tmp_path / "egg.py").write_text(EGG)
    monkeypatch.chdir(tmp_path)
    robot = robot_with(tmp_path, "{kind: 'egg.py:Egg', radius_m: 0.008}")
    check(robot)
    assert isinstance(robot.file.fingers[0].surface.surface(), SymbolicSurface)
    with pytest.raises(InvalidValueError, match="radius"):
        robot_with(tmp_path, "{kind: 'egg.py:Egg'}")
