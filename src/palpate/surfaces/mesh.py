"""A fingertip from a triangle mesh: convex, with normals interpolated between the vertices.

A facet's own normal jumps at its edges, and with it the contact that explains a wrench; a real tip is smooth. So
points lie on the facets, but the normal is interpolated from the vertices' (Phong), and curvature is its change.
"""

import math
import os
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from palpate.compiling import njit
from palpate.errors import FloatArray, InvalidValueError
from palpate.mesh_file import load_mesh_geometry
from palpate.surfaces.implicit import Implicit

IndexArray = npt.NDArray[np.int64]

CONVEX_TOLERANCE = 1e-3
"""How far a vertex may lie outside a facet's plane, relative to the size: more than a CAD export's rounding."""

UNIT_TOLERANCE = 1e-3
"""Of the length of a normal that is given: files keep four digits or more."""

GRID = 24
"""Cells along each edge of the cube of directions in which facets are looked up."""

LONGEST_WALK = 10_000
"""Facets visited in search of one: the grid starts it a few away."""

MOST_FACETS = 20_000
"""Of a file: whether it is convex costs each of them each vertex, 1 s in all."""

STEEPEST = 2.0
"""Tangential over normal force of contacts that may be the only one without a look at every facet; less
where facets are turned so far against their normals, on a tip so slender, that a force may leave through one."""


HEADER, ROW = 4, 24
"""Entries of the packed mesh before the facets, and of each."""


@dataclass(frozen=True, eq=False, repr=False)
class MeshSurface(Implicit):
    """A closed convex triangle mesh with smooth normals.

    Args:
        vertices: Shape (n, 3) [m], in the mesh's own frame, the origin inside.
        triangles: Indices of vertices, counter-clockwise seen from outside, shape (m, 3).
        normals: Outward unit normals at the vertices, shape (n, 3); by default means of the adjoining facets',
            weighted by their angles.
        center: Origin of the mesh's frame in the sensor frame, shape (3,) [m].
        rotation: Columns are the mesh's axes in sensor coordinates, shape (3, 3).

    Attributes:
        turning_order: Facets, first those that the least spin turns over, see `turning`.
        turning_spins: That spin over the normal force, in the same order [m].

    Raises:
        InvalidValueError: The mesh is open, not convex, or does not enclose its origin.
    """

    vertices: FloatArray
    triangles: IndexArray
    normals: FloatArray | None = field(default=None)
    turning_order: IndexArray = field(init=False)
    turning_spins: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        vertices = np.array(self.vertices, dtype=np.float64)
        triangles = np.array(self.triangles, dtype=np.int64)
        if vertices.ndim != 2 or vertices.shape[1] != 3 or not np.isfinite(vertices).all():
            raise InvalidValueError(f"vertices have shape {vertices.shape}: must be (n, 3), finite [m]")
        if triangles.ndim != 2 or triangles.shape[1] != 3 or len(triangles) < 4:
            raise InvalidValueError(f"triangles have shape {triangles.shape}: must be (m, 3), at least 4")
        if triangles.min() < 0 or triangles.max() >= len(vertices):
            raise InvalidValueError(
                f"triangles name vertices {triangles.min()} to {triangles.max()}: must be 0 to {len(vertices) - 1}"
            )
        size = float(np.abs(vertices).max())
        facets = _facet_normals(vertices, triangles)
        _refuse_dents(vertices, triangles, facets, size)
        neighbours = _neighbours(triangles)
        if self.normals is None:
            normals = _vertex_normals(vertices, triangles, facets)
        else:
            normals = np.array(self.normals, dtype=np.float64)
        if normals.shape != vertices.shape:
            raise InvalidValueError(f"normals have shape {normals.shape}: must be {vertices.shape}")
        lengths = np.linalg.norm(normals, axis=1)
        if not (np.abs(lengths - 1.0) <= UNIT_TOLERANCE).all():
            raise InvalidValueError(f"normals have lengths up to {lengths.max():g}: divide each by its length")
        for name, array in (("vertices", vertices), ("triangles", triangles), ("normals", normals)):
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        self._settle(evaluate_mesh, _packed(vertices, normals, triangles, neighbours, self.facet_turn), size)
        order, spins = turning(self.parameters)
        order.setflags(write=False)
        spins.setflags(write=False)
        object.__setattr__(self, "turning_order", order)
        object.__setattr__(self, "turning_spins", spins)

    @property
    def facet_turn(self) -> float:
        """Largest angle [rad] of a facet against the smooth normals at its corners."""
        assert self.normals is not None  # settled
        facets = _facet_normals(self.vertices, self.triangles)
        cosines = np.einsum("tci,ti->tc", self.normals[self.triangles], facets)
        return math.acos(min(max(float(cosines.min()), -1.0), 1.0))

    def __repr__(self) -> str:
        """Show how large it is, not all of it."""
        return f"MeshSurface of {len(self.triangles)} triangles, half lengths {self.half_lengths.tolist()} m"


