"""A fingertip from a mesh file: `surface.kind: mesh` of a robot file."""

import copy
from functools import cached_property
from pathlib import Path

import msgspec
import numpy as np

from palpate.errors import InvalidValueError
from palpate.robots.surface_entries import LARGEST_TIP, SMALLEST_TIP, PlacedSurface
from palpate.runtime.robot_ranges import within
from palpate.surfaces import MeshSurface
from palpate.surfaces.mesh import load_mesh_parts

LARGEST_SCALE = 1e3
"""Metres per unit of a file: a kilometre is no unit of fingertips."""


class MeshEntry(PlacedSurface, frozen=True, kw_only=True, dict=True):
    """A closed convex mesh (STL, OBJ, PLY, OFF) whose facets are smoothed by its normals.

    Attributes:
        mesh: The file, relative to the robot file; its origin lies inside the mesh.
        scale: Metres per unit of the file: 0.001 where it is in millimetres.
    """

    mesh: str = msgspec.field(name="file")
    scale: float = msgspec.field(name="scale_m", default=1.0)

    def __post_init__(self) -> None:
        """Refuse numbers out of range; the mesh is read later."""
        within("scale_m", self.scale, 1e-9, LARGEST_SCALE, "m per unit")
        self.check_place()

    @property
    def file(self) -> Path:
        """See `SurfaceKind`."""
        return Path(self.mesh)

    def text_of(self, path: Path) -> str:
        """See `SurfaceKind`: vertices and triangles, to the last bit."""
        vertices, triangles = load_mesh_parts(path)
        lines = [f"{len(vertices)} {len(triangles)}"]
        lines += [" ".join(map(repr, each)) for each in (*vertices.tolist(), *triangles.tolist())]
        return "\n".join(lines) + "\n"

    def given(self, text: str) -> "MeshEntry":
        """See `SurfaceKind`."""
        found = copy.copy(self)
        vars(found)["text"] = text
        half = found.surface().half_lengths
        if not SMALLEST_TIP <= float(half.min()) <= float(half.max()) <= LARGEST_TIP:
            raise InvalidValueError(
                f"its half lengths are {half.tolist()} m: must lie within {SMALLEST_TIP:g} to {LARGEST_TIP:g} m; "
                "is it in millimetres? then give `scale_m: 0.001`"
            )
        return found

    def surface(self) -> MeshSurface:
        """See `SurfaceKind`."""
        return self._read

    @cached_property
    def _read(self) -> MeshSurface:
        text = self.__dict__.get("text")
        if text is None:
            raise InvalidValueError(f"file = {self.mesh}: was not read; read the robot file as a whole")
        head, *lines = text.splitlines()
        count = int(head.split()[0])
        vertices = np.array([line.split() for line in lines[:count]], np.float64)
        triangles = np.array([line.split() for line in lines[count:]], np.int64)
        return MeshSurface(vertices * self.scale, triangles, center=np.array(self.center), rotation=self.rotation)
