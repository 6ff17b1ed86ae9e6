"""Curvature from rolling: how the normal turns as the contact moves over the surface.

Where a contact rolls or slides over a surface the normal turns with the contact's place, dn = W dc, by the
surface's own shape operator, as it does on the fingertip by the tip's (`palpate.sensing.curvature`; D. Montana,
"The kinematics of contact and grasp", 1988). Positions enter only as places along the surface, not as heights, so
this is another witness than the map's second derivatives: errors of the heights, such as a compliance that is not
known, leave it alone, and errors of the tip's shape do not.
"""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import KDTree

from palpate.compiling import njit
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
        asked = min(NEAREST, len(stretches))
        distance, index = KDTree(stretches.position).query(points, asked, distance_upper_bound=reach)
        index = np.sort(np.where(np.isfinite(distance), index, 0), axis=1)  # along the path
        typical = np.array([float(np.median(stretches.extent))])
        form, variance = _fitted(
            index,
            stretches.position,
            stretches.normal,
            model.tilt * stretches.tilt,
            stretches.path,
            points,
            normals,
            tangents,
            reach,
            model.tilt_length,
            float(path_correlation(np.zeros(1), typical, model.tilt_length)[0, 0]),
        )
    return RolledCurvature(form, tangents, 0.5 * (form[:, 0] + form[:, 2]), np.sqrt(variance))


@njit(cache=True, error_model="numpy")
def _fitted(
    index: npt.NDArray[np.intp],
    position: FloatArray,
    turned: FloatArray,
    tilt: FloatArray,
    path: FloatArray,
    points: FloatArray,
    normals: FloatArray,
    tangents: FloatArray,
    reach: float,
    length: float,
    own: float,
) -> tuple[FloatArray, FloatArray]:
    """Return the form (n, 3) and the variance of its mean (n,) at each point; NaN where contacts do not tell.

    Noise that keeps along the path is taken to first order in the stretches' lengths: the exact integrals would be
    taken point by point. What is kept of all before a stretch is what was kept of them at the last one, less what
    is lost since: no matrix is needed.

    Args:
        index: Stretches near each point, increasing; one may stand there more than once, shape (n, k).
        position: Of all stretches, shape (m, 3) [m].
        turned: Their normals, shape (m, 3).
        tilt: Standard deviation of these about each tangent, shape (m,) [rad].
        path: Where they lie along the path, shape (m,) [m].
        points: Shape (n, 3) [m].
        normals: Shape (n, 3).
        tangents: Shape (n, 3, 2).
        reach: Where weights end [m].
        length: How far the noise of normals keeps [m].
        own: Variance of the mean of a unit noise over one stretch.
    """
    n, k = index.shape
    form, variance = np.full((n, 3), np.nan), np.full(n, np.nan)
    x, y, w, u, v = np.empty(k), np.empty(k), np.empty(k), np.empty(k), np.empty(k)
    used = np.empty(k, np.intp)
    A, b = np.empty((5, 5)), np.empty((5, 2))
    for at in range(n):
        count, last = 0, -1
        for each in index[at]:
            square = up = px = py = tx = ty = 0.0
            for i in range(3):
                off = position[each, i] - points[at, i]
                square += off * off
                up += turned[each, i] * normals[at, i]
                px += off * tangents[at, i, 0]
                py += off * tangents[at, i, 1]
                tx += turned[each, i] * tangents[at, i, 0]
                ty += turned[each, i] * tangents[at, i, 1]
            r = math.sqrt(square) / reach
            if each != last and r < 1.0 and up > SAME_FACE_COS:
                used[count], w[count] = each, (1.0 - r) ** 4 * (4.0 * r + 1.0)
                # places in units of the reach: unknowns of one size
                x[count], y[count], u[count], v[count] = px / reach, py / reach, tx / up, ty / up
                count += 1
            last = each
        if count < MIN_STRETCHES:
            continue
        # slopes of n/n_z are W c plus an offset: rows for (o_1, o_2, w_11, w_12, w_22)
        s0 = sx = sy = sxx = sxy = syy = 0.0
        b[:] = 0.0
        for j in range(count):
            wx, wy = w[j] * x[j], w[j] * y[j]
            s0, sx, sy = s0 + w[j], sx + wx, sy + wy
            sxx, sxy, syy = sxx + wx * x[j], sxy + wx * y[j], syy + wy * y[j]
            b[0, 0] += w[j] * u[j]
            b[1, 0] += w[j] * v[j]
            b[2, 0] += wx * u[j]
            b[3, 0] += wy * u[j] + wx * v[j]
            b[4, 0] += wy * v[j]
        # places that lie in more than one row
        cxx, cyy, cxy = sxx - sx * sx / s0, syy - sy * sy / s0, sxy - sx * sy / s0
        middle, radius = 0.5 * (cxx + cyy), math.hypot(0.5 * (cxx - cyy), cxy)
        if not middle - radius > MIN_SPREAD_RATIO**2 * (middle + radius):
            continue
        A[0], A[1] = np.array([s0, 0.0, sx, sy, 0.0]), np.array([0.0, s0, 0.0, sx, sy])
        A[2], A[3] = np.array([sx, 0.0, sxx, sxy, 0.0]), np.array([sy, sx, sxy, sxx + syy, sxy])
        A[4] = np.array([0.0, sy, 0.0, sxy, syy])
        b[2, 1] = b[4, 1] = 0.5
        solved = np.linalg.solve(A, b)
        c, g = solved[:, 0], solved[:, 1]
        kept_u = kept_v = total = misfit = expected = 0.0
        for j in range(count):
            sd = tilt[used[j]]
            by_u = w[j] * sd * (g[0] + g[2] * x[j] + g[3] * y[j])
            by_v = w[j] * sd * (g[1] + g[3] * x[j] + g[4] * y[j])
            total += by_u * by_u + by_v * by_v + 2.0 * (by_u * kept_u + by_v * kept_v)
            if j + 1 < count:
                fades = math.exp((path[used[j]] - path[used[j + 1]]) / length)
                kept_u, kept_v = fades * (kept_u + by_u), fades * (kept_v + by_v)
            off_u = u[j] - c[0] - c[2] * x[j] - c[3] * y[j]
            off_v = v[j] - c[1] - c[3] * x[j] - c[4] * y[j]
            misfit += w[j] * (off_u * off_u + off_v * off_v)
            expected += 2.0 * own * w[j] * sd * sd
        form[at] = c[2:] / reach
        variance[at] = own * total / (reach * reach) * max(1.0, misfit / expected)
    return form, variance
