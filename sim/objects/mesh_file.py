"""Reading triangle meshes of objects, and refusing what is none."""

import os
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray, InvalidValueError, numbers, positive
from palpate.mesh_file import load_mesh_geometry

IndexArray = npt.NDArray[np.int64]

SMALLEST, LARGEST = 1e-3, 2.0
"""[m] across an object that a fingertip can feel: beyond, its file is in another unit."""


@dataclass(frozen=True, eq=False, slots=True)
class Triangles:
    """A closed, outward oriented triangle mesh.

    Attributes:
        vertices: Shape (n, 3) [m].
        faces: Indices of vertices, counter-clockwise seen from outside, shape (m, 3).
        name: For messages.
    """

    vertices: FloatArray = field(repr=False)
    faces: IndexArray = field(repr=False)
    name: str = "mesh"

    def __post_init__(self) -> None:
        vertices, faces = numbers(f"{self.name}: vertices", self.vertices), np.array(self.faces, np.int64)
        if vertices.size == 0 or faces.size == 0:
            raise InvalidValueError(f"{self.name}: empty, {len(vertices)} vertices and {len(faces)} triangles")
        if vertices.ndim != 2 or vertices.shape[1] != 3 or faces.ndim != 2 or faces.shape[1] != 3:
            raise InvalidValueError(
                f"{self.name}: vertices {vertices.shape} and faces {faces.shape}: must be (n, 3) and (m, 3)"
            )
        if not np.isfinite(vertices).all():
            bad = int(np.argwhere(~np.isfinite(vertices).all(axis=1))[0, 0])
            raise InvalidValueError(f"{self.name}: vertex {bad} is {vertices[bad].tolist()}: must be finite [m]")
        if faces.min() < 0 or faces.max() >= len(vertices):
            raise InvalidValueError(
                f"{self.name}: faces name vertices {faces.min()} to {faces.max()}: must be 0 to "
                f"{len(vertices) - 1}"
            )
        size = float(np.ptp(vertices, axis=0).max())
        if not SMALLEST <= size <= LARGEST:
            likely = " (millimetres: metres_per_unit=0.001)" if LARGEST < size <= 1e3 * LARGEST else ""
            raise InvalidValueError(
                f"{self.name}: {size:.4g} m across, must be {SMALLEST:g} to {LARGEST:g} m; state the file's unit "
                f"by metres_per_unit{likely}"
            )
        _refuse_open(self.name, faces)
        for name, array in (("vertices", vertices), ("faces", faces)):
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        if self.volume <= 0.0:
            raise InvalidValueError(
                f"{self.name}: volume {self.volume:.3g} m^3: must be above 0; turn its triangles round, they must "
                "run counter-clockwise seen from outside"
            )

    @property
    def corners(self) -> FloatArray:
        """Of every triangle, shape (m, 3, 3) [m]."""
        return np.asarray(self.vertices[self.faces])

    @property
    def volume(self) -> float:
        """Enclosed volume [m^3]."""
        a, b, c = (self.vertices[self.faces[:, i]] for i in range(3))
        return float(np.sum(a * np.cross(b, c)) / 6.0)


def read_triangles(path: str | os.PathLike[str], metres_per_unit: float = 1.0) -> Triangles:
    """Read a mesh file (STL, OBJ, PLY or OFF).

    Args:
        path: The file.
        metres_per_unit: 0.001 where the file is in millimetres.

    Raises:
        InvalidValueError: The file cannot be read, or is no closed mesh of an object's size.
    """
    positive("metres_per_unit", metres_per_unit, "m")
    vertices, faces = read_facets(path)
    return Triangles(vertices * metres_per_unit, faces, os.fspath(path))


def read_facets(path: str | os.PathLike[str]) -> tuple[FloatArray, IndexArray]:
    """Read vertices (n, 3), in the file's unit, and triangles (m, 3) of a mesh file, whatever they are.

    Raises:
        InvalidValueError: The file cannot be read.
    """
    # no processing: it would drop what is not finite without a word
    mesh = load_mesh_geometry(path, process=False)
    vertices, faces = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64)
    if np.isfinite(vertices).all() and len(vertices):
        # STL files repeat each vertex in every triangle: the same numbers are the same vertex
        vertices, same = np.unique(vertices, axis=0, return_inverse=True)
        faces = same.reshape(-1)[faces]
    return vertices, faces


def _refuse_open(name: str, faces: IndexArray) -> None:
    """Every edge must belong to two triangles, which run along it in opposite directions."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    one_number = np.array([int(faces.max()) + 1, 1])  # sorted 20 times as quickly as pairs
    if np.array_equal(np.sort(edges @ one_number), np.sort(edges[:, ::-1] @ one_number)):
        return
    _, counts = np.unique(np.sort(edges, axis=1) @ one_number, return_counts=True)
    single = int(np.sum(counts == 1))
    cause = (
        f"{single} edges belong to one triangle only" if single else "triangles that meet run in opposite senses"
    )
    raise InvalidValueError(f"{name}: not watertight, {cause}; close the mesh, or repair it where it was made")
