"""Maps and reference meshes from files: clouds of `palpate explore`, meshes of any kind, in metres or not."""

import os
from pathlib import Path
from typing import Any

import numpy as np

from palpate.csv_table import read_csv_table, read_csv_text
from palpate.errors import FloatArray, InvalidValueError, positive
from palpate.mapping.compare import SAMPLES, TouchedMap
from palpate.mapping.compare_surface import TriangleSurface
from palpate.mesh_file import load_geometry
from palpate.unit_ranges import RANGES

FARTHEST = RANGES["m"].most
"""Bounds coordinates [m]."""

_POSITION, _NORMAL = ("x_m", "y_m", "z_m"), ("nx", "ny", "nz")


def read_map(path: str | os.PathLike[str], metres_per_unit: float = 1.0, samples: int = SAMPLES) -> TouchedMap:
    """Read a map: a CSV of contacts or of a height map, a PLY of points, or a mesh.

    Args:
        path: The file.
        metres_per_unit: 0.001 where the file is in millimetres.
        samples: Points to spread over a mesh.

    Raises:
        InvalidValueError: The file cannot be read, or holds neither points nor triangles.
    """
    positive("metres_per_unit", metres_per_unit, "m")
    path = Path(path)
    if path.suffix.lower() == ".csv":
        return _from_csv(path, metres_per_unit)
    loaded = _loaded(path)
    vertices = _placed(path, np.asarray(loaded.vertices, dtype=np.float64) * metres_per_unit)
    faces = np.asarray(getattr(loaded, "faces", ()), dtype=np.int64)
    if len(faces):
        return TouchedMap.of_mesh(_outwards(TriangleSurface(vertices, faces.reshape(-1, 3))), samples)
    if not len(vertices):
        raise InvalidValueError(f"{path}: holds neither points nor triangles")
    return TouchedMap(vertices, _cloud_normals(loaded, len(vertices)))


def read_reference(path: str | os.PathLike[str], metres_per_unit: float = 1.0) -> TriangleSurface:
    """Read a reference mesh (STL, PLY, OBJ or OFF).

    Raises:
        InvalidValueError: The file cannot be read as triangles.
    """
    positive("metres_per_unit", metres_per_unit, "m")
    loaded = _loaded(Path(path))
    faces = np.asarray(getattr(loaded, "faces", ()), dtype=np.int64)
    if not len(faces):
        raise InvalidValueError(f"{path}: has no triangles; the reference must be a mesh (the map comes first)")
    vertices = _placed(Path(path), np.asarray(loaded.vertices, dtype=np.float64) * metres_per_unit)
    return _outwards(TriangleSurface(vertices, faces))


def _placed(path: Path, vertices: FloatArray) -> FloatArray:
    """The same points [m], if they are where things are."""
    if not (np.abs(vertices) <= FARTHEST).all():
        raise InvalidValueError(
            f"{path}: a vertex is not finite or farther than {FARTHEST:g} m; leave it out, or give the file's unit"
        )
    return vertices


def _outwards(surface: TriangleSurface) -> TriangleSurface:
    """The same surface, turned inside out if it is closed and its triangles face inwards, as some files have them.

    Signs and normals would be reversed. Of an open surface nobody knows.
    """
    if not surface.is_watertight:
        return surface
    corners = surface.vertices[surface.triangles] - surface.vertices.mean(axis=0)
    volume = (corners[:, 0] * np.cross(corners[:, 1], corners[:, 2])).sum() / 6.0
    return surface if volume >= 0.0 else TriangleSurface(surface.vertices, surface.triangles[:, ::-1])


def _loaded(path: Path) -> Any:
    loaded = load_geometry(path, process=False)
    if not hasattr(loaded, "vertices"):
        raise InvalidValueError(f"{path}: holds neither points nor triangles")
    return loaded


def _cloud_normals(loaded: Any, count: int) -> FloatArray | None:
    """Normals of a PLY cloud, which trimesh keeps as it found them."""
    raw = loaded.metadata.get("_ply_raw", {}).get("vertex", {}).get("data")
    try:
        # an array with names of a binary file, a mapping of a text
        return _unit(np.column_stack([np.asarray(raw[name], np.float64).reshape(count) for name in _NORMAL]))
    except (KeyError, TypeError, ValueError):  # there are none, or not one for each point
        return None


def _from_csv(path: Path, metres_per_unit: float) -> TouchedMap:
    found = read_csv_table(
        read_csv_text(path), str(path), "x_m, y_m and z_m below a line with these names, as explore writes them"
    )
    names = [*_POSITION, *(_NORMAL if set(_NORMAL) <= set(found.columns.names) else ())]
    table = found.numbers(*names)
    table = table[np.isfinite(table).all(axis=1)]  # where nothing was felt, a height map says nan
    if not len(table):
        raise InvalidValueError(f"{path}: holds no points")
    return TouchedMap(
        _placed(path, table[:, :3] * metres_per_unit), _unit(table[:, 3:]) if len(names) == 6 else None
    )


def _unit(normals: FloatArray) -> FloatArray | None:
    with np.errstate(all="ignore"):
        normals = normals / np.abs(normals).max(axis=1, keepdims=True)  # squares of extremes are 0 or infinite
        normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    return normals if np.isfinite(normals).all() else None
