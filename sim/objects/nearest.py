"""The nearest point of a surface that is not convex: compiled, one per kind.

Each kernel takes packed parameters and a point, and returns (x, y, z, nx, ny, nz): the nearest point of the
surface and the outward unit normal there, in the surface's own frame.
"""

import math
from typing import Any

import numpy as np

from palpate.compiling import njit
from palpate.errors import FloatArray
from palpate.surfaces.triangle_tree import nearest_in_tree

HEADER = 8
"""Numbers ahead of a height field's spline coefficients."""

NEWTON_STEPS = 20
"""At most; five are common."""

CONVERGED = 1e-13
"""Length of a Newton step [m] that is rounding."""

ON_RIM = 1e-12
"""[m] A point nearer to the rim has no direction from it."""

SEARCHED = 41
"""Samples along each side of the square in which a distant point's nearest one on a height field is looked for."""

NOWHERE = 1e-300
"""[m] from an axis below which there is no direction: denormal numbers divide to vectors longer than 1."""


@njit(error_model="numpy", cache=True)
def nearest_on_torus(p: Any, x: Any, y: Any, z: Any) -> Any:
    """Torus about z; p = (radius of the ring, radius of the tube)."""
    ring, tube = p[0], p[1]
    rho = math.hypot(x, y)
    ux, uy = (x / rho, y / rho) if rho > NOWHERE else (1.0, 0.0)
    out = rho - ring
    length = math.hypot(out, z)
    a, b = (out / length, z / length) if length > NOWHERE else (0.0, 1.0)
    nx, ny = a * ux, a * uy
    return (ring * ux + tube * nx, ring * uy + tube * ny, tube * b, nx, ny, b)


@njit(error_model="numpy", cache=True)
def spline_height(p: Any, x: Any, y: Any) -> Any:
    """Height and its derivatives (z, zx, zy, zxx, zxy, zyy) of a uniform bicubic B-spline.

    p = (left, front, spacing x, spacing y, columns, rows, width, depth), then coefficients, y slowest.
    """
    columns, rows = int(p[4]), int(p[5])
    u, v = (x - p[0]) / p[2], (y - p[1]) / p[3]
    i, j = min(max(math.floor(u), 1), columns - 3), min(max(math.floor(v), 1), rows - 3)
    s, t = u - i, v - j
    s0, s1, s2, s3 = (1.0 - s) ** 3 / 6.0, (4.0 - 6.0 * s**2 + 3.0 * s**3) / 6.0, 0.0, s**3 / 6.0
    s2 = 1.0 - s0 - s1 - s3
    a0, a1, a3 = -0.5 * (1.0 - s) ** 2, -2.0 * s + 1.5 * s**2, 0.5 * s**2
    a2 = -a0 - a1 - a3
    b0, b1, b2, b3 = 1.0 - s, 3.0 * s - 2.0, 1.0 - 3.0 * s, s
    t0, t1, t3 = (1.0 - t) ** 3 / 6.0, (4.0 - 6.0 * t**2 + 3.0 * t**3) / 6.0, t**3 / 6.0
    weights = (t0, t1, 1.0 - t0 - t1 - t3, t3)
    c0, c1, c3 = -0.5 * (1.0 - t) ** 2, -2.0 * t + 1.5 * t**2, 0.5 * t**2
    slopes = (c0, c1, -c0 - c1 - c3, c3)
    bends = (1.0 - t, 3.0 * t - 2.0, 1.0 - 3.0 * t, t)
    z = zx = zy = zxx = zxy = zyy = 0.0
    for k in range(4):
        at = HEADER + (j - 1 + k) * columns + i - 1
        q0, q1, q2, q3 = p[at], p[at + 1], p[at + 2], p[at + 3]
        row = s0 * q0 + s1 * q1 + s2 * q2 + s3 * q3
        row_x = a0 * q0 + a1 * q1 + a2 * q2 + a3 * q3
        z += weights[k] * row
        zx += weights[k] * row_x
        zxx += weights[k] * (b0 * q0 + b1 * q1 + b2 * q2 + b3 * q3)
        zy += slopes[k] * row
        zxy += slopes[k] * row_x
        zyy += bends[k] * row
    return (z, zx / p[2], zy / p[3], zxx / p[2] ** 2, zxy / (p[2] * p[3]), zyy / p[3] ** 2)


