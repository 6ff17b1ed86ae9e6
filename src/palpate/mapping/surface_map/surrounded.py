"""Whether contacts lie on all sides of a point, or only on one."""

import itertools
import math

import numpy as np
import numpy.typing as npt
from scipy.spatial import KDTree

from palpate.compiling import njit
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
    ends = np.cumsum(np.array([len(each) for each in near], dtype=np.intp))
    contact = np.fromiter(itertools.chain.from_iterable(near), dtype=np.intp)
    return _surrounded(points, normals, np.asarray(tree.data), contact_normals, contact, ends)


@njit(cache=True)
def _surrounded(
    points: FloatArray,
    normals: FloatArray,
    contacts: FloatArray,
    contact_normals: FloatArray,
    near: npt.NDArray[np.intp],
    ends: npt.NDArray[np.intp],
) -> npt.NDArray[np.bool_]:
    """Return `surrounded`; contacts near each point follow one another in `near` and end before `ends` (n,)."""
    found = np.zeros(len(points), np.bool_)
    begin = 0
    for at in range(len(points)):
        n = normals[at]
        # any direction in each tangent plane to count angles from
        axis = np.zeros(3)
        axis[np.abs(n).argmin()] = 1.0
        y = np.cross(n, axis)
        x = np.cross(y, n)  # as long as y: only their ratio counts
        angle = np.empty(ends[at] - begin)
        count = 0
        for each in near[begin : ends[at]]:
            if (n * contact_normals[each]).sum() > SAME_FACE_COS:
                away = contacts[each] - points[at]
                angle[count] = math.atan2((away * y).sum(), (away * x).sum())
                count += 1
        begin = ends[at]
        if count:
            angle = np.sort(angle[:count])
            gap = angle[0] + 2.0 * math.pi - angle[count - 1]  # across the branch cut
            for i in range(1, count):
                gap = max(gap, angle[i] - angle[i - 1])
            found[at] = gap <= WIDEST_GAP
    return found
