"""The nearest point on many triangles: a tree of boxes, walked by compiled code.

What is nearest, a facet, an edge or a vertex, tells on which side of the triangles a point lies. A facet's plane
tells it only where the facet itself is nearest: beside an edge, the planes of the two facets that meet there may
disagree, and a point above the edge of a box lies in the plane of its side. The sum of the adjoining facets'
normals weighted by their angles there tells it everywhere (Baerentzen & Aanaes, Signed distance computation using
the angle weighted pseudonormal, IEEE TVCG 11, 2005, theorem 1); at an edge both angles are pi.
"""

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from palpate.compiling import njit
from palpate.errors import FloatArray

IndexArray = npt.NDArray[np.int64]

LEAF = 4
"""Triangles in a last box, at most: fewer make more boxes to open, more make more to measure."""

DEEPEST = 64
"""Boxes still to look into, at most: one per level of the tree and one, and each level halves the triangles."""

BOX, TRIANGLE, NORMALS = 6, 9, 21
"""Numbers of a box, of a triangle's corners, and of its pseudonormals."""


def merged(vertices: FloatArray, triangles: IndexArray) -> tuple[FloatArray, IndexArray]:
    """Return a mesh with vertices of the same place, to the bit, as one.

    Args:
        vertices: Shape (n, 3).
        triangles: Their indices, shape (m, 3).
    """
    # a sort: np.unique by rows takes several times as long
    vertices = vertices + 0.0  # -0 is 0
    order = np.lexsort(vertices.T)
    new = np.append(True, (np.diff(vertices[order], axis=0) != 0.0).any(axis=1))
    name = np.empty(len(vertices), dtype=np.int64)
    name[order] = np.cumsum(new) - 1
    return vertices[order][new], name[triangles]


