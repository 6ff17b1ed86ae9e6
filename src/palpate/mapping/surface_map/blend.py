"""Patches that overlap speak with one estimate: a partition of unity."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import KDTree

from palpate.errors import FloatArray
from palpate.mapping.surface_map.patch import SurfacePatch

IndexArray = npt.NDArray[np.intp]

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


@dataclass(frozen=True, slots=True, eq=False)
class PatchEstimate:
    """Estimate of one patch at the k points within its reach.

    Attributes:
        patch: The patch.
        chosen: Which points, shape (k,).
        local: They in the patch's frame, shape (k, 3) [m].
        height: Of the surface there, shape (k,) [m].
        slope: Of the surface there, shape (k, 2).
        cos: Of the angle between the patch's axis and its surface, shape (k,).
        weight: Shape (k,), from 0 on.
    """

    patch: SurfacePatch
    chosen: IndexArray
    local: FloatArray
    height: FloatArray
    slope: FloatArray
    cos: FloatArray
    weight: FloatArray

    @property
    def normal(self) -> FloatArray:
        """Of the surface there, shape (k, 3)."""
        upright = np.column_stack([-self.slope * self.cos[:, None], self.cos])
        return np.asarray(upright @ self.patch.frame.axes)


def patch_estimates(
    points: FloatArray,
    sheet_normals: FloatArray,
    patches: Sequence[SurfacePatch],
    centers: FloatArray,
    reach: float,
) -> Iterator[PatchEstimate]:
    """Go through the patches within `reach` of points, weighted by Wendland's (1 - r)^4 (4 r + 1).

    Args:
        points: Near the surface, shape (n, 3) [m].
        sheet_normals: Normal of the nearest contact of each, which tells sheets apart, shape (n, 3).
        patches: All patches.
        centers: Theirs, shape (p, 3) [m].
        reach: Where a weight ends [m].
    """
    near = KDTree(points).query_ball_point(centers, reach) if len(points) else []
    for patch, found in zip(patches, near, strict=False):
        if not found:
            continue
        chosen = np.array(found, dtype=np.intp)
        offset = points[chosen] - patch.frame.center
        local = offset @ patch.frame.axes.T
        h, hx, hy = patch.heights(local[:, :2])
        cos = 1.0 / np.sqrt(1.0 + hx * hx + hy * hy)
        r = np.minimum(np.linalg.norm(offset, axis=1) / reach, 1.0)
        ramp = np.clip((cos - STEEP_COS) / (FLAT_COS - STEEP_COS), 0.0, 1.0)
        weight = (1.0 - r) ** 4 * (4.0 * r + 1.0) * ramp * ramp * (3.0 - 2.0 * ramp)
        estimate = PatchEstimate(patch, chosen, local, h, np.stack([hx, hy], axis=1), cos, weight)
        weight *= (estimate.normal * sheet_normals[chosen]).sum(axis=1) > SAME_SHEET_COS
        yield estimate


def blended(estimates: Iterable[PatchEstimate], count: int, *, with_sd: bool) -> Blend:
    """Return the blended estimate of all patches.

    Neighbouring patches share their data, so their errors are taken as fully correlated: standard deviations are
    averaged like the distances, never divided by the root of their number.

    Args:
        estimates: From `patch_estimates`.
        count: Number of points.
        with_sd: Whether standard deviations are wanted: they cost ten times the rest.
    """
    total, distance, surprise = np.zeros(count), np.zeros(count), np.zeros(count)
    sd = np.zeros(count) if with_sd else np.full(count, np.nan)
    normal = np.zeros((count, 3))
    for each in estimates:
        chosen, weight = each.chosen, each.weight
        total[chosen] += weight
        distance[chosen] += weight * (each.local[:, 2] - each.height) * each.cos
        normal[chosen] += weight[:, None] * each.normal
        surprise[chosen] += weight * each.patch.surprise
        if with_sd:
            speaks = weight > 0.0
            sd[chosen[speaks]] += (weight * each.cos)[speaks] * each.patch.height_sd(each.local[speaks, :2])
    with np.errstate(invalid="ignore", divide="ignore"):
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        return Blend(distance / total, normal, sd / total, surprise / total)
