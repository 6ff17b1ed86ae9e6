"""Explorations of what is not convex and of what comes from files: force, points, places, formats, refusals."""

import re
import shutil
import tracemalloc

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.errors import InvalidValueError
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.explored_object import HEIGHTS_TEXT, MESH_TEXT, scene_object
from palpate.experiments.explore.heights_file import heights_text, load_heights, read_heights_text
from palpate.experiments.explore.plan import plan
from palpate.experiments.explore.surface_figure import surface_figure
from palpate.mapping import HeightMap, write_height_map_csv
from palpate.runtime import Ending
from palpate.sim import ConvexMesh, HeightField, TracedMesh
from palpate.sim.objects.traced import TracedObject
from support.drawn import panels
from support.explore_runs import carried_out, check_held, plan_of
from support.refusals import check_refusals
from support.run_bounds import below

SMALL = {"width": 0.02, "depth": 0.004, "spacing": 0.004}
X, Y = np.meshgrid(np.linspace(-0.03, 0.03, 61), np.linspace(-0.02, 0.02, 41))
Z = 0.002 * np.sin(120.0 * X) * np.cos(90.0 * Y) + 0.001
BALL = trimesh.creation.icosphere(subdivisions=3, radius=0.04)


def rounded_box():
    corner = trimesh.creation.icosphere(subdivisions=3, radius=0.012).vertices
    corners = [corner + np.array([x, y, z]) for x in (-0.02, 0.02) for y in (-0.02, 0.02) for z in (-0.01, 0.01)]
    return trimesh.Trimesh(np.concatenate(corners)).convex_hull


MESHES = {"ball": BALL, "rounded box": rounded_box(), "ring": trimesh.creation.torus(0.06, 0.025)}


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("objects")
    for name, mesh in MESHES.items():
        mesh.export(folder / f"{name}.stl")
    rows = np.column_stack([X.ravel(), Y.ravel(), Z.ravel()])
    np.savetxt(folder / "z.csv", rows, delimiter=",", header="x_m,y_m,z_m", comments="", fmt="%.17g")
    np.save(folder / "z.npy", Z)
    return folder


def described(files, name):
    """Fields of a configuration for an object."""
    if name in ("bumps", "torus"):
        return {"object": name}
    if name == "heights":
        return {"object": "height-field", "file": files / "z.csv"}
    return {"object": "mesh", "file": files / f"{name}.stl", "center": (0.06, 0.0) if name == "ring" else ()}


# --- where it stands ---


@settings(max_examples=10, deadline=None)
@given(st.tuples(*[st.floats(-0.5, 0.5)] * 3))
def test_a_mesh_stands_on_the_ground_in_the_middle_wherever_its_file_has_it(tmp_path_factory, shift):
    mesh = MESHES["rounded box"].copy()
    mesh.apply_translation(shift)
    path = tmp_path_factory.getbasetemp() / "moved.ply"
    mesh.export(path)
    target = scene_object(ExploreConfig(object="mesh", file=path, tip=(0.008,)))
    assert isinstance(target, TracedMesh)
    low, high = target.triangles.vertices.min(axis=0), target.triangles.vertices.max(axis=0)
    assert low[2] == target.bottom == 0.0
    assert target.top == pytest.approx(0.044, abs=1e-4)
    assert (low + high)[:2] == pytest.approx((0.0, 0.0), abs=1e-15)


@pytest.mark.slow
def test_heights_below_zero_are_found_as_well(tmp_path):
    """How high the whole lies makes no difference."""
    found = []
    for height in (0.0, -0.05):
        np.save(tmp_path / "z.npy", Z + height)
        config = ExploreConfig(
            object="height-field", file=tmp_path / "z.npy", size=(0.06, 0.04), **SMALL, speed=0.05
        )
        found.append(carried_out(plan_of(config)))
    assert all(one.run.ending is Ending.DONE for one in found)
    assert len(found[0].cloud) == pytest.approx(len(found[1].cloud), abs=2)
    assert found[0].force_rms == pytest.approx(found[1].force_rms, rel=1e-3)


@pytest.mark.slow
def test_a_file_in_millimetres_is_refused_and_with_a_scale_it_is_the_same_object(tmp_path):
    big = BALL.copy()
    big.apply_scale(1000.0)
    big.export(tmp_path / "mm.obj")
    BALL.export(tmp_path / "m.obj")
    check_refusals(
        (
            r"mm\.obj: 80 m across.*--scale 0\.001",
            lambda: scene_object(ExploreConfig(object="mesh", file=tmp_path / "mm.obj")),
        ),
        (
            r"8e-05 m across.*metres already.*leave --scale out",
            lambda: scene_object(ExploreConfig(object="mesh", file=tmp_path / "m.obj", scale=0.001)),
        ),
    )
    scaled, same = (
        scene_object(ExploreConfig(object="mesh", file=tmp_path / f"{name}.obj", scale=scale))
        for name, scale in (("mm", 0.001), ("m", 1.0))
    )
    points = np.random.default_rng(0).uniform(-0.05, 0.1, (100, 3))
    assert isinstance(scaled, ConvexMesh)
    assert isinstance(same, ConvexMesh)
    assert np.allclose(scaled.signed_distance(points), same.signed_distance(points), rtol=0, atol=1e-8)


