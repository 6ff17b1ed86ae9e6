"""What fits of shapes compute for every point, in every step of a few hundred: compiled."""

import math
from typing import Any

import numpy as np

from palpate.compiling import njit

ROUNDS = 60
"""Newton steps for the point of an ellipsoid that is nearest, at most; near the surface five do."""

CONVERGED = 1e-14
"""Relative change of the multiplier at which that is found: some fifty roundings."""

NEAREST = 1e-9
"""Points are taken to be no nearer to a center or axis, over the root mean square distance of the points from
their middle: there the bend, 1 / distance, has no bounds, and its square must stay finite."""

TINY = float(np.finfo(float).tiny)


@njit(error_model="numpy", cache=True)
def slopes(u: Any, normal: Any, bend: Any, distance_by_size: Any, normal_by_size: Any, motions: Any) -> Any:
    """Return how residuals change with pose and sizes, shapes (n, k) and (n, 3, k), and the bend's size, (n,).

    In the shape's axes a shift by v and a turn by w change u by u x w - v, and the normal, seen from outside, by
    w x m more.
    """
    count, free, sizes = len(u), len(motions), distance_by_size.shape[1]
    by_distance, by_normal = np.empty((count, free + sizes)), np.empty((count, 3, free + sizes))
    size = np.empty(count)
    for i in range(count):
        B, m, p = bend[i], normal[i], u[i]
        squared = 0.0
        for a in range(3):
            for b in range(3):
                squared += B[a, b] * B[a, b]
        size[i] = math.sqrt(squared)
        for j in range(free):
            motion = motions[j]
            # columns of what moves p, and of what turns the normal besides
            x = y = z = turned_x = turned_y = turned_z = 0.0
            if motion == 0:
                x = -1.0
            elif motion == 1:
                y = -1.0
            elif motion == 2:
                z = -1.0
            elif motion == 3:
                y, z, turned_y, turned_z = p[2], -p[1], -m[2], m[1]
            elif motion == 4:
                x, z, turned_x, turned_z = -p[2], p[0], m[2], -m[0]
            else:
                x, y, turned_x, turned_y = p[1], -p[0], -m[1], m[0]
            by_distance[i, j] = m[0] * x + m[1] * y + m[2] * z
            by_normal[i, 0, j] = -(B[0, 0] * x + B[0, 1] * y + B[0, 2] * z + turned_x)
            by_normal[i, 1, j] = -(B[1, 0] * x + B[1, 1] * y + B[1, 2] * z + turned_y)
            by_normal[i, 2, j] = -(B[2, 0] * x + B[2, 1] * y + B[2, 2] * z + turned_z)
        for j in range(sizes):
            by_distance[i, free + j] = distance_by_size[i, j]
            for a in range(3):
                by_normal[i, a, free + j] = -normal_by_size[i, a, j]
    return by_distance, by_normal, size


@njit(error_model="numpy", cache=True)
def normal_equations(distance: Any, normal: Any, by_distance: Any, by_normal: Any, weights: Any) -> Any:
    """Return J'J, shape (k, k), and J'r, shape (k,), of weighed residuals and slopes; weights (n, 2)."""
    count, k = by_distance.shape
    A, b = np.zeros((k, k)), np.zeros(k)
    row = np.empty(k)
    for i in range(count):
        for a in range(4):
            weight = weights[i, 0] if a == 0 else weights[i, 1]
            residual = weight * (distance[i] if a == 0 else normal[i, a - 1])
            for j in range(k):
                row[j] = weight * (by_distance[i, j] if a == 0 else by_normal[i, a - 1, j])
            for j in range(k):
                b[j] += row[j] * residual
                for other in range(j + 1):
                    A[j, other] += row[j] * row[other]
    for j in range(k):
        for other in range(j):
            A[other, j] = A[j, other]
    return A, b


