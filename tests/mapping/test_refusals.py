"""Bad inputs of mapping, and the words with which each is refused."""

import numpy as np
import pytest
import trimesh

from mapping.felt_shapes import cloud_at
from mapping.raster import cloud_of, sphere_cap
from palpate.errors import InvalidValueError
from palpate.mapping import (
    HeightMap,
    MapSettings,
    SurfaceMap,
    SurfaceModel,
    TouchCloud,
    surface_mesh,
    write_cloud_ply,
    write_mesh,
)
from palpate.mapping.compare import TouchedMap, compare
from palpate.mapping.compare_surface import TriangleSurface
from palpate.mapping.layers import VertexLayer, vertex_layer, write_layered_mesh
from palpate.mapping.primitives import PrimitiveKind, choose_primitive, fit_primitive
from palpate.mapping.stiffness import local_stiffness
from palpate.mapping.surface_map import SurfaceMesh, half_widths

NAN, INF, UP = np.nan, np.inf, [0.0, 0.0, 1.0]
CAP = sphere_cap(half=0.004, step=4e-4)
POINTS = np.random.default_rng(0).uniform(0.0, 0.01, (60, 3))
TRIANGLE = SurfaceMesh(np.eye(3), np.eye(3), np.array([[0, 1, 2]]), np.zeros(3), np.zeros(3, np.int8), 0.0, 1.0)
BALL = trimesh.creation.icosphere(subdivisions=2, radius=0.02)
REFERENCE = TriangleSurface(BALL.vertices, BALL.faces)
RIGHT = {
    "time": np.arange(3.0),
    "position": np.zeros((3, 3)),
    "normal": np.tile(UP, (3, 1)),
    "normal_force": np.ones(3),
    "tangential_force": np.zeros((3, 3)),
    "spin_torque": np.zeros(3),
}


def cloud(**wrong):
    return TouchCloud(**(RIGHT | wrong))


def pressed(n=20, force=20, window=5e-3):
    path = np.outer(np.arange(n), [1e-4, 0.0, 0.0])
    return local_stiffness(
        np.arange(n), path, np.tile(UP, (n, 1)), np.ones(force), noise=SurfaceModel(), window=window
    )


def fitted(kind, position, **more):
    return fit_primitive(cloud_at(position, np.tile(UP, (len(position), 1))), kind, **more)


