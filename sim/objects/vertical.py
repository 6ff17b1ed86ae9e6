"""Where a vertical line meets a closed triangle mesh: compiled.

Triangles that share an edge see the same line pass on the same side of it: the edge is always computed from its
lesser end, and a line through it counts as passing at (x - e^2, y + e), e arbitrarily small. So every line goes
in and out of a closed mesh equally often, through edges and corners, too.
"""

import math
from typing import Any

import numpy as np

from palpate.compiling import njit
from palpate.errors import FloatArray
from palpate.surfaces.triangle_tree import DEEPEST, opened


@njit(error_model="numpy", cache=True)
def left_of(ax: Any, ay: Any, bx: Any, by: Any, x: Any, y: Any) -> Any:
    """Whether (x, y) lies to the left of the line from a to b, seen from above."""
    turned = bx < ax or (bx == ax and by < ay)
    if turned:
        ax, ay, bx, by = bx, by, ax, ay
    left = (bx - ax) * (y - ay) - (by - ay) * (x - ax) >= 0.0
    return left != turned


@njit(error_model="numpy", cache=True)
def line_through_mesh(tree: Any, x: Any, y: Any, z: Any) -> Any:
    """Follow the line upwards through (x, y) of a mesh that `palpate.surfaces.triangle_tree` has packed.

    Returns:
        Height of the highest facet that faces up (NaN if there is none), z of its unit normal, and how often the
        mesh winds around (x, y, z): facets above it that face up, less those that face down.
    """
    boxes, corners, _ = opened(tree)
    count, last = len(corners), len(boxes) // 2 + 1
    inner = last - 1
    highest, upright, turns = -math.inf, math.nan, 0
    stack = np.empty(DEEPEST, np.int64)
    stack[0], filled = 0, 1
    while filled > 0:
        filled -= 1
        box = stack[filled]
        if x < boxes[box, 0] or x > boxes[box, 3] or y < boxes[box, 1] or y > boxes[box, 4]:
            continue
        if box < inner:
            stack[filled], stack[filled + 1] = 2 * box + 1, 2 * box + 2
            filled += 2
            continue
        for t in range((box - inner) * count // last, (box - inner + 1) * count // last):
            a, b, c = corners[t, 0], corners[t, 1], corners[t, 2]
            ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
            vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
            up = ux * vy - uy * vx
            one = left_of(a[0], a[1], b[0], b[1], x, y)
            two = left_of(b[0], b[1], c[0], c[1], x, y)
            three = left_of(c[0], c[1], a[0], a[1], x, y)
            if up == 0.0 or one != two or two != three:
                continue
            nx, ny = uy * vz - uz * vy, uz * vx - ux * vz
            height = a[2] - (nx * (x - a[0]) + ny * (y - a[1])) / up
            if height > z:
                turns += 1 if up > 0.0 else -1
            if up > 0.0 and height > highest:
                highest, upright = height, up / math.sqrt(nx * nx + ny * ny + up * up)
    return (highest if highest > -math.inf else math.nan), upright, turns


@njit(error_model="numpy", cache=True)
def windings(tree: Any, points: Any) -> Any:
    """How often a mesh winds around each point: 1 inside, 0 outside, 2 where two of its pieces overlap."""
    turns = np.zeros(len(points), np.int64)
    for i in range(len(points)):
        turns[i] = line_through_mesh(tree, points[i, 0], points[i, 1], points[i, 2])[2]
    return turns


@njit(error_model="numpy", cache=True)
def heights_of_mesh(tree: Any, x: Any, y: Any) -> Any:
    """Height of the upper surface over each point (x, y), NaN beside the mesh."""
    found = np.empty(len(x))
    for i in range(len(x)):
        found[i] = line_through_mesh(tree, x[i], y[i], 0.0)[0]
    return found


def upper_surface(tree: FloatArray, x: float, y: float) -> tuple[float, float]:
    """Return the height of the upper surface over (x, y) [m], and z of the unit normal there; NaN beside it."""
    height, upright, _ = line_through_mesh(tree, x, y, 0.0)
    return float(height), float(upright)
