"""Whether contacts lie on all sides of a point, or only on one."""

import itertools

import numpy as np
import numpy.typing as npt
from scipy.spatial import KDTree

from palpate.errors import FloatArray

WIDEST_GAP = np.radians(190.0)
"""Widest sector without contacts around a point that still counts as felt. At a straight edge of what was felt it
is 180 degrees; 190 lets the edge be ragged and the map go 0.09 of the search radius beyond it."""

SAME_FACE_COS = 0.5
"""Contacts whose normal differs by more than 60 degrees lie on another face."""


def surrounded(
    points: FloatArray, normals: FloatArray, tree: KDTree, contact_normals: FloatArray, radius: float
) -> npt.NDArray[np.bool_]:
    """Return whether contacts within `radius` leave no sector wider than `WIDEST_GAP`, shape (n,).

    Args:
        points: Points of the surface, shape (n, 3) [m].
        normals: Its unit normals there, shape (n, 3).
        tree: Over the contacts, (m, 3) [m].
        contact_normals: Shape (m, 3).
        radius: How far to look [m].
    """
    near: list[list[int]] = np.asarray(tree.query_ball_point(points, radius), dtype=object).tolist()
    counts = np.array([len(each) for each in near], dtype=np.intp)
    contact = np.fromiter(itertools.chain.from_iterable(near), dtype=np.intp, count=int(counts.sum()))
    point = np.repeat(np.arange(len(points)), counts)
    same = (normals[point] * contact_normals[contact]).sum(axis=1) > SAME_FACE_COS
    point, contact = point[same], contact[same]
    # any direction in each tangent plane to count angles from
    x = np.eye(3)[np.abs(normals).argmin(axis=1)]
    x = x - (x * normals).sum(axis=1, keepdims=True) * normals
    y = np.cross(normals, x)
    x = np.cross(y, normals)  # as long as y: only their ratio counts
    away = np.asarray(tree.data)[contact] - points[point]
    angle = np.arctan2((away * y[point]).sum(axis=1), (away * x[point]).sum(axis=1))
    order = np.lexsort((angle, point))
    point, angle = point[order], angle[order]
    found = np.zeros(len(points), dtype=np.bool_)
    if not len(point):
        return found
    first = np.flatnonzero(np.diff(point, prepend=-1))
    last = np.append(first[1:], len(point)) - 1
    gap = np.diff(angle, append=0.0)
    gap[last] = angle[first] + 2.0 * np.pi - angle[last]  # across the branch cut
    found[point[first]] = np.maximum.reduceat(gap, first) <= WIDEST_GAP
    return found