def load_mesh(path: str | os.PathLike[str], scale: float = 1.0, **frame: Any) -> MeshSurface:
    """Return the fingertip in a mesh file (STL, PLY, OBJ or OFF).

    Args:
        path: The file.
        scale: Metres per unit of the file: 0.001 where it is in millimetres.
        **frame: `center` and `rotation` of `MeshSurface`.

    Raises:
        InvalidValueError: The file cannot be read, or is no closed convex mesh about its origin.
    """
    vertices, triangles = load_mesh_parts(path)
    return MeshSurface(vertices * scale, triangles, **frame)


def load_mesh_parts(path: str | os.PathLike[str]) -> tuple[FloatArray, IndexArray]:
    """Return vertices (n, 3), in the file's unit, and triangles (m, 3) of a mesh file.

    Raises:
        InvalidValueError: The file cannot be read, or is too fine.
    """
    mesh = load_mesh_geometry(path, process=True)
    if len(mesh.faces) > MOST_FACETS:
        raise InvalidValueError(
            f"{os.fspath(path)}: {len(mesh.faces)} triangles: at most {MOST_FACETS} make a fingertip; simplify it"
        )
    mesh.merge_vertices(merge_norm=True, merge_tex=True)
    return np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64)


def _facet_normals(vertices: FloatArray, triangles: IndexArray) -> FloatArray:
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    if not (length > 0.0).all():
        raise InvalidValueError(f"triangle {int(np.argmin(length))} has no area: remove it from the mesh")
    return np.asarray(normal / length)


def _refuse_dents(vertices: FloatArray, triangles: IndexArray, facets: FloatArray, size: float) -> None:
    for start in range(0, len(triangles), 512):
        part = slice(start, start + 512)
        offset = np.sum(facets[part] * vertices[triangles[part, 0]], axis=1)
        if offset.min() <= 0.0:
            raise InvalidValueError(
                f"the origin is not inside triangle {start + int(offset.argmin())}: it must lie inside the mesh, "
                "and triangles must run counter-clockwise seen from outside"
            )
        beyond = facets[part] @ vertices.T - offset[:, None]
        if beyond.max() > CONVEX_TOLERANCE * size:
            facet, vertex = np.unravel_index(int(beyond.argmax()), beyond.shape)
            raise InvalidValueError(
                f"the mesh is not convex: vertex {vertex} lies {beyond.max():.2g} m outside triangle "
                f"{start + int(facet)}; the limit is {CONVEX_TOLERANCE * size:.2g} m; take its convex hull"
            )


def _neighbours(triangles: IndexArray) -> IndexArray:
    """Triangle across the edge opposite each corner, shape (m, 3)."""
    edges: dict[tuple[int, int], tuple[int, int]] = {}
    neighbours = np.full(triangles.shape, -1)
    for t, corners in enumerate(triangles.tolist()):
        for i in range(3):
            a, b = corners[(i + 1) % 3], corners[(i + 2) % 3]
            if (a, b) in edges:
                raise InvalidValueError(
                    f"edge {a}-{b} has the same direction in two triangles: the mesh is not oriented"
                )
            edges[a, b] = (t, i)
    for (a, b), (t, i) in edges.items():
        if (b, a) not in edges:
            raise InvalidValueError(f"edge {a}-{b} belongs to one triangle only: the mesh must be closed")
        neighbours[t, i] = edges[b, a][0]
    return neighbours


def _vertex_normals(vertices: FloatArray, triangles: IndexArray, facets: FloatArray) -> FloatArray:
    """Means of the adjoining facets' normals, weighted by the angle that each takes up at the vertex."""
    normals = np.zeros_like(vertices)
    for i in range(3):
        at = vertices[triangles[:, i]]
        u, v = vertices[triangles[:, (i + 1) % 3]] - at, vertices[triangles[:, (i + 2) % 3]] - at
        sine = np.linalg.norm(np.cross(u, v), axis=1)
        angle = np.arctan2(sine, np.sum(u * v, axis=1))
        np.add.at(normals, triangles[:, i], angle[:, None] * facets)
    return np.asarray(normals / np.linalg.norm(normals, axis=1, keepdims=True))