ROWS = [
    ("four positions", lambda: cloud(position=np.zeros((4, 3))), r"position has shape \(4, 3\): must be \(3, 3\)"),
    ("column of forces", lambda: cloud(normal_force=np.zeros((3, 1))), "normal_force has shape"),
    ("long normals", lambda: cloud(normal=np.full((3, 3), 1.0)), "length must be 1"),
    ("time backwards", lambda: cloud(time=np.array([0.0, 2.0, 1.0])), "backwards"),
    ("nan position", lambda: cloud(position=np.array([[0, 0, 0], [NAN, 0, 0], [0, 0, 0]])), "contact 1 .*finite"),
    ("torque of words", lambda: cloud(spin_torque=["a", "b", "c"]), "numbers"),
    ("no noise", lambda: cloud(noise=np.zeros(3)), "noise of contact 0"),
    ("select by number", lambda: CAP.select(np.array([0, 1])), "bool"),
    *((f"spacing {x}", lambda x=x: CAP.thinned(x), "spacing") for x in (0.0, -1.0, NAN, INF)),
    ("spacing 0 of heights", lambda: HeightMap.from_cloud(CAP, 0.0), "spacing"),
    ("negative reach", lambda: HeightMap.from_cloud(CAP, 1e-3, -1.0), "reach"),
    ("micrometres", lambda: HeightMap.from_cloud(CAP, 1e-6, 1e-3), "in metres"),
    ("undersides", lambda: HeightMap.from_cloud(cloud_of(CAP.position, -CAP.normal), 5e-4), "from above"),
    ("nothing felt", lambda: HeightMap.from_cloud(cloud_of(*np.zeros((2, 0, 3))), 5e-4), "none of 0 contacts"),
    ("two words", lambda: vertex_layer("two words", POINTS, POINTS, np.zeros(60), 1.0), "must be one word"),
    ("three values", lambda: vertex_layer("v", POINTS, POINTS, np.zeros(3), 1.0), "one per contact"),
    ("empty mesh", lambda: write_layered_mesh(surface_mesh(SurfaceMap()), (), "map.ply"), "the mesh is empty"),
    ("empty file", lambda: write_mesh(surface_mesh(SurfaceMap()), "none.ply"), "empty"),
    (
        "layer of two",
        lambda: write_layered_mesh(
            surface_mesh(mapped(), 1e-3), (VertexLayer("v", np.zeros(2), np.zeros(2)),), "map.ply"
        ),
        "layer v has 2 values",
    ),
    ("format", lambda: write_mesh(TRIANGLE, "map.step"), r"\.ply"),
    ("micrometre voxels", lambda: surface_mesh(mapped(), 1e-6), "metres"),
    ("no voxels", lambda: surface_mesh(mapped(), 0.0), "voxel"),
    *(
        (f"points {x}", lambda x=x: SurfaceMap().query(x), "points")
        for x in ([[0.0, 0.0]], [[0.0, NAN, 0.0]], [0.0, 0.0, 0.0])
    ),
    ("no reach", lambda: MapSettings(reach=0.0), "reach"),
    ("negative bias", lambda: MapSettings(bias=-1.0), "bias"),
    ("patches apart", lambda: MapSettings(patch_spacing=5e-3), "grow"),
    ("empty patches", lambda: MapSettings(patch_stretches=0), "1"),
    ("no length", lambda: SurfaceModel(noise_length=0.0), "noise_length"),
    ("certain", lambda: half_widths(np.array([1.0]), 0.0, 1.0), "probability"),
    ("flat vertices", lambda: TriangleSurface(np.zeros((3, 2)), [[0, 1, 2]]), "must be"),
    ("no such vertex", lambda: TriangleSurface(np.eye(3), [[0, 1, 3]]), "name vertices"),
    ("vertices of nan", lambda: TriangleSurface(np.full((3, 3), NAN), [[0, 1, 2]]), "finite"),
    ("no area", lambda: TriangleSurface(np.zeros((3, 3)), [[0, 1, 2]]), "none has an area"),
    ("no triangles", lambda: TriangleSurface(np.eye(3), np.zeros((0, 3))), "at least 1"),
    (
        "reference in mm",
        lambda: compare(TouchedMap(BALL.vertices), TriangleSurface(1e3 * BALL.vertices, BALL.faces)),
        "reference seems to be in millimetres; add --reference-unit mm",
    ),
    (
        "map in mm",
        lambda: compare(TouchedMap(1e3 * BALL.vertices), REFERENCE),
        "map seems to be in millimetres; add --map-unit mm",
    ),
    (
        "region elsewhere",
        lambda: compare(TouchedMap(BALL.vertices), REFERENCE, region=((5.0, 5.0, 5.0), (6.0, 6.0, 6.0))),
        "nothing there",
    ),
    ("force of 19", lambda: pressed(force=19), "force has shape"),
    ("no window", lambda: pressed(window=0.0), "window"),
    (
        "10 contacts",
        lambda: choose_primitive(cloud_at(np.eye(10, 3), np.tile(UP, (10, 1)))),
        "cannot tell shapes apart",
    ),
    *(
        (f"2 of a {kind.value}", lambda kind=kind: fitted(kind, np.eye(2, 3)), "cannot determine")
        for kind in PrimitiveKind
    ),
    *(
        (f"{kind.value} in a point", lambda kind=kind: fitted(kind, np.ones((20, 3))), "all in one place")
        for kind in PrimitiveKind
    ),
    *(
        (
            f"{kind.value}, alike",
            lambda kind=kind: fitted(kind, np.eye(20, 3), correlation_points=0.5),
            "correlation_points",
        )
        for kind in PrimitiveKind
    ),
]


def mapped():
    made = SurfaceMap()
    made.add(CAP)
    return made


@pytest.mark.slow
@pytest.mark.parametrize(("call", "message"), [row[1:] for row in ROWS], ids=[row[0] for row in ROWS])
def test_bad_inputs_are_refused_by_name(call, message):
    with pytest.raises(InvalidValueError, match=message):
        call()


def test_a_missing_folder_is_reported(tmp_path):
    with pytest.raises(FileNotFoundError):
        write_cloud_ply(CAP, tmp_path / "nowhere" / "cloud.ply")