def test_a_tip_that_is_no_sphere_touches_convex_meshes_only(files):
    tip = (0.008, 0.008, 0.01)
    assert isinstance(scene_object(ExploreConfig(**described(files, "ball"), tip=(0.008,))), TracedMesh)
    assert isinstance(scene_object(ExploreConfig(**described(files, "ball"), tip=tip)), ConvexMesh)
    check_refusals(
        (
            r"not convex.*a tip that is a sphere",
            lambda: scene_object(ExploreConfig(**described(files, "ring"), tip=tip)),
        ),
        (
            r"tip = 0\.008 0\.008 0\.01: a torus is touched by a sphere only",
            lambda: plan_of(ExploreConfig(object="torus", tip=tip)),
        ),
    )


# --- formats of heights ---


def grid_text(header=""):
    return header + "\n".join(",".join(map(repr, row)) for row in Z.tolist())


def points_text(header=""):
    return header + "\n".join(f"{x:g},{y:g},{z:g}" for x, y, z in zip(X.flat, Y.flat, Z.flat, strict=True))


def test_all_formats_of_heights_give_the_same_field(tmp_path, files):
    rng = np.random.default_rng(0)
    rows = np.column_stack([np.arange(Z.size), X.ravel() + 1.0, Y.ravel() - 2.0, Z.ravel()])
    rng.shuffle(rows)
    np.savetxt(tmp_path / "far.csv", rows, delimiter=",", header="note, x_m, y_m, z_m", comments="", fmt="%.17g")
    (tmp_path / "said.csv").write_text(grid_text("# width_m=0.06, depth_m=0.04\n"))
    (tmp_path / "bare.csv").write_text(grid_text())
    np.savetxt(tmp_path / "mm.csv", 1e3 * Z, delimiter=",", fmt="%.17g")
    for field in (
        load_heights(files / "z.csv", 1.0, ()),
        load_heights(tmp_path / "far.csv", 1.0, ()),
        load_heights(tmp_path / "said.csv", 1.0, ()),
        load_heights(tmp_path / "bare.csv", 1.0, (0.06, 0.04)),
        load_heights(files / "z.npy", 1.0, (0.06, 0.04)),
        load_heights(tmp_path / "mm.csv", 1e-3, (0.06, 0.04)),
    ):
        assert np.allclose(field.heights, Z, rtol=0, atol=1e-15)
        assert (field.width, field.depth) == pytest.approx((0.06, 0.04), rel=1e-12)


def test_a_height_map_that_was_explored_can_be_explored_again(tmp_path):
    written = HeightMap(X[0], Y[:, 0], Z, np.zeros_like(Z), 0.0)
    write_height_map_csv(written, tmp_path / "height_map.csv")
    field = load_heights(tmp_path / "height_map.csv", 1.0, ())
    assert np.array_equal(field.heights, Z)
    holed = np.where(Z > 0.0029, np.nan, Z)
    write_height_map_csv(HeightMap(X[0], Y[:, 0], holed, np.zeros_like(Z), 0.0), tmp_path / "holed.csv")
    count = np.isnan(holed).sum()
    field = load_heights(tmp_path / "holed.csv", 1.0, ())
    assert 0 < count == field.untouched
    there = ~np.isnan(holed)
    assert np.array_equal(field.heights[there], Z[there])
    assert np.abs(field.heights - Z).max() < 0.1 * np.ptp(Z), "the fill continues the surface without steps"
    again = read_heights_text(heights_text(field), "object.csv")
    assert again.untouched == count
    assert np.array_equal(again.parameters, field.parameters)
    holed = ExploreConfig(object="height-field", file=tmp_path / "holed.csv", **SMALL)
    told = plan_of(holed).dry_run().notes
    assert f"{count} of 2501 places of the height field were not touched" in " ".join(told)