@njit(error_model="numpy", cache=True)
def tightest_hollow(p: Any, x: Any, y: Any) -> Any:
    """Largest curvature of a height field over a grid [1/m], positive where the surface bends upwards."""
    found = -math.inf
    for v in y:
        for u in x:
            _, zx, zy, zxx, zxy, zyy = spline_height(p, u, v)
            steep = 1.0 + zx * zx + zy * zy
            # mean and Gaussian curvature of a graph (do Carmo 1976, 3.3, example 5)
            mean = ((1.0 + zx * zx) * zyy - 2.0 * zx * zy * zxy + (1.0 + zy * zy) * zxx) / (2.0 * steep**1.5)
            gaussian = (zxx * zyy - zxy * zxy) / (steep * steep)
            found = max(found, mean + math.sqrt(max(mean * mean - gaussian, 0.0)))
    return found


@njit(error_model="numpy", cache=True)
def nearest_from(p: Any, x: Any, y: Any, z: Any, u: Any, v: Any) -> Any:
    """Newton's method from above (u, v) on the squared distance to the height field; stays on its rectangle.

    At its rim, where surface and wall meet, the normal points to the given point, as on every edge.
    """
    half_width, half_depth = 0.5 * p[6], 0.5 * p[7]
    u, v = min(max(u, -half_width), half_width), min(max(v, -half_depth), half_depth)
    h, hx, hy, hxx, hxy, hyy = spline_height(p, u, v)
    squared = (u - x) ** 2 + (v - y) ** 2 + (h - z) ** 2
    for _ in range(NEWTON_STEPS):
        gx, gy = u - x + (h - z) * hx, v - y + (h - z) * hy
        # where the true second derivative is not positive, what is left without the surface's bend is
        a, b, c = 1.0 + hx * hx + (h - z) * hxx, hx * hy + (h - z) * hxy, 1.0 + hy * hy + (h - z) * hyy
        if not (a > 0.1 and a * c - b * b > 0.1):
            a, b, c = 1.0 + hx * hx, hx * hy, 1.0 + hy * hy
        # at the rectangle's edge, only along it
        fixed_u = (u >= half_width and gx < 0.0) or (u <= -half_width and gx > 0.0)
        fixed_v = (v >= half_depth and gy < 0.0) or (v <= -half_depth and gy > 0.0)
        if fixed_u and fixed_v:
            break
        if fixed_u:
            du, dv = 0.0, -gy / c
        elif fixed_v:
            du, dv = -gx / a, 0.0
        else:
            det = a * c - b * b
            du, dv = (b * gy - c * gx) / det, (b * gx - a * gy) / det
        if math.hypot(du, dv) < CONVERGED:
            break
        part = 1.0
        for _ in range(30):
            tu = min(max(u + part * du, -half_width), half_width)
            tv = min(max(v + part * dv, -half_depth), half_depth)
            th, tx, ty, txx, txy, tyy = spline_height(p, tu, tv)
            tried = (tu - x) ** 2 + (tv - y) ** 2 + (th - z) ** 2
            if tried <= squared:
                break
            part *= 0.5
        else:
            break
        u, v, h, hx, hy, hxx, hxy, hyy, squared = tu, tv, th, tx, ty, txx, txy, tyy, tried
    if abs(u) >= half_width or abs(v) >= half_depth:
        beside = abs(x) > half_width or abs(y) > half_depth
        nx, ny, nz = x - u, y - v, z - h
        length = math.sqrt(nx * nx + ny * ny + nz * nz)
        if length > ON_RIM and (beside or z > spline_height(p, x, y)[0]):
            return (u, v, h, nx / length, ny / length, nz / length)
    steep = math.sqrt(1.0 + hx * hx + hy * hy)
    return (u, v, h, -hx / steep, -hy / steep, 1.0 / steep)


@njit(error_model="numpy", cache=True)
def nearest_on_heights(p: Any, x: Any, y: Any, z: Any) -> Any:
    """Nearest point of a height field, searched from the point below; beside it, below its rim, on its wall."""
    u, v = min(max(x, -0.5 * p[6]), 0.5 * p[6]), min(max(y, -0.5 * p[7]), 0.5 * p[7])
    beside = math.hypot(x - u, y - v)
    if beside > ON_RIM and z <= spline_height(p, u, v)[0]:
        return (u, v, z, (x - u) / beside, (y - v) / beside, 0.0)
    return nearest_from(p, x, y, z, x, y)