def _packed(
    vertices: FloatArray, normals: FloatArray, triangles: IndexArray, neighbours: IndexArray, turn: float
) -> FloatArray:
    """Header, each triangle's corners, normals and neighbours, the grid of directions.

    The header is the number of triangles, the size, and the normal force that `STEEPEST` is about.
    """
    count = len(triangles)
    rows = np.empty((count, ROW))
    rows[:, 0:9] = vertices[triangles].reshape(count, 9)
    rows[:, 9:18] = normals[triangles].reshape(count, 9)
    rows[:, 18:21] = neighbours
    rows[:, 21:24] = 0.0
    nearest = np.sum(_facet_normals(vertices, triangles) * vertices[triangles[:, 0]], axis=1).min()
    slender = np.linalg.norm(vertices, axis=1).max() / nearest
    push = max(1.0 / math.hypot(1.0, STEEPEST), slender * math.sin(turn))
    middles = vertices[triangles].mean(axis=1)
    middles /= np.linalg.norm(middles, axis=1, keepdims=True)
    ticks = (np.arange(GRID) + 0.5) / GRID * 2.0 - 1.0
    grid = np.empty((6, GRID, GRID))
    for face in range(6):
        axis, sign = face // 2, 1.0 - 2.0 * (face % 2)
        for i, u in enumerate(ticks):
            directions = np.empty((GRID, 3))
            directions[:, axis] = sign
            directions[:, (axis + 1) % 3] = u
            directions[:, (axis + 2) % 3] = ticks
            directions /= np.linalg.norm(directions, axis=1, keepdims=True)
            grid[face, i] = np.argmax(directions @ middles.T, axis=1)
    return np.concatenate([[count, np.abs(vertices).max(), push, 0.0], rows.ravel(), grid.ravel()])


