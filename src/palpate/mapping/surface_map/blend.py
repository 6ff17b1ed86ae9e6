"""Patches that overlap speak with one estimate: a partition of unity."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import KDTree

from palpate.errors import FloatArray
from palpate.mapping.surface_map.kernel import judge
from palpate.mapping.surface_map.patch import SurfacePatch

IndexArray = npt.NDArray[np.intp]
BoolArray = npt.NDArray[np.bool_]

SAME_SHEET_COS = 0.3
"""A patch whose normal differs by more than 73 degrees from that of the nearest contact is of another sheet."""

FLAT_COS, STEEP_COS = 0.8, 0.45
"""Between these cosines of the angle between a patch's axis and its surface its weight falls to nothing: heights
over a plane say little about what is steep on it."""

LEAST_SHARE = 0.02
"""Patches whose weight is a smaller share of all are not asked how well they know, nor how they bend, which takes
most of the time. On the torus of `benchmarks/surface_maps.py` deviations change by 0.4 % of the largest and
curvatures by 0.5 %."""

JUDGED = (FLAT_COS, STEEP_COS, SAME_SHEET_COS)


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
        cos: Of the angle between the patch's axis and its surface, shape (k,).
        normal: Of the surface there, shape (k, 3).
        weight: Shape (k,), from 0 on.
    """

    patch: SurfacePatch
    chosen: IndexArray
    local: FloatArray
    height: FloatArray
    cos: FloatArray
    normal: FloatArray
    weight: FloatArray

    def at(self, kept: BoolArray) -> "PatchEstimate":
        """Return it at some of its points."""
        each = (self.local, self.height, self.cos, self.normal, self.weight)
        return PatchEstimate(self.patch, self.chosen[kept], *(values[kept] for values in each))


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
        heights = patch.heights(local[:, :2])
        cos, normal, weight = judge(heights, offset, sheet_normals[chosen], patch.frame.axes, reach, *JUDGED)
        yield PatchEstimate(patch, chosen, local, heights[0], cos, normal, weight)


def weighty(estimates: Sequence[PatchEstimate], count: int) -> Iterator[PatchEstimate]:
    """Go through estimates at `count` points, each where its weight is `LEAST_SHARE` of all or more."""
    total = np.zeros(count)
    for each in estimates:
        total[each.chosen] += each.weight
    for each in estimates:
        kept = (each.weight > 0.0) & (each.weight >= LEAST_SHARE * total[each.chosen])
        if kept.any():
            yield each.at(kept)


def blended(estimates: Iterable[PatchEstimate], count: int, *, with_sd: bool) -> Blend:
    """Return the blended estimate of all patches.

    Neighbouring patches share their data, so their errors are taken as fully correlated: standard deviations are
    averaged over the `weighty` ones like the distances, never divided by the root of their number.

    Args:
        estimates: From `patch_estimates`.
        count: Number of points.
        with_sd: Whether standard deviations are wanted: they cost ten times the rest.
    """
    estimates = list(estimates)
    total, distance, surprise = np.zeros(count), np.zeros(count), np.zeros(count)
    normal = np.zeros((count, 3))
    for each in estimates:
        chosen, weight = each.chosen, each.weight
        total[chosen] += weight
        distance[chosen] += weight * (each.local[:, 2] - each.height) * each.cos
        normal[chosen] += weight[:, None] * each.normal
        surprise[chosen] += weight * each.patch.surprise
    sd, asked = np.zeros(count), np.zeros(count)
    for each in weighty(estimates, count) if with_sd else ():
        asked[each.chosen] += each.weight
        sd[each.chosen] += each.weight * each.cos * each.patch.height_sd(each.local[:, :2])
    with np.errstate(invalid="ignore", divide="ignore"):
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        return Blend(distance / total, normal, sd / asked, surprise / total)
