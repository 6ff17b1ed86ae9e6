"""Surface meshes as files that other programs read: PLY with quality, OBJ and STL.

Coordinates are those of the robot's base frame, all lengths in metres. A PLY keeps per vertex, besides its normal,
`quality`: its standard deviation (the name that MeshLab colours by), `band`: the half-width that holds the true
surface with 95 % probability, and `knowledge`: 0 where it is observed. OBJ and STL hold the shape only.
"""

import os
from pathlib import Path

import numpy as np
import trimesh
from trimesh.exchange.ply import export_ply

from palpate.atomic_file import replacing
from palpate.errors import InvalidValueError
from palpate.mapping.surface_map.mesh import SurfaceMesh

SUFFIXES = (".ply", ".obj", ".stl")


def write_mesh(mesh: SurfaceMesh, path: str | os.PathLike[str]) -> None:
    """Write a mesh in the format that the end of the file's name says.

    Raises:
        InvalidValueError: The name ends in none of `SUFFIXES`, or the mesh is empty.
        OSError: The file cannot be written.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        raise InvalidValueError(f"{os.fspath(path)}: a mesh is written as one of {', '.join(SUFFIXES)}")
    if not len(mesh.triangles):
        raise InvalidValueError(
            f"{os.fspath(path)}: the mesh is empty, nothing was observed; touch more, or let "
            "`reach` be three quarters of the distance of rows"
        )
    shape = to_trimesh(mesh)
    written = export_ply(shape, vertex_normal=True) if suffix == ".ply" else shape.export(file_type=suffix[1:])
    with replacing(path) as file:
        file.write(written.encode("ascii") if isinstance(written, str) else bytes(written))


def to_trimesh(mesh: SurfaceMesh) -> trimesh.Trimesh:
    """Return the mesh for trimesh, `quality`, `band` [m] and `knowledge` as its vertex attributes."""
    return trimesh.Trimesh(
        vertices=mesh.vertices,
        faces=mesh.triangles,
        vertex_normals=mesh.normals,
        vertex_attributes={
            "quality": mesh.sd.astype(np.float32),
            "band": mesh.band().astype(np.float32),
            "knowledge": mesh.knowledge.astype(np.uint8),
        },
        process=False,
    )
