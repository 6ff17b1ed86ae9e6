"""A triangle mesh to measure against: exact distances, signed where it is closed, and even samples."""

from dataclasses import dataclass, field

import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.surfaces.triangle_tree import IndexArray, merged, nearest_of_all, triangle_tree


@dataclass(frozen=True, slots=True, eq=False)
class Nearest:
    """The points of a surface nearest to n points.

    Attributes:
        distance: Signed, positive outside, where the surface is watertight; else not negative. Shape (n,) [m].
        point: Shape (n, 3) [m].
        normal: Unit normal there, the mean of those that meet at an edge or corner, shape (n, 3).
    """

    distance: FloatArray
    point: FloatArray
    normal: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class TriangleSurface:
    """A triangle mesh, open or closed. Triangles without area are left out.

    Attributes:
        vertices: Shape (n, 3) [m]; vertices at the same place are one.
        triangles: Counter-clockwise seen from outside, shape (m, 3).
        is_watertight: Whether every edge joins two triangles that run along it in opposite senses.
        normals: Unit normals of the triangles, shape (m, 3).
        areas: Shape (m,) [m^2].

    Raises:
        InvalidValueError: Shapes are wrong, something is not finite, an index is out of range, or nothing has
            area.
    """

    vertices: FloatArray
    triangles: IndexArray
    is_watertight: bool = field(init=False)
    normals: FloatArray = field(init=False)
    areas: FloatArray = field(init=False)
    _tree: FloatArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        vertices = np.array(self.vertices, dtype=np.float64)
        triangles = np.array(self.triangles, dtype=np.int64)
        _check(vertices, triangles)
        # STL files repeat each vertex in every triangle: the same numbers are the same vertex
        vertices, triangles = merged(vertices, triangles)
        distinct = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
        triangles = triangles[distinct]
        corners = vertices[triangles]
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        doubled = np.linalg.norm(cross, axis=1)
        if not (doubled > 0.0).any():
            raise InvalidValueError(f"{len(triangles)} triangles, and none has an area: give a surface")
        values = {
            "vertices": vertices,
            "triangles": triangles,
            "is_watertight": _is_watertight(triangles),
            "normals": cross / np.where(doubled > 0.0, doubled, 1.0)[:, np.newaxis],
            "areas": 0.5 * doubled,
            "_tree": triangle_tree(vertices, triangles),
        }
        for name, value in values.items():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)
            object.__setattr__(self, name, value)

    @property
    def area(self) -> float:
        """[m^2]."""
        return float(self.areas.sum())

    def nearest(self, points: FloatArray) -> Nearest:
        """Return the nearest points of the surface to `points` (n, 3), exactly.

        The sign is that of the angle-weighted normal of the nearest feature (Baerentzen and Aanaes, "Signed
        distance computation using the angle weighted pseudonormal", 2005).
        """
        points = np.ascontiguousarray(points, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
            raise InvalidValueError(f"points have shape {points.shape}: must be (n, 3), finite [m]")
        distance, nearest, normal = nearest_of_all(self._tree, points)
        if self.is_watertight:
            distance = np.where(((points - nearest) * normal).sum(axis=1) < 0.0, -distance, distance)
        return Nearest(distance, nearest, normal)

    def samples(self, count: int) -> tuple[FloatArray, FloatArray]:
        """Return `count` points spread evenly over the surface and the normals there, both (count, 3).

        Always the same ones: strata of equal area, and within a triangle the R2 sequence (Roberts, "The
        unreasonable effectiveness of quasirandom sequences", 2018).
        """
        if count < 1:
            raise InvalidValueError(f"{count} samples: must be 1 or more, some thousand to be a measure")
        share = np.cumsum(self.areas) / self.area
        index = np.arange(count)
        triangle = np.searchsorted(share, (index + 0.5) / count, side="right").clip(0, len(share) - 1)
        s, t = (0.5 + 0.7548776662466927 * index) % 1.0, (0.5 + 0.5698402909980532 * index) % 1.0
        over = s + t > 1.0
        s, t = np.where(over, 1.0 - s, s)[:, np.newaxis], np.where(over, 1.0 - t, t)[:, np.newaxis]
        a, b, c = (self.vertices[self.triangles[triangle, k]] for k in range(3))
        return a + s * (b - a) + t * (c - a), self.normals[triangle]


def _check(vertices: FloatArray, triangles: IndexArray) -> None:
    if vertices.ndim != 2 or vertices.shape[1] != 3 or not np.isfinite(vertices).all():
        raise InvalidValueError(f"vertices have shape {vertices.shape}: must be (n, 3), finite [m]")
    if triangles.ndim != 2 or triangles.shape[1] != 3 or not len(triangles):
        raise InvalidValueError(f"triangles have shape {triangles.shape}: must be (m, 3), at least 1")
    if triangles.min() < 0 or triangles.max() >= len(vertices):
        raise InvalidValueError(
            f"triangles name vertices {triangles.min()} to {triangles.max()}: must be 0 to {len(vertices) - 1}"
        )


def _is_watertight(triangles: IndexArray) -> bool:
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    count = int(triangles.max()) + 1
    forward, ahead = np.unique(edges[:, 0] * count + edges[:, 1], return_counts=True)
    backward, behind = np.unique(edges[:, 1] * count + edges[:, 0], return_counts=True)
    return bool(len(forward) == len(backward) and (forward == backward).all() and (ahead == behind).all())
