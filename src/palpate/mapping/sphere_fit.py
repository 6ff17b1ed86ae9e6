"""The sphere nearest to a set of points, and how well the points determine it."""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares

from palpate.errors import FloatArray, InvalidValueError

MIN_POINTS = 4
"""Unknowns of a sphere: three of the center, one radius."""

FLAT_FACTOR = 16.0
"""Points count as coplanar when their thickness is within this many roundings of their coordinates."""

WEAK_RELATIVE_SD = 0.1
"""Above this standard deviation of the radius, relative to it, the points say little about the radius."""

TOLERANCE = 1e-14
"""Relative change at which the iteration stops: some fifty roundings, on data scaled to unit size."""


class SphereFitStatus(IntEnum):
    """Whether a fitted sphere can be relied on."""

    OK = 0
    """Converged, and the points determine the radius."""
    WEAK = 1
    """Converged, but the radius is known to no better than `WEAK_RELATIVE_SD` (a shallow cap, few points)."""
    NOT_CONVERGED = 2
    """The iteration gave up: as good as flat at the level of the noise."""


@dataclass(frozen=True, slots=True, eq=False)
class SphereFit:
    """A sphere through points in the least-squares sense of geometric distance, in the frame of the points.

    The covariance takes the points' errors as independent, of one size, and along the normal. Errors of touch
    are correlated along the path (filters, servo lag, friction), so it is **optimistic** unless `fit_sphere`
    was measured over how many points; a constant offset of every point along the normal goes into the radius
    unseen.

    Attributes:
        center: Shape (3,) [m].
        radius: [m].
        covariance: Of (center, radius), shape (4, 4) [m^2]; infinite where no point is left to judge the
            noise by.
        rms_residual: Root mean square distance of the points from the sphere [m].
        condition: Ratio of the best to the worst determined combination of (center, radius), by standard
            deviation. Near 1 for a whole sphere; a cap of half-angle 25 degrees has about 70.
        status: See `SphereFitStatus`.
        point_count: Number of points used.
    """

    center: FloatArray
    radius: float
    covariance: FloatArray
    rms_residual: float
    condition: float
    status: SphereFitStatus
    point_count: int

    @property
    def center_sd(self) -> FloatArray:
        """Standard deviation of the center along each axis, shape (3,) [m]."""
        return np.sqrt(np.diag(self.covariance)[:3])

    @property
    def radius_sd(self) -> float:
        """Standard deviation of the radius [m]."""
        return float(np.sqrt(self.covariance[3, 3]))