@njit(error_model="numpy", cache=True)
def weighed_squares(distance: Any, normal: Any, weights: Any) -> Any:
    """Return the sum of the squares of weighed residuals."""
    total = 0.0
    for i in range(len(distance)):
        n = normal[i]
        total += (weights[i, 0] * distance[i]) ** 2
        total += weights[i, 1] ** 2 * (n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
    return total


@njit(error_model="numpy", cache=True)
def nearest_multiplier(x: Any, y: Any, z: Any, a: Any) -> Any:
    """Return t with sum (a_i u_i / (a_i^2 + t))^2 = 1, above -min(a)^2: the nearest of the stationary points.

    On that side G falls and is convex, so Newton's method climbs from any start left of the root without passing
    it. G >= (a_i u_i / (a_i^2 + t))^2 for each i puts a_i |u_i| - a_i^2 left of it.
    """
    smallest = min(a[0], a[1], a[2]) ** 2
    floor = -smallest * (1.0 - 1e-12)
    start = max(a[0] * abs(x) - a[0] ** 2, a[1] * abs(y) - a[1] ** 2, a[2] * abs(z) - a[2] ** 2)
    t = max(start, floor)
    u = (x, y, z)
    for _ in range(ROUNDS):
        G = slope = 0.0
        for i in range(3):
            D = a[i] ** 2 + t
            term = (a[i] * u[i]) ** 2 / D**2
            G += term
            slope += term / D
        # Newton on 1/sqrt(G) - 1, which is nearly straight
        step = G * (math.sqrt(G) - 1.0) / max(slope, TINY)
        t = max(t + step, floor)
        if abs(step) <= CONVERGED * (smallest + abs(t)):
            break
    return t


@njit(error_model="numpy", cache=True)
def around_ellipsoid(points: Any, a: Any, side: Any) -> Any:
    """Return the fields of a `LocalGeometry`: see `palpate.mapping.primitives.ellipsoid`."""
    count = len(points)
    distance, normal, bend = np.empty(count), np.empty((count, 3)), np.empty((count, 3, 3))
    by_distance, by_normal = np.empty((count, 3)), np.empty((count, 3, 3))
    D, g, m, t_u, t_q = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for i in range(count):
        u = points[i]
        t = nearest_multiplier(u[0], u[1], u[2], a)
        squared = G_t = 0.0
        for j in range(3):
            D[j] = a[j] ** 2 + t
            g[j] = u[j] / D[j]
            squared += g[j] * g[j]
            G_t += a[j] ** 2 * g[j] ** 2 / D[j]
        length = max(math.sqrt(squared), TINY)
        G_t = min(-2.0 * G_t, -TINY)
        for j in range(3):
            m[j] = g[j] / length
            t_u[j] = -2.0 * a[j] ** 2 * g[j] / D[j] / G_t
            # q = log a: a dG/da
            t_q[j] = -2.0 * a[j] ** 2 * g[j] ** 2 * (D[j] - 2.0 * a[j] ** 2) / D[j] / G_t
        distance[i] = side * t * length
        for j in range(3):
            normal[i, j] = side * m[j]
            by_distance[i, j] = -side * a[j] ** 2 * g[j] ** 2 / length
            along_u = along_q = 0.0
            for k in range(3):
                g_u, g_q = -(g[k] / D[k]) * t_u[j], -(g[k] / D[k]) * t_q[j]
                if k == j:
                    g_u += 1.0 / D[k]
                    g_q -= 2.0 * a[k] ** 2 * g[k] / D[k]
                bend[i, k, j], by_normal[i, k, j] = g_u / length, g_q / length
                along_u += m[k] * bend[i, k, j]
                along_q += m[k] * by_normal[i, k, j]
            for k in range(3):
                bend[i, k, j] = side * (bend[i, k, j] - m[k] * along_u)
                by_normal[i, k, j] = side * (by_normal[i, k, j] - m[k] * along_q)
    return distance, normal, bend, by_distance, by_normal


@njit(error_model="numpy", cache=True)
def around_torus(points: Any, ring: Any, tube: Any, side: Any) -> Any:
    """Return the fields of a `LocalGeometry` along the line from the nearest point of the ring."""
    count = len(points)
    distance, normal, bend = np.empty(count), np.empty((count, 3)), np.empty((count, 3, 3))
    by_distance, by_normal = np.empty((count, 2)), np.zeros((count, 3, 2))
    n, outward, round_axis, round_tube = np.empty(3), np.zeros(3), np.zeros(3), np.empty(3)
    for i in range(count):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        out = max(math.hypot(x, y), NEAREST)
        outward[0], outward[1] = x / out, y / out
        n[0], n[1], n[2] = x - ring * outward[0], y - ring * outward[1], z
        reach = max(math.sqrt(n[0] ** 2 + n[1] ** 2 + n[2] ** 2), NEAREST)
        for j in range(3):
            n[j] /= reach
        round_axis[0], round_axis[1] = -outward[1], outward[0]
        round_tube[0], round_tube[1] = round_axis[1] * n[2], -round_axis[0] * n[2]
        round_tube[2] = round_axis[0] * n[1] - round_axis[1] * n[0]
        leaning = n[0] * outward[0] + n[1] * outward[1]
        distance[i] = side * (reach - tube)
        by_distance[i, 0], by_distance[i, 1] = -side * leaning, -side
        for j in range(3):
            normal[i, j] = side * n[j]
            by_normal[i, j, 0] = -side * (outward[j] - leaning * n[j]) / reach
            for k in range(3):
                bent = round_tube[j] * round_tube[k] / reach + round_axis[j] * round_axis[k] * (leaning / out)
                bend[i, j, k] = side * bent
    return distance, normal, bend, by_distance, by_normal