def turning(p: FloatArray) -> tuple[IndexArray, FloatArray]:
    """Return which facets the least spin over normal force turns over first, and that spin [m].

    With the force's tangential part up to `STEEPEST` times the normal one, D = det[d1 x f + t M1, d2 x f +
    t M2, N] is at least A phi^2 - B |t phi| - C t^2; B is zero for the normals of a smooth surface.
    """
    count = int(p[0])
    rows = p[HEADER : HEADER + ROW * count].reshape(count, ROW)
    v, n = rows[:, :9].reshape(count, 3, 3), rows[:, 9:18].reshape(count, 3, 3)
    d1, d2 = v[:, 1] - v[:, 0], v[:, 2] - v[:, 0]
    M1, M2 = n[:, 1] - n[:, 0], n[:, 2] - n[:, 0]
    facet = np.cross(d1, d2)
    A, B = np.full(count, np.inf), np.zeros(count)
    for k in range(3):
        N = n[:, k]
        # f = phi N + tangential
        normal = np.sum(facet * N, axis=1)
        aside = np.linalg.norm(facet - normal[:, None] * N, axis=1)
        A = np.minimum(A, normal - STEEPEST * aside)
        mixed = np.cross(np.cross(M2, N), d1) + np.cross(np.cross(N, M1), d2)
        straight = np.abs(np.sum(mixed * N, axis=1))
        B = np.maximum(
            B, straight + STEEPEST * np.linalg.norm(mixed - np.sum(mixed * N, axis=1)[:, None] * N, axis=1)
        )
    C = np.maximum(-np.linalg.det(n), 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        q = 2.0 * A / (B + np.sqrt(B * B + 4.0 * A * C))
    q = np.where(A > 0.0, np.where(B + C > 0.0, q, np.inf), 0.0)
    order = np.argsort(q, kind="stable")
    return order, q[order]


@njit(error_model="numpy", cache=True)
def facet_on_ray(p: Any, x: Any, y: Any, z: Any) -> Any:
    """Return the facet that the ray from the origin meets, and the corners' weights there."""
    count = int(p[0])
    largest, axis, sign, u, v = abs(x), 0, x, y, z
    if abs(y) > largest:
        largest, axis, sign, u, v = abs(y), 1, y, z, x
    if abs(z) > largest:
        largest, axis, sign, u, v = abs(z), 2, z, x, y
    face = 2 * axis + (0 if sign > 0.0 else 1)
    i = min(int((u / largest + 1.0) * 0.5 * GRID), GRID - 1)
    j = min(int((v / largest + 1.0) * 0.5 * GRID), GRID - 1)
    facet = int(p[HEADER + ROW * count + (face * GRID + i) * GRID + j])
    w0 = w1 = w2 = 0.0
    for _ in range(LONGEST_WALK):
        r = HEADER + ROW * facet
        ax, ay, az = p[r], p[r + 1], p[r + 2]
        bx, by, bz = p[r + 3], p[r + 4], p[r + 5]
        cx, cy, cz = p[r + 6], p[r + 7], p[r + 8]
        w0 = x * (by * cz - bz * cy) + y * (bz * cx - bx * cz) + z * (bx * cy - by * cx)
        w1 = x * (cy * az - cz * ay) + y * (cz * ax - cx * az) + z * (cx * ay - cy * ax)
        w2 = x * (ay * bz - az * by) + y * (az * bx - ax * bz) + z * (ax * by - ay * bx)
        total = abs(w0) + abs(w1) + abs(w2)
        least = min(min(w0, w1), w2)
        if least >= -1e-14 * total:
            break
        across = 18 if w0 == least else (19 if w1 == least else 20)
        facet = int(p[r + across])
    total = w0 + w1 + w2
    return facet, w0 / total, w1 / total, w2 / total


@njit(error_model="numpy", cache=True)
def evaluate_mesh(p: Any, x: Any, y: Any, z: Any) -> Any:
    """How much too long the ray to a point is, relative, with the smooth normal and its change as derivatives."""
    if x == 0.0 and y == 0.0 and z == 0.0:
        return (-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    facet, b0, b1, b2 = facet_on_ray(p, x, y, z)
    r = HEADER + ROW * facet
    cx = b0 * p[r] + b1 * p[r + 3] + b2 * p[r + 6]
    cy = b0 * p[r + 1] + b1 * p[r + 4] + b2 * p[r + 7]
    cz = b0 * p[r + 2] + b1 * p[r + 5] + b2 * p[r + 8]
    value = math.sqrt((x * x + y * y + z * z) / (cx * cx + cy * cy + cz * cz)) - 1.0
    nx = b0 * p[r + 9] + b1 * p[r + 12] + b2 * p[r + 15]
    ny = b0 * p[r + 10] + b1 * p[r + 13] + b2 * p[r + 16]
    nz = b0 * p[r + 11] + b1 * p[r + 14] + b2 * p[r + 17]
    # scaled so that moving along the ray changes the value as it does
    scale = 1.0 / (nx * cx + ny * cy + nz * cz)
    # gradients of the corners' weights in the facet's plane: e_i = F x (opposite edge) / 2 area
    ux, uy, uz = p[r + 3] - p[r], p[r + 4] - p[r + 1], p[r + 5] - p[r + 2]
    vx, vy, vz = p[r + 6] - p[r], p[r + 7] - p[r + 1], p[r + 8] - p[r + 2]
    fx, fy, fz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    area2 = fx * fx + fy * fy + fz * fz
    e1x, e1y, e1z = (vy * fz - vz * fy) / area2, (vz * fx - vx * fz) / area2, (vx * fy - vy * fx) / area2
    e2x, e2y, e2z = (fy * uz - fz * uy) / area2, (fz * ux - fx * uz) / area2, (fx * uy - fy * ux) / area2
    d1x, d1y, d1z = p[r + 12] - p[r + 9], p[r + 13] - p[r + 10], p[r + 14] - p[r + 11]
    d2x, d2y, d2z = p[r + 15] - p[r + 9], p[r + 16] - p[r + 10], p[r + 17] - p[r + 11]
    hxx = (d1x * e1x + d2x * e2x) * scale
    hyy = (d1y * e1y + d2y * e2y) * scale
    hzz = (d1z * e1z + d2z * e2z) * scale
    hyz = 0.5 * (d1y * e1z + d2y * e2z + d1z * e1y + d2z * e2y) * scale
    hxz = 0.5 * (d1x * e1z + d2x * e2z + d1z * e1x + d2z * e2x) * scale
    hxy = 0.5 * (d1x * e1y + d2x * e2y + d1y * e1x + d2y * e2x) * scale
    return (value, nx * scale, ny * scale, nz * scale, hxx, hyy, hzz, hyz, hxz, hxy)
