"""Normals of a surface from places on it alone, without the normals that were felt there."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial import KDTree

from palpate.errors import FloatArray

FEWEST = 12
"""Places around one from which its normal is taken: twice the unknowns of a paraboloid."""

FLATTEST = 1e-2
"""Least over largest singular value of a fit: places along one line leave the tilt across it open."""


@dataclass(frozen=True, slots=True, eq=False)
class PointNormals:
    """Normals at some of many places.

    Attributes:
        rows: At which, shape (m,).
        normal: Unit normals there, on the side of those that were given, shape (m, 3).
        bend: By how much they turn from place to place, dn/dx, shape (m, 3, 3) [1/m].
    """

    rows: npt.NDArray[np.intp]
    normal: FloatArray
    bend: FloatArray


def point_normals(
    position: FloatArray, side: FloatArray, *, radius: float, spacing: float, count: int
) -> PointNormals:
    """Return normals of paraboloids through the places around.

    Args:
        position: Places on a surface, shape (n, 3) [m].
        side: Unit vectors that tell in from out, within 60 degrees of the normals, shape (n, 3).
        radius: Of what counts as around [m].
        spacing: Of the places that are kept [m]: one per cube of this size.
        count: At how many places normals are wanted, about.
    """
    cubes = np.floor(position / spacing).astype(np.int64)
    kept = np.sort(np.unique(cubes, axis=0, return_index=True)[1])
    places = position[kept]
    tree = KDTree(places)
    asked = kept[:: max(1, len(kept) // count)]
    near_each: Any = tree.query_ball_point(position[asked], radius)
    rows, normals, bends = [], [], []
    for i, around in zip(asked.tolist(), near_each, strict=True):
        if len(around) < FEWEST:
            continue
        up = side[i]
        across = np.linalg.svd(up[None])[2][1:]
        near = (places[around] - position[i]) / radius
        a, b = (near @ across.T).T
        design = np.column_stack([np.ones(len(a)), a, b, a * a, a * b, b * b])
        singular = np.linalg.svd(design, compute_uv=False)
        if singular[-1] < FLATTEST * singular[0]:
            continue
        solved = np.linalg.lstsq(design, near @ up, rcond=None)[0]
        normal = up - solved[1:3] @ across
        rows.append(i)
        normals.append(normal / np.linalg.norm(normal))
        second = np.array([[2.0 * solved[3], solved[4]], [solved[4], 2.0 * solved[5]]]) / radius
        bends.append(-across.T @ second @ across)
    return PointNormals(
        np.array(rows, dtype=np.intp), np.array(normals).reshape(-1, 3), np.array(bends).reshape(-1, 3, 3)
    )
