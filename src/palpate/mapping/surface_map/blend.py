"""Patches that overlap speak with one voice: a partition of unity."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from palpate.errors import FloatArray
from palpate.mapping.surface_map.patch import Patch

SAME_SHEET_COS = 0.3
"""A patch whose normal differs by more than 73 degrees from that of the nearest contact is of another sheet."""

FLAT_COS, STEEP_COS = 0.8, 0.45
"""Between these cosines of the angle between a patch's axis and its surface its weight falls to nothing: heights
over a plane say little about what is steep on it."""


@dataclass(frozen=True, slots=True, eq=False)
class Blend:
    """Blended heights above the surface at n points.

    Attributes:
        distance: To first order in its size, shape (n,) [m]; NaN where no patch reaches.
        normal: Shape (n, 3).
        sd: Shape (n,) [m]; NaN unless asked for.
        surprise: Shape (n,).
    """

    distance: FloatArray
    normal: FloatArray
    sd: FloatArray
    surprise: FloatArray


def blended(
    points: FloatArray,
    sheet_normals: FloatArray,
    patches: Sequence[Patch],
    centers: FloatArray,
    reach: float,
    *,
    with_sd: bool,
) -> Blend:
    """Return what all patches within `reach` say, weighted by Wendland's (1 - r)^4 (4 r + 1).

    Neighbouring patches share their data, so their errors are taken as fully correlated: standard deviations are
    averaged like the distances, never divided by the root of their number.

    Args:
        points: Near the surface, shape (n, 3) [m].
        sheet_normals: Normal of the nearest contact of each, which tells sheets apart, shape (n, 3).
        patches: All patches.
        centers: Theirs, shape (p, 3) [m].
        reach: Where a weight ends [m].
        with_sd: Whether standard deviations are wanted: they cost ten times the rest.
    """
    n = len(points)
    total, distance, surprise = np.zeros(n), np.zeros(n), np.zeros(n)
    sd = np.zeros(n) if with_sd else np.full(n, np.nan)
    normal = np.zeros((n, 3))
    near = KDTree(points).query_ball_point(centers, reach) if n else []
    for patch, found in zip(patches, near, strict=False):
        if not found:
            continue
        chosen = np.array(found, dtype=np.intp)
        offset = points[chosen] - patch.frame.center
        local = offset @ patch.frame.axes.T
        h, hx, hy = patch.heights(local[:, :2])
        cos = 1.0 / np.sqrt(1.0 + hx * hx + hy * hy)
        n_local = np.stack([-hx * cos, -hy * cos, cos], axis=1) @ patch.frame.axes
        r = np.minimum(np.linalg.norm(offset, axis=1) / reach, 1.0)
        ramp = np.clip((cos - STEEP_COS) / (FLAT_COS - STEEP_COS), 0.0, 1.0)
        weight = (1.0 - r) ** 4 * (4.0 * r + 1.0) * ramp * ramp * (3.0 - 2.0 * ramp)
        weight *= (n_local * sheet_normals[chosen]).sum(axis=1) > SAME_SHEET_COS
        total[chosen] += weight
        distance[chosen] += weight * (local[:, 2] - h) * cos
        normal[chosen] += weight[:, None] * n_local
        surprise[chosen] += weight * patch.surprise
        if with_sd:
            speaks = weight > 0.0
            sd[chosen[speaks]] += (weight * cos)[speaks] * patch.height_sd(local[speaks, :2])
    with np.errstate(invalid="ignore", divide="ignore"):
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        return Blend(distance / total, normal, sd / total, surprise / total)