def fit_sphere(points: npt.ArrayLike, *, correlation_points: float = 1.0) -> SphereFit:
    """Return the sphere with the least sum of squared distances to `points`.

    The algebraic fit (linear in (center, r^2 - |center|^2)) only starts the iteration: with noise it is
    biased towards small radii on a cap.

    Args:
        points: Shape (n, 3) [m], any frame, n at least 4 and not in one plane.
        correlation_points: Over how many neighbouring points errors are alike: n points then count as
            n / correlation_points independent ones (long-run variance; 2 L / b for errors with correlation
            length L in bins of length b). Rather too large than too small: for a raster, the points of a row,
            since speed and friction push a whole row in the same direction.

    Raises:
        InvalidValueError: Fewer than 4 points, not of shape (n, 3), not finite, in one plane to within
            rounding, or `correlation_points` below 1.
    """
    points = _checked(points)
    if not (np.isfinite(correlation_points) and correlation_points >= 1.0):
        raise InvalidValueError(
            f"correlation_points = {correlation_points!r}: must be a finite number, 1 or above"
        )
    origin = points.mean(axis=0)
    centred = points - origin
    scale = float(np.sqrt((centred**2).sum(axis=1).mean()))
    _refuse_flat(points, centred)
    scaled = centred / scale

    def residuals(sphere: FloatArray) -> FloatArray:
        return np.asarray(np.linalg.norm(scaled - sphere[:3], axis=1) - sphere[3])

    def jacobian(sphere: FloatArray) -> FloatArray:
        offset = sphere[:3] - scaled
        distance = np.linalg.norm(offset, axis=1, keepdims=True)
        return np.hstack([offset / np.maximum(distance, np.finfo(float).tiny), -np.ones((len(scaled), 1))])

    found = least_squares(
        residuals,
        _algebraic(scaled),
        jac=jacobian,
        method="lm",
        ftol=TOLERANCE,
        xtol=TOLERANCE,
        gtol=TOLERANCE,
    )
    sphere = np.asarray(found.x, dtype=np.float64)
    if sphere[3] < 0.0:
        raise InvalidValueError("points: no sphere of positive radius fits them; are they one closed surface?")
    misfit = float(np.sqrt((residuals(sphere) ** 2).mean()))
    covariance, condition = _covariance(jacobian(sphere), misfit, correlation_points)
    radius_sd = float(np.sqrt(covariance[3, 3]))
    if not found.success:
        status = SphereFitStatus.NOT_CONVERGED
    else:
        weak = radius_sd > WEAK_RELATIVE_SD * sphere[3]
        status = SphereFitStatus.WEAK if weak else SphereFitStatus.OK
    center = origin + scale * sphere[:3]
    center.setflags(write=False)
    return SphereFit(
        center=center,
        radius=scale * float(sphere[3]),
        covariance=scale**2 * covariance,
        rms_residual=scale * misfit,
        condition=condition,
        status=status,
        point_count=len(points),
    )


def _algebraic(points: FloatArray) -> FloatArray:
    """Solve |p|^2 = 2 c.p + k by least squares for centred points; then r^2 = k + |c|^2."""
    A = np.hstack([2.0 * points, np.ones((len(points), 1))])
    (*c, k), *_ = np.linalg.lstsq(A, (points**2).sum(axis=1))
    center = np.array(c)
    return np.append(center, np.sqrt(max(k + center @ center, np.finfo(float).tiny)))


def _covariance(jacobian: FloatArray, misfit: float, correlation_points: float) -> tuple[FloatArray, float]:
    """Return sigma^2 (J'J)^-1 scaled to the effective number of points, and the condition number of J."""
    count = len(jacobian)
    _, singular, axes = np.linalg.svd(jacobian, full_matrices=False)
    condition = float(singular[0] / singular[-1]) if singular[-1] > 0.0 else float("inf")
    effective = count / correlation_points
    if effective <= MIN_POINTS or not np.isfinite(condition):
        return np.full((4, 4), np.inf), condition
    variance = misfit**2 * effective / (effective - MIN_POINTS)
    spread = axes.T / singular
    return variance * correlation_points * (spread @ spread.T), condition


def _checked(points: npt.ArrayLike) -> FloatArray:
    array = np.asarray(points, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != 3:
        raise InvalidValueError(f"points have shape {array.shape}: must be (n, 3) [m]")
    if len(array) < MIN_POINTS:
        raise InvalidValueError(f"{len(array)} points cannot determine a sphere: give {MIN_POINTS} or more")
    if not np.isfinite(array).all():
        raise InvalidValueError("points must be finite; keep only contacts whose status is OK")
    return array


def _refuse_flat(points: FloatArray, centred: FloatArray) -> None:
    """Raise if the points lie in one plane as far as their digits can tell."""
    singular = np.linalg.svd(centred, compute_uv=False)
    rounding = float(np.finfo(float).eps * np.abs(points).max()) * np.sqrt(len(points))
    limit = FLAT_FACTOR * rounding
    if singular[2] <= limit:
        shape = ("one place", "one line", "one plane")[int((singular[:2] > limit).sum())]
        raise InvalidValueError(
            f"the {len(points)} points lie in {shape} (thickness "
            f"{singular[2] / np.sqrt(len(points)):.1e} m) and leave the sphere undetermined: "
            "touch the object where it curves away"
        )