@njit(error_model="numpy", cache=True)
def distances_to_heights(p: Any, points: Any) -> Any:
    """Distance of points (n, 3) to what lies below a height field, negative in it; shape (n,).

    Above it, the nearest point is first searched for on a grid.
    """
    half_width, half_depth = 0.5 * p[6], 0.5 * p[7]
    distances = np.empty(len(points))
    for i in range(len(points)):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        u, v = min(max(x, -half_width), half_width), min(max(y, -half_depth), half_depth)
        below = spline_height(p, u, v)[0]
        beside = math.hypot(x - u, y - v)
        if beside > 0.0 and z <= below:  # the wall
            distances[i] = beside
            continue
        best = (u - x) ** 2 + (v - y) ** 2 + (below - z) ** 2
        reach = math.sqrt(best)  # the nearest point is not farther
        for k in range(SEARCHED):
            for j in range(SEARCHED):
                a = x + reach * (2.0 * k / (SEARCHED - 1) - 1.0)
                b = y + reach * (2.0 * j / (SEARCHED - 1) - 1.0)
                if abs(a) <= half_width and abs(b) <= half_depth:
                    squared = (a - x) ** 2 + (b - y) ** 2 + (spline_height(p, a, b)[0] - z) ** 2
                    if squared < best:
                        best, u, v = squared, a, b
        a, b, c, _, _, _ = nearest_from(p, x, y, z, u, v)
        distance = math.sqrt((a - x) ** 2 + (b - y) ** 2 + (c - z) ** 2)
        if beside == 0.0 and z < below:
            distances[i] = -min(distance, half_width - abs(x), half_depth - abs(y))
        else:
            distances[i] = distance
    return distances


@njit(error_model="numpy", cache=True)
def nearest_on_mesh(tree: Any, x: Any, y: Any, z: Any) -> Any:
    """Nearest point of a triangle mesh, packed by `palpate.surfaces.triangle_tree.triangle_tree`.

    The normal points from the nearest point to the given one; inside (by the pseudonormal), the reverse.
    """
    _, bx, by, bz, fx, fy, fz = nearest_in_tree(tree, x, y, z)
    nx, ny, nz = x - bx, y - by, z - bz
    length = math.sqrt(nx * nx + ny * ny + nz * nz)
    if length < 1e-12:
        return (bx, by, bz, fx, fy, fz)
    if nx * fx + ny * fy + nz * fz < 0.0:
        length = -length
    return (bx, by, bz, nx / length, ny / length, nz / length)


@njit(error_model="numpy", cache=True)
def lay(found: Any, position: Any, quat_wxyz: Any) -> None:
    """Write the pose of the tangent plane: z turned to the normal by the smallest rotation."""
    x, y, z, nx, ny, nz = found
    position[0], position[1], position[2] = x, y, z
    if nz > -1.0 + 1e-12:
        w = math.sqrt(0.5 * (1.0 + nz))
        quat_wxyz[0], quat_wxyz[1], quat_wxyz[2], quat_wxyz[3] = w, -0.5 * ny / w, 0.5 * nx / w, 0.0
    else:  # upside down: half a turn about x
        quat_wxyz[0], quat_wxyz[1], quat_wxyz[2], quat_wxyz[3] = 0.0, 1.0, 0.0, 0.0


@njit(error_model="numpy", cache=True)
def lay_on_torus(p: Any, tip: Any, position: Any, quat_wxyz: Any) -> None:
    """Lay the plane on a torus under a tip's centre (3,)."""
    lay(nearest_on_torus(p, tip[0], tip[1], tip[2]), position, quat_wxyz)


@njit(error_model="numpy", cache=True)
def lay_on_heights(p: Any, tip: Any, position: Any, quat_wxyz: Any) -> None:
    """Lay the plane on a height field under a tip's centre (3,)."""
    lay(nearest_on_heights(p, tip[0], tip[1], tip[2]), position, quat_wxyz)


@njit(error_model="numpy", cache=True)
def lay_on_mesh(tree: Any, tip: Any, position: Any, quat_wxyz: Any) -> None:
    """Lay the plane on a mesh under a tip's centre (3,)."""
    lay(nearest_on_mesh(tree, tip[0], tip[1], tip[2]), position, quat_wxyz)


def each(nearest: Any, parameters: FloatArray, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Nearest points and normals there of points (n, 3), each of shape (n, 3)."""
    found = np.array([nearest(parameters, *point) for point in np.asarray(points).tolist()]).reshape(-1, 6)
    return found[:, :3], found[:, 3:]
