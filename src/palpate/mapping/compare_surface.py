"""A triangle mesh to measure against: exact distances, signed where it is closed, and even samples."""

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray, InvalidValueError
from palpate.mapping.compare_kernel import nearest_on_triangles

IndexArray = npt.NDArray[np.int64]

LEAF = 4
"""Triangles per leaf of the tree; 2 to 8 take the same time within a fifth."""

CODE_BITS = 20
"""Bits per coordinate of the order along a Z curve: a millionth of the size."""


@dataclass(frozen=True, slots=True, eq=False)
class Nearest:
    """The points of a surface nearest to n points.

    Attributes:
        distance: Signed, positive outside, where the surface is watertight; else not negative. Shape (n,) [m].
        point: Shape (n, 3) [m].
        triangle: Shape (n,).
        normal: Unit normal there, the mean of those that meet at an edge or corner, shape (n, 3).
    """

    distance: FloatArray
    point: FloatArray
    triangle: IndexArray
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
    _order: IndexArray = field(init=False, repr=False)
    _corners: FloatArray = field(init=False, repr=False)
    _low: FloatArray = field(init=False, repr=False)
    _high: FloatArray = field(init=False, repr=False)
    _features: FloatArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        vertices = np.array(self.vertices, dtype=np.float64)
        triangles = np.array(self.triangles, dtype=np.int64)
        _check(vertices, triangles)
        # STL files repeat each vertex in every triangle: the same numbers are the same vertex
        vertices, triangles = _merged(vertices, triangles)
        distinct = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
        triangles = triangles[distinct]
        corners = vertices[triangles]
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        doubled = np.linalg.norm(cross, axis=1)
        if not (doubled > 0.0).any():
            raise InvalidValueError(f"{len(triangles)} triangles, and none has an area: give a surface")
        watertight = _is_watertight(triangles)
        normals = cross / np.where(doubled > 0.0, doubled, 1.0)[:, np.newaxis]
        order = _along_curve(corners.mean(axis=1))
        low, high = _boxes(corners[order])
        values = {
            "vertices": vertices,
            "triangles": triangles,
            "is_watertight": watertight,
            "normals": normals,
            "areas": 0.5 * doubled,
            "_order": order,
            "_corners": np.ascontiguousarray(corners[order]),
            "_low": low,
            "_high": high,
            "_features": _feature_normals(corners, triangles, normals, len(vertices)),
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
        square, which, foot, feature = nearest_on_triangles(points, self._corners, self._low, self._high, LEAF)
        triangle = self._order[which]
        normal = self._features[triangle, feature]
        distance = np.sqrt(square)
        if self.is_watertight:
            distance = np.where(((points - foot) * normal).sum(axis=1) < 0.0, -distance, distance)
        return Nearest(distance, foot, triangle, normal)

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


def _merged(vertices: FloatArray, triangles: IndexArray) -> tuple[FloatArray, IndexArray]:
    """Return the mesh with vertices of the same place as one."""
    # a sort: np.unique by rows takes several times as long
    vertices = vertices + 0.0  # -0 is 0
    order = np.lexsort(vertices.T)
    new = np.append(True, (np.diff(vertices[order], axis=0) != 0.0).any(axis=1))
    name = np.empty(len(vertices), dtype=np.int64)
    name[order] = np.cumsum(new) - 1
    return vertices[order][new], name[triangles]


def _is_watertight(triangles: IndexArray) -> bool:
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    count = int(triangles.max()) + 1
    forward, ahead = np.unique(edges[:, 0] * count + edges[:, 1], return_counts=True)
    backward, behind = np.unique(edges[:, 1] * count + edges[:, 0], return_counts=True)
    return bool(len(forward) == len(backward) and (forward == backward).all() and (ahead == behind).all())


def _along_curve(centres: FloatArray) -> IndexArray:
    """Return the order along a Z curve (Morton, 1966): neighbours in it are neighbours in space."""
    low, size = centres.min(axis=0), float(np.ptp(centres, axis=0).max())
    cells = ((centres - low) / (size or 1.0) * (2**CODE_BITS - 1)).astype(np.uint64)
    code = np.zeros(len(centres), dtype=np.uint64)
    for bit in range(CODE_BITS):
        for axis in range(3):
            code |= ((cells[:, axis] >> np.uint64(bit)) & np.uint64(1)) << np.uint64(3 * bit + axis)
    return np.argsort(code, kind="stable").astype(np.int64)


def _boxes(corners: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the boxes of a complete binary tree over leaves of `LEAF` triangles, the root first."""
    leaves = -(-len(corners) // LEAF)
    width = 1 << (leaves - 1).bit_length()
    starts = np.arange(0, len(corners), LEAF)
    low, high = np.full((width, 3), np.inf), np.full((width, 3), -np.inf)
    low[:leaves] = np.minimum.reduceat(corners.min(axis=1), starts, axis=0)
    high[:leaves] = np.maximum.reduceat(corners.max(axis=1), starts, axis=0)
    lows, highs = [low], [high]
    while len(lows[0]) > 1:
        lows.insert(0, np.minimum(lows[0][0::2], lows[0][1::2]))
        highs.insert(0, np.maximum(highs[0][0::2], highs[0][1::2]))
    return np.concatenate(lows), np.concatenate(highs)


def _feature_normals(corners: FloatArray, triangles: IndexArray, normals: FloatArray, count: int) -> FloatArray:
    """Return unit normals of each triangle's inside, three edges and three corners, shape (m, 7, 3)."""
    result = np.empty((len(triangles), 7, 3))
    result[:, 0] = normals
    edges = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2), axis=2).reshape(-1, 2)
    _, edge = np.unique(edges[:, 0] * count + edges[:, 1], return_inverse=True)
    edge = edge.reshape(-1)
    result[:, 1:4] = _summed(edge, np.repeat(normals, 3, axis=0)).reshape(-1, 3, 3)
    ahead, behind = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    sine = np.linalg.norm(np.cross(ahead, behind), axis=2)
    angle = np.arctan2(sine, (ahead * behind).sum(axis=2))
    weighted = (angle[:, :, np.newaxis] * normals[:, np.newaxis, :]).reshape(-1, 3)
    result[:, 4:7] = _summed(triangles.reshape(-1), weighted).reshape(-1, 3, 3)
    return result


def _summed(group: IndexArray, vectors: FloatArray) -> FloatArray:
    """Return for each row the unit sum of the vectors of its group."""
    size = int(group.max()) + 1
    total = np.stack([np.bincount(group, vectors[:, k], size) for k in range(3)], axis=1)
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return np.asarray((total / np.where(length > 0.0, length, 1.0))[group])
