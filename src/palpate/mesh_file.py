"""Triangle meshes and clouds of points in files: their sizes checked before trimesh takes them apart."""

import io
import logging
import os
from pathlib import Path
from typing import Any

import numpy as np

from palpate.bounded_file import Bounds, PathLike, read_bytes
from palpate.errors import InvalidValueError, shown

BOUNDS = Bounds(size=1 << 25, lines=1_500_000)
"""A text of 130 000 triangles; trimesh takes ten times its size while it reads one."""

MOST_TRIANGLES = 250_000
"""What is read, merged and checked within about 2 s and 300 MB; a finer mesh shows no fingertip more."""

FARTHEST = 1e6
"""Bounds coordinates, in whatever unit the file has: a kilometre in millimetres."""

FORMATS = (".stl", ".obj", ".ply", ".off")
"""Endings of files that stand alone: archives would expand, and scenes name other files."""

_STL_HEADER, _STL_TRIANGLE = 84, 50


def load_geometry(path: PathLike, *, process: bool) -> Any:
    """Return what trimesh makes of a mesh or cloud: an object with `vertices`, and `faces` if it has triangles.

    Textures and materials are left out: no other file is read.

    Args:
        path: The file.
        process: Whether trimesh merges vertices, and drops what is not finite.

    Raises:
        InvalidValueError: It cannot be read, is of another format, or beyond `BOUNDS` or `MOST_TRIANGLES`.
    """
    name, kind = os.fspath(path), Path(path).suffix.lower()
    if kind not in FORMATS:
        raise InvalidValueError(
            f"{name}: cannot be read as a mesh: ends in {kind or 'nothing'}, must be one of "
            f"{', '.join(FORMATS)}; export it as STL"
        )
    try:
        data = read_bytes(name, BOUNDS)
    except OSError as error:
        why = "there is no such file" if isinstance(error, FileNotFoundError) else error.strerror
        raise InvalidValueError(f"{name}: cannot be read as a mesh: {why}") from None
    _check(name, kind, data)
    import trimesh  # imported here: a second that others need not wait for

    if not trimesh.util.log.handlers:  # without one, it logs tracebacks on standard error
        trimesh.util.log.addHandler(logging.NullHandler())
    try:
        with np.errstate(all="ignore"):
            found: Any = trimesh.load(io.BytesIO(data), file_type=kind[1:], process=process)
            found = found.to_mesh() if isinstance(found, trimesh.Scene) else found
        faces = np.asarray(getattr(found, "faces", np.empty((0, 3))))
        vertices = np.asarray(found.vertices, np.float64).reshape(-1, 3)
    except Exception as error:  # trimesh raises whatever its readers do
        raise InvalidValueError(f"{name}: cannot be read as a mesh ({_in_one_line(error)})") from None
    _refuse_more(name, len(faces))
    if (np.abs(vertices[np.isfinite(vertices)]) > FARTHEST).any():
        raise InvalidValueError(f"{name}: a vertex is farther than {FARTHEST:g} from the origin; leave it out")
    if len(faces) and not 0 <= faces.min() <= faces.max() < len(vertices):
        raise InvalidValueError(
            f"{name}: triangles name vertices {faces.min()} to {faces.max()}: must be 0 to {len(vertices) - 1}"
        )
    return found


def load_mesh_geometry(path: PathLike, *, process: bool) -> Any:
    """Return what trimesh makes of a mesh: see `load_geometry`.

    Raises:
        InvalidValueError: As there, or it has no triangles.
    """
    found = load_geometry(path, process=process)
    if not len(getattr(found, "faces", ())):
        raise InvalidValueError(
            f"{os.fspath(path)}: cannot be read as a mesh: no triangles in it; give a surface as STL, OBJ, PLY or "
            "OFF"
        )
    return found


def _check(name: str, kind: str, data: bytes) -> None:
    """Refuse what claims, or holds, more than there is room for."""
    if kind == ".stl":
        triangles, rest = divmod(len(data) - _STL_HEADER, _STL_TRIANGLE)
        if rest == 0 and int.from_bytes(data[80:84], "little") == triangles:
            _refuse_more(name, triangles)
            return
    if kind == ".ply" and b"binary" in data[:200]:
        return  # trimesh compares its claims with its size, and has one of some bytes for each element
    BOUNDS.check(name, data.decode("latin-1"))


def _refuse_more(name: str, triangles: int) -> None:
    if triangles > MOST_TRIANGLES:
        raise InvalidValueError(
            f"{name}: {triangles} triangles: at most {MOST_TRIANGLES} are read; simplify the mesh"
        )


def _in_one_line(error: Exception) -> str:
    return " ".join(shown(str(error), 120).strip("'\"").split()) or type(error).__name__