def test_missing_heights_of_a_plane_are_the_planes_and_a_line_is_refused(tmp_path):
    plane = 0.3 * X - 0.2 * Y
    holed = np.where(np.hypot(X - 0.005, Y) < 0.01, np.nan, plane)
    write_height_map_csv(HeightMap(X[0], Y[:, 0], holed, np.zeros_like(Z), 0.0), tmp_path / "plane.csv")
    assert np.allclose(load_heights(tmp_path / "plane.csv", 1.0, ()).heights, plane, rtol=0, atol=1e-12)
    square = [(0.01 * i, 0.01 * j, 0.0 if i == j else float("nan")) for i in range(8) for j in range(8)]
    with pytest.raises(InvalidValueError, match="its heights lie on one line"):
        map_with(tmp_path, square)


def map_with(tmp_path, points):
    path = tmp_path / "points.csv"
    path.write_text("\n".join(["x_m,y_m,z_m", *(f"{x!r},{y!r},{z!r}" for x, y, z in points)]))
    return load_heights(path, 1.0, ())


def test_a_point_that_stands_twice_in_a_map_is_refused(tmp_path):
    """Two heights of one place: nobody would know which was taken."""
    points = [(0.01 * i, 0.01 * j, 0.001 * i * j) for i in range(5) for j in range(4)]
    assert map_with(tmp_path, points).heights.shape == (4, 5)
    with pytest.raises(InvalidValueError, match="1 points stand in it more than once"):
        map_with(tmp_path, [*points, (0.02, 0.01, 0.003)])


def test_points_along_a_diagonal_are_refused_without_room_for_their_square(tmp_path):
    """The grid of 6000 places along x and y would take 288 MB."""
    tracemalloc.start()
    try:
        with pytest.raises(InvalidValueError, match="35994000 of 36000000 points of its grid have no height"):
            map_with(tmp_path, [(1e-5 * i, 1e-5 * i, 0.0) for i in range(6000)])
        _, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert most < 2e7


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10**6), st.floats(0.01, 0.5), st.floats(0.01, 0.5))
def test_heights_as_text_read_back_to_the_same_bits(seed, width, depth):
    field = HeightField(1e-3 * np.random.default_rng(seed).normal(size=(5, 7)), width, depth)
    again = read_heights_text(heights_text(field), "object.csv")
    assert np.array_equal(again.parameters, field.parameters)


# --- logs ---


def packed(planned):
    """Every bit of a surface."""
    assert isinstance(planned.target, TracedObject)
    return planned.target.parameters


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ball", "heights"])
def test_a_log_keeps_the_object_itself_so_that_its_file_may_change_or_go(name, tmp_path, files):
    fields = described(files, name)
    copy = tmp_path / "object.stl" if name == "ball" else tmp_path / "object.csv"
    shutil.copy(fields["file"], copy)
    planned = plan_of(ExploreConfig(**{**SMALL, **fields, "width": 0.005, "speed": 0.05, "file": copy}))
    texts = {"a log": "says more", **planned.attachments()}

    def again_with(texts):
        return plan(planned.config, planned.robot, texts)

    assert {MESH_TEXT, HEIGHTS_TEXT} & set(texts) == {MESH_TEXT if name == "ball" else HEIGHTS_TEXT}
    first = carried_out(planned)
    copy.write_text("something else")
    assert np.array_equal(packed(again_with(texts)), packed(planned))
    copy.unlink()
    again = again_with(texts)
    assert np.array_equal(packed(again), packed(planned))
    assert again.limits == planned.limits
    assert again.attachments() == planned.attachments()
    second = carried_out(again)
    assert np.array_equal(second.record.command, first.record.command)
    assert np.array_equal(second.truth.force, first.truth.force)
    assert np.array_equal(second.point_error, first.point_error)
    del texts[MESH_TEXT if name == "ball" else HEIGHTS_TEXT]
    with pytest.raises(InvalidValueError, match=r"object\.\w+' is missing"):
        again_with(texts)


@pytest.mark.parametrize("text", ["", "OFF", "OFF\n1 1 0\n0 0 0\n", "OFF\nx y z", "solid"])
def test_a_damaged_mesh_in_a_log_is_refused(text, files):
    planned = plan_of(ExploreConfig(**SMALL, **described(files, "ball")))
    with pytest.raises(InvalidValueError, match=r"object\.off"):
        plan(planned.config, planned.robot, {MESH_TEXT: text})


# --- what fits ---


