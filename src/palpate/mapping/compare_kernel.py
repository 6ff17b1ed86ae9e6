"""Nearest point on many triangles: a tree of boxes, walked by compiled code."""

from typing import Any

import numpy as np

from palpate.compiling import njit

DEPTH = 128
"""Room for boxes still to look into: one per level of the tree and some."""


@njit(error_model="numpy", cache=True)
def nearest_on_triangles(points: Any, corners: Any, low: Any, high: Any, leaf: Any) -> Any:
    """Return squared distance, triangle, point on it and its feature, for each point.

    Args:
        points: Shape (n, 3).
        corners: Triangles in the order of the leaves, shape (m, 3, 3).
        low: Lower corners of the boxes of a binary tree (children of i: 2 i + 1, 2 i + 2), shape (k, 3).
        high: Upper corners.
        leaf: Triangles per leaf.

    Returns:
        Arrays (n,), (n,), (n, 3), (n,); a feature is 0 inside, 1 to 3 the edge from that corner on, 4 to 6 a
        corner.
    """
    n, inner = len(points), len(low) // 2
    square = np.empty(n)
    which = np.empty(n, np.int64)
    foot = np.empty((n, 3))
    feature = np.empty(n, np.int64)
    stack = np.empty(DEPTH, np.int64)
    far = np.empty(DEPTH)
    for i in range(n):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        best = np.inf
        which[i] = -1
        stack[0], far[0], top = 0, 0.0, 1
        while top > 0:
            top -= 1
            node = stack[top]
            if far[top] >= best:
                continue
            if node >= inner:
                first = (node - inner) * leaf
                for t in range(first, min(first + leaf, len(corners))):
                    d, fx, fy, fz, kind = _nearest_on_triangle(x, y, z, corners[t])
                    if d < best:
                        best = d
                        which[i], feature[i] = t, kind
                        foot[i, 0], foot[i, 1], foot[i, 2] = fx, fy, fz
                continue
            left, right = 2 * node + 1, 2 * node + 2
            a = _to_box(x, y, z, low[left], high[left])
            b = _to_box(x, y, z, low[right], high[right])
            # the nearer one is looked into first
            if a < b:
                left, right, a, b = right, left, b, a
            if a < best:
                stack[top], far[top] = left, a
                top += 1
            if b < best:
                stack[top], far[top] = right, b
                top += 1
        square[i] = best
    return square, which, foot, feature


@njit(error_model="numpy", cache=True)
def _to_box(x: Any, y: Any, z: Any, low: Any, high: Any) -> Any:
    """Return the squared distance to a box; an empty one is infinitely far."""
    dx = max(low[0] - x, 0.0, x - high[0])
    dy = max(low[1] - y, 0.0, y - high[1])
    dz = max(low[2] - z, 0.0, z - high[2])
    return dx * dx + dy * dy + dz * dz


@njit(error_model="numpy", cache=True)
def _nearest_on_triangle(x: Any, y: Any, z: Any, corner: Any) -> Any:
    """Return squared distance, nearest point and feature: the foot on the plane, or the nearest of three edges.

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
            h = (wx * nx + wy * ny + wz * nz) / nn
            return h * h * nn, x - h * nx, y - h * ny, z - h * nz, 0
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
