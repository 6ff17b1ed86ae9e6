"""Curvature from rolling: how the normal turns as the contact moves over the surface.

Where a contact rolls or slides over a surface the normal turns with the contact's place, dn = W dc, by the
surface's own shape operator, as it does on the fingertip by the tip's (`palpate.sensing.curvature`; D. Montana,
"The kinematics of contact and grasp", 1988). Positions enter only as places along the surface, not as heights, so
this is another witness than the map's second derivatives: errors of the heights, such as a compliance that is not
known, leave it alone, and errors of the tip's shape do not.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import KDTree

from palpate.errors import FloatArray, InvalidValueError, positive
from palpate.mapping.surface_map.covariance import path_correlation
from palpate.mapping.surface_map.curvature import tangent_basis
from palpate.mapping.surface_map.model import SurfaceModel
from palpate.mapping.surface_map.stretches import Stretches

NEAREST = 32
"""Stretches that determine the curvature at a point: rows 1 mm apart and within 3 mm on either side hold as
many."""

MIN_STRETCHES = 5
"""Stretches below which no curvature is reported: 10 slopes for 5 unknowns."""

MIN_SPREAD_RATIO = 0.05
"""Contacts whose spread across their line is below this share of that along it are one row: how the normal turns
across it is not known."""

AT_ONCE = 2000
"""Points worked on together: matrices of 32 x 32 for each are 16 MB."""

SAME_FACE_COS = 0.5
"""Stretches whose normal differs by more than 60 degrees lie on another face."""


@dataclass(frozen=True, slots=True, eq=False)
class RolledCurvature:
    """Mean curvature at n points from the turning of normals; NaN where contacts around do not tell.

    Attributes:
        form: Entries (w_11, w_12, w_22) of the shape operator in `tangents`, shape (n, 3) [1/m].
        tangents: Orthonormal tangents as columns, in the base frame, shape (n, 3, 2).
        mean: Mean of the principal curvatures, positive where convex, shape (n,) [1/m].
        mean_sd: Its standard deviation from the noise of normals, shape (n,) [1/m].
    """

    form: FloatArray
    tangents: FloatArray
    mean: FloatArray
    mean_sd: FloatArray

    @property
    def principal(self) -> FloatArray:
        """The larger and the smaller principal curvature, shape (n, 2) [1/m]."""
        a, b, c = self.form.T
        radius = np.hypot(0.5 * (a - c), b)
        return np.stack([self.mean + radius, self.mean - radius], axis=1)


def rolled_curvature(
    stretches: Stretches, points: FloatArray, normals: FloatArray, model: SurfaceModel, reach: float
) -> RolledCurvature:
    """Return how normals turn about points of a surface: a line through slopes over places, by least squares.

    Wendland's weights (1 - r)^4 (4 r + 1) fall to nothing at `reach`. Deviations are those of the weighted sums
    under noise that keeps along the path ("sandwich"), so they hold whatever the weights; where normals are
    farther from the line than noise, as at an edge, they are widened (Birge, 1932).

    Args:
        stretches: What was felt, such as `SurfaceMap.stretches`.
        points: Shape (n, 3) [m].
        normals: Outward unit normals there, shape (n, 3).
        model: Noise of normals and how far it keeps.
        reach: How far away contacts tell [m]; some two distances of rows.

    Raises:
        InvalidValueError: `reach` is not positive, or shapes differ.
    """
    reach = positive("reach", reach, "m")
    points, normals = np.asarray(points, np.float64), np.asarray(normals, np.float64)
    if points.ndim != 2 or points.shape[1] != 3 or points.shape != normals.shape:
        raise InvalidValueError(f"points {points.shape} and normals {normals.shape}: must both be (n, 3)")
    n = len(points)
    form, variance = np.full((n, 3), np.nan), np.full(n, np.nan)
    tangents = tangent_basis(normals)
    if len(stretches) >= MIN_STRETCHES:
        tree = KDTree(stretches.position)
        for first in range(0, n, AT_ONCE):
            part = slice(first, first + AT_ONCE)
            form[part], variance[part] = _fitted(
                stretches, tree, points[part], normals[part], tangents[part], model, reach
            )
    return RolledCurvature(form, tangents, 0.5 * (form[:, 0] + form[:, 2]), np.sqrt(variance))


def _fitted(
    stretches: Stretches,
    tree: KDTree,
    points: FloatArray,
    normals: FloatArray,
    tangents: FloatArray,
    model: SurfaceModel,
    reach: float,
) -> tuple[FloatArray, FloatArray]:
    asked = min(NEAREST, len(stretches))
    distance, index = tree.query(points, asked, distance_upper_bound=reach)
    near = np.isfinite(distance)
    index = np.sort(np.where(near, index, 0), axis=1)  # along the path
    offset = stretches.position[index] - points[:, None]
    far = np.linalg.norm(offset, axis=2)
    turned = stretches.normal[index]
    up = (turned * normals[:, None]).sum(axis=2)
    # sorting has moved those that were padded to the front, as repeats of stretch 0
    repeated = np.concatenate([np.zeros((len(index), 1), np.bool_), index[:, 1:] == index[:, :-1]], axis=1)
    used = (far < reach) & (up > SAME_FACE_COS) & ~repeated
    r = np.minimum(far / reach, 1.0)
    weight = np.where(used, (1.0 - r) ** 4 * (4.0 * r + 1.0), 0.0)
    xy = np.einsum("nki,nit->nkt", offset, tangents)
    slope = np.einsum("nki,nit->nkt", turned, tangents) / np.where(used, up, 1.0)[:, :, None]
    # slopes of n/n_z are W c plus an offset: rows for (o_1, o_2, w_11, w_12, w_22)
    one, zero = np.ones_like(r), np.zeros_like(r)
    rows = np.stack(
        [
            np.stack([one, zero, xy[:, :, 0], xy[:, :, 1], zero], axis=2),
            np.stack([zero, one, zero, xy[:, :, 0], xy[:, :, 1]], axis=2),
        ],
        axis=1,
    )
    scale = np.array([1.0, 1.0, reach, reach, reach])  # unknowns of one size
    rows /= scale
    weighted = (weight[:, None, :, None] * rows).reshape(len(points), -1, 5).transpose(0, 2, 1)
    A = weighted @ rows.reshape(len(points), -1, 5)
    determined = (used.sum(axis=1) >= MIN_STRETCHES) & _is_spread(weight, xy)
    A[~determined] = np.eye(5)
    gain = np.linalg.solve(A, weighted)
    solved = np.einsum("nij,nj->ni", gain, slope.transpose(0, 2, 1).reshape(len(points), -1))
    found = solved / scale
    half = 0.5 * (gain[:, 2] / scale[2] + gain[:, 4] / scale[4]).reshape(len(points), 2, -1)
    tilt = model.tilt * stretches.tilt[index]
    noise = half * tilt[:, None]
    own = _own_variance(stretches.extent[index], model.tilt_length)
    variance = own * _kept_square(noise, stretches.path[index], model.tilt_length)
    misfit = slope - np.einsum("ntki,ni->nkt", rows, solved)
    expected = 2.0 * own * (weight * tilt**2).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        excess = np.maximum(1.0, np.einsum("nk,nkt->n", weight, misfit**2) / expected)
    return np.where(determined[:, None], found[:, 2:], np.nan), np.where(determined, variance * excess, np.nan)


def _is_spread(weight: FloatArray, xy: FloatArray) -> npt.NDArray[np.bool_]:
    """Return whether places lie in more than one row, shape (n,)."""
    total = np.maximum(weight.sum(axis=1), np.finfo(float).tiny)[:, None]
    away = xy - (np.einsum("nk,nkt->nt", weight, xy) / total)[:, None]
    spread = np.linalg.eigvalsh(np.einsum("nk,nks,nkt->nst", weight, away, away))
    return np.asarray(spread[:, 0] > MIN_SPREAD_RATIO**2 * spread[:, 1])


def _own_variance(extent: FloatArray, length: float) -> float:
    """Return `path_correlation` of a typical stretch, of those that cover `extent` [m], with itself."""
    typical = float(np.median(extent))
    return float(path_correlation(np.zeros(1), np.array([typical]), length)[0, 0])


def _kept_square(values: FloatArray, path: FloatArray, length: float) -> FloatArray:
    """Return the variance of sums of a unit noise that keeps along the path as exp(-s / length), shape (n,).

    To first order in the stretches' lengths: the exact integrals would be taken point by point. What is kept of
    all before a stretch is what was kept of them at the last one, less what is lost since: no matrix is needed.

    Args:
        values: Weights in each sum, shape (n, t, k); variances of the t sums are added.
        path: Where they lie, not decreasing, shape (n, k) [m].
        length: How far the noise keeps [m].
    """
    kept = np.exp(-np.diff(path, axis=1) / length)[:, None]
    total, before = (values**2).sum(axis=(1, 2)), np.zeros(values.shape[:2])
    for k in range(1, values.shape[2]):
        before = (before + values[:, :, k - 1]) * kept[:, :, k - 1]
        total += 2.0 * (values[:, :, k] * before).sum(axis=1)
    return np.asarray(total)