def triangle_tree(vertices: FloatArray, triangles: IndexArray) -> FloatArray:
    """Return the tree of a mesh, halved across the longest side of each box, in one array, as kernels take it.

    Args:
        vertices: No two at the same place, see `merged`; shape (n, 3).
        triangles: Counter-clockwise seen from outside, shape (m, 3).

    Returns:
        Number w of last boxes; least and greatest coordinates of the 2 w - 1 boxes of a complete binary tree
        (children of i: 2 i + 1, 2 i + 2; the k-th of the last begins with triangle k m // w); the triangles'
        corners in the order of the last boxes; their pseudonormals.
    """
    corners = vertices[triangles]
    centers = corners.mean(axis=1)
    count = len(corners)
    leaves = 1 << (-(-count // LEAF) - 1).bit_length()
    first = np.arange(leaves + 1) * count // leaves
    order = np.arange(count)
    boxes = 1
    while boxes < leaves:
        starts = first[: -1 : leaves // boxes]
        here = centers[order]
        low, size = np.minimum.reduceat(here, starts), np.maximum.reduceat(here, starts)
        size -= low
        box, longest = np.repeat(np.arange(boxes), np.diff(starts, append=count)), size.argmax(axis=1)
        along = (here - low[box])[np.arange(count), longest[box]]
        # one sort for all boxes: by its box, then by the position along it, at most half
        share = along / (2.0 * np.maximum(size.max(axis=1), 1e-300))[box]
        order = order[np.argsort(box + share, kind="stable")]
        boxes *= 2
    corners = corners[order]
    lows = [np.minimum.reduceat(corners.min(axis=1), first[:-1])]
    highs = [np.maximum.reduceat(corners.max(axis=1), first[:-1])]
    while len(lows[0]) > 1:
        lows.insert(0, np.minimum(lows[0][0::2], lows[0][1::2]))
        highs.insert(0, np.maximum(highs[0][0::2], highs[0][1::2]))
    both = np.concatenate([np.concatenate(lows), np.concatenate(highs)], axis=1)
    normals = pseudonormals(vertices, triangles)[order]
    tree = np.concatenate([[leaves], both.ravel(), corners.ravel(), normals.ravel()])
    tree.setflags(write=False)
    return tree


def pseudonormals(vertices: FloatArray, triangles: IndexArray) -> FloatArray:
    """Return the unit pseudonormals of every triangle: of itself, its edges ab, bc, ca, its corners a, b, c.

    What has no direction, like a sliver, has zeros. Arguments as for `triangle_tree`.

    Returns:
        Shape (m, 7, 3).
    """
    corners, count = vertices[triangles], len(vertices)
    ahead, behind = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    facets = _unit(np.cross(ahead[:, 0], behind[:, 0]))
    ends = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2)
    _, edge = np.unique(ends.min(axis=2) * count + ends.max(axis=2), return_inverse=True)
    angle = np.arctan2(np.linalg.norm(np.cross(ahead, behind), axis=2), (ahead * behind).sum(axis=2))
    weighted = angle[:, :, np.newaxis] * facets[:, np.newaxis]
    at_edges = _summed(edge.reshape(-1), np.repeat(facets, 3, axis=0))
    at_corners = _summed(triangles.reshape(-1), weighted.reshape(-1, 3))
    return np.concatenate(
        [facets[:, np.newaxis], at_edges.reshape(-1, 3, 3), at_corners.reshape(-1, 3, 3)], axis=1
    )


def _summed(group: IndexArray, vectors: FloatArray) -> FloatArray:
    """Return for each row the unit sum of the vectors of its group."""
    size = int(group.max()) + 1
    total = np.stack([np.bincount(group, vectors[:, k], size) for k in range(3)], axis=1, dtype=np.float64)
    return np.asarray(_unit(total)[group])


def _unit(vectors: FloatArray) -> FloatArray:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.where(length > 0.0, length, 1.0))


@njit(error_model="numpy", cache=True)
def opened(tree: Any) -> Any:
    """Return boxes (2 w - 1, 6), corners (m, 3, 3) and pseudonormals (m, 7, 3) of a tree."""
    boxes = 1 + BOX * (2 * int(tree[0]) - 1)
    corners = boxes + (len(tree) - boxes) // (TRIANGLE + NORMALS) * TRIANGLE
    return tree[1:boxes].reshape(-1, 6), tree[boxes:corners].reshape(-1, 3, 3), tree[corners:].reshape(-1, 7, 3)


@njit(error_model="numpy", cache=True)
def nearest_of_all(tree: Any, points: Any) -> Any:
    """Return for each point (n, 3) how far the nearest point of a tree is, that point, and the pseudonormal there.

    Returns:
        Arrays (n,), (n, 3), (n, 3).
    """
    n = len(points)
    distance, nearest, normal = np.empty(n), np.empty((n, 3)), np.empty((n, 3))
    for i in range(n):
        square, x, y, z, nx, ny, nz = nearest_in_tree(tree, points[i, 0], points[i, 1], points[i, 2])
        distance[i] = math.sqrt(square)
        nearest[i, 0], nearest[i, 1], nearest[i, 2] = x, y, z
        normal[i, 0], normal[i, 1], normal[i, 2] = nx, ny, nz
    return distance, nearest, normal


@njit(error_model="numpy", cache=True)
def nearest_in_tree(tree: Any, x: Any, y: Any, z: Any) -> Any:
    """Return the squared distance, the nearest point (x, y, z) and the pseudonormal there (x, y, z)."""
    boxes, corners, normals = opened(tree)
    count, last = len(corners), len(boxes) // 2 + 1
    inner = last - 1
    best, bx, by, bz = np.inf, x, y, z
    triangle = feature = 0
    stack, far = np.empty(DEEPEST, np.int64), np.empty(DEEPEST)
    stack[0], far[0], filled = 0, 0.0, 1
    while filled > 0:
        filled -= 1
        box = stack[filled]
        if far[filled] >= best:
            continue
        if box >= inner:
            k = box - inner
            for t in range(k * count // last, (k + 1) * count // last):
                square, fx, fy, fz, kind = nearest_on_triangle(x, y, z, corners[t])
                if square < best:
                    best, bx, by, bz, triangle, feature = square, fx, fy, fz, t, kind
            continue
        one, other = 2 * box + 1, 2 * box + 2
        a, b = to_box(x, y, z, boxes[one]), to_box(x, y, z, boxes[other])
        if a < b:  # the nearer one last, so that it is looked into first
            one, other, a, b = other, one, b, a
        if a < best:
            stack[filled], far[filled] = one, a
            filled += 1
        if b < best:
            stack[filled], far[filled] = other, b
            filled += 1
    normal = normals[triangle, feature]
    return best, bx, by, bz, normal[0], normal[1], normal[2]


@njit(error_model="numpy", cache=True)
def to_box(x: Any, y: Any, z: Any, box: Any) -> Any:
    """Return the squared distance to a box (6,)."""
    dx = max(box[0] - x, 0.0, x - box[3])
    dy = max(box[1] - y, 0.0, y - box[4])
    dz = max(box[2] - z, 0.0, z - box[5])
    return dx * dx + dy * dy + dz * dz


@njit(error_model="numpy", cache=True)
def nearest_on_triangle(x: Any, y: Any, z: Any, corner: Any) -> Any:
    """Return squared distance, nearest point and which feature it lies on, as pseudonormals are ordered.

    Edges are tried one by one instead of by Voronoi regions (Ericson, "Real-Time Collision Detection", 5.1.5),
    which go wrong for slivers.
    """
    ax, ay, az = corner[0, 0], corner[0, 1], corner[0, 2]
    ux, uy, uz = corner[1, 0] - ax, corner[1, 1] - ay, corner[1, 2] - az
    vx, vy, vz = corner[2, 0] - ax, corner[2, 1] - ay, corner[2, 2] - az
    wx, wy, wz = x - ax, y - ay, z - az
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    nn = nx * nx + ny * ny + nz * nz
    if nn > 0.0:
        # barycentric coordinates, times nn
        cx, cy, cz = wy * vz - wz * vy, wz * vx - wx * vz, wx * vy - wy * vx
        s = cx * nx + cy * ny + cz * nz
        cx, cy, cz = uy * wz - uz * wy, uz * wx - ux * wz, ux * wy - uy * wx
        t = cx * nx + cy * ny + cz * nz
        if s > 0.0 and t > 0.0 and s + t < nn:
            length = math.sqrt(nn)  # a unit normal along an axis is exact, and so are equal distances
            nx, ny, nz = nx / length, ny / length, nz / length
            h = wx * nx + wy * ny + wz * nz
            return h * h, x - h * nx, y - h * ny, z - h * nz, 0
    best, bx, by, bz, kind = np.inf, ax, ay, az, 4
    for e in range(3):
        f = (e + 1) % 3
        px, py, pz = corner[e, 0], corner[e, 1], corner[e, 2]
        ex, ey, ez = corner[f, 0] - px, corner[f, 1] - py, corner[f, 2] - pz
        ee = ex * ex + ey * ey + ez * ez
        along = (x - px) * ex + (y - py) * ey + (z - pz) * ez
        k = 1 + e
        if ee <= 0.0 or along <= 0.0:
            qx, qy, qz = px, py, pz
            k = 4 + e
        elif along >= ee:
            qx, qy, qz = corner[f, 0], corner[f, 1], corner[f, 2]
            k = 4 + f
        else:
            share = along / ee
            qx, qy, qz = px + share * ex, py + share * ey, pz + share * ez
        d = (x - qx) ** 2 + (y - qy) ** 2 + (z - qz) ** 2
        if d < best:
            best, bx, by, bz, kind = d, qx, qy, qz, k
    return best, bx, by, bz, kind