@pytest.mark.parametrize(
    ("name", "fields"),
    [
        ("torus", {"center": (0.0, 0.0)}),
        ("torus", {"size": (0.03, 0.012), "width": 0.04, "depth": 0.04}),
        ("bumps", {"width": 0.17}),
        ("heights", {"width": 0.04, "depth": 0.04}),
        ("heights", {"width": 0.02, "depth": 0.02, "center": (0.1, 0.0)}),
        ("ring", {"center": (0.0, 0.0), "width": 0.03, "depth": 0.03}),
        ("ball", {"width": 0.1}),
    ],
)
def test_a_raster_that_does_not_fit_is_refused_with_one_that_does(name, fields, files):
    values = {**described(files, name), **fields}
    with pytest.raises(InvalidValueError, match="can be touched from above") as refusal:
        plan_of(ExploreConfig(**values))
    message, advice = str(refusal.value), []
    smaller = re.search(r"at most (\S+) x (\S+) m", message)
    if smaller:
        advice.append({"width": float(smaller[1]), "depth": float(smaller[2])})
    other = re.search(r"--center (\S+) (\S+)(?: --width (\S+) --depth (\S+))? fits", message)
    if other:
        size = {"width": float(other[3]), "depth": float(other[4])} if other[3] else {}
        advice.append({"center": (float(other[1]), float(other[2])), **size})
    assert advice
    for each in advice:
        plan_of(ExploreConfig(**{**values, **each}))


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("gone.csv", None, "cannot be read: No such file"),
        ("mm.csv", points_text("x_mm,y_mm,z_mm\n"), "no column x_m: there are x_mm, y_mm, z_mm; "),
        ("mm.csv", points_text("x_mm,y_mm,z_mm\n"), "--scale 0.001"),
        ("capitals.csv", points_text("X,Y,Z\n"), "no column x_m"),
        ("bare.csv", points_text(), "points"),
        ("a.csv", "1,2\n3\n", "line 2, '3': has 1 fields: must be 2"),
        ("b.csv", "# width_m=0.1 depth_m=0.1\n1,2\n3,x\n", "line 3: column 2 = 'x': must be a number"),
        ("c.csv", "x_m,y_m\n0,0\n", "no column z_m: there are x_m, y_m"),
        ("d.csv", "x_m,y_m,z_m\n0,0,0\n0,1,0\n", "x_m must be numbers that span a grid"),
        ("e.csv", "x_m,y_m,z_m\n0,0,0\n0,1,0\n1,0,0\n3,1,0\n", "x_m is on no regular grid"),
        ("f.csv", grid_text(), "has no width and depth; give --size WIDTH DEPTH"),
        ("g.csv", grid_text("# width_m=60 depth_m=40\n"), "60 m across"),
        ("h.csv", "", "no line with numbers; write the heights"),
        ("i.csv", "# width_m=0.1 depth_m=0.1\n0,0\n0,0\n", "heights has shape (2, 2)"),
        ("j.npy", "not numpy", "cannot be read as an array of numbers"),
        ("k.csv", "# width_m=0.1 depth_m=0.1\n0,0,0,0\n" + "0,0,nan,0\n" * 3, "heights[1, 2] = nan"),
        (
            "l.csv",
            "# width_m=0.06 depth_m=0.04\n" + "0,1.5,1.5,0\n" * 4,
            "1.5 m, must be at most 1 m up or down",
        ),
        ("m.csv", "# width_m=0.06 depth_m=0.04\n" + "-3,-2.5,-2.5,-3\n" * 4, "give --scale 0.001"),
    ],
)
def test_files_of_heights_that_are_none_are_refused_by_name(name, text, message, tmp_path):
    if text is not None:
        (tmp_path / name).write_text(text)
    with pytest.raises(InvalidValueError, match=re.escape(message)) as refusal:
        scene_object(ExploreConfig(object="height-field", file=tmp_path / name))
    assert name in str(refusal.value)


# --- runs ---


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "robot", "size"),
    [
        ("heights", "stage", {"depth": 0.02}),
        ("heights", "ur5e-sim", {"width": 0.02, "depth": 0.004, "spacing": 0.004, "center": (0.01, 0.0)}),
        ("ball", "ur5e-sim", {}),
        ("rounded box", "stage", {}),
        ("ring", "stage", {"width": 0.034, "depth": 0.034}),
    ],
)
def test_an_object_from_a_file_is_explored_as_a_built_in_one_is(name, robot, size, files):
    fields = {**described(files, name), "robot": robot, "speed": 0.02, "spacing": 0.01, **size}
    found = carried_out(plan_of(ExploreConfig(**fields)))
    check_held(found, below(force_rms=0.2, point_rms=1e-6 if (name, robot) == ("heights", "stage") else 1e-5))
    (true,) = (each for each in panels(surface_figure(found))[0].marks if each.name == "true surface")
    assert np.isfinite(true.vertices).all()
    if "center" in size:
        # up to a tip's radius times the steepest slope beside the path of its centre
        middle = 0.5 * (found.cloud.position.min(axis=0) + found.cloud.position.max(axis=0))
        assert middle[0] == pytest.approx(size["center"][0], abs=3e-3)
