"""Shapes fitted to contacts, with covariance and verdict."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Generic

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray, InvalidValueError
from palpate.estimation import Assumption, BrokenAssumption, Verdict
from palpate.mapping.cloud import TouchCloud
from palpate.mapping.primitives.box import BoxShape, box_starts
from palpate.mapping.primitives.cylinder import CylinderShape, cylinder_starts
from palpate.mapping.primitives.ellipsoid import EllipsoidShape, ellipsoid_starts
from palpate.mapping.primitives.fit_checks import SmoothErrors, determination, residual_checks
from palpate.mapping.primitives.plane import PlaneShape, plane_starts
from palpate.mapping.primitives.shape import PrimitiveKind, PrimitiveShape
from palpate.mapping.primitives.solve import Shape, Solution, linearised, log_likelihood, solve
from palpate.mapping.primitives.sphere import SphereShape, sphere_starts
from palpate.mapping.primitives.torus import TorusShape, torus_starts

UNDETERMINED_SD = 1e6
"""A combination of unknowns with a standard deviation above so many of the best determined one's is not determined
by the points; rounding alone gives about 1e8."""


TIP_SIZE_SD = 5e-5
"""What all points may be off along their normals because the tip has another size [m]: a caliper reads a turned or
printed tip to 0.1 mm, which is two standard deviations."""


@dataclass(frozen=True, slots=True, eq=False)
class PrimitiveFit(Generic[Shape]):
    """A shape nearest to points and normals, in the frame of the points.

    The covariance takes errors as independent from point to point apart from `correlation_points`, with sizes
    estimated from the residuals, and allow for what no contact shows: a tip of another size, and a robot and an
    object that are not quite true (`SmoothErrors`).

    Attributes:
        shape: The shape; of NaN where the points show nothing to begin with, as no two faces of a box.
        covariance: Of (shift along the shape's axes [m], turn about them [rad], sizes [m]), shape (6 + s, 6 + s).
            Zero for motions that leave the surface as it is (a turned sphere, a plane shifted along itself),
            infinite variance for what the points leave open.
        position_sd: Error of a point along the normal, from the residuals [m].
        normal_sd: Error of a normal in each direction, from the residuals [rad].
        condition: Ratio of the worst to the best determined combination of unknowns, by standard deviation,
            lengths in units of the extent of the points.
        verdict: Whether it can be used.
        point_count: Number of points used.
        distance: Signed distance of each point from the surface, positive outside, shape (n,) [m].
        tilt: Measured less fitted normal of each point, in the frame of the points, shape (n, 3); reduced where
            the surface bends so sharply that the point says little about the normal.
        unknowns: How many numbers were fitted.
        log_likelihood: Of the data, less the same constant for every shape; with errors of unknown size.
    """

    shape: Shape
    covariance: FloatArray
    position_sd: float
    normal_sd: float
    condition: float
    verdict: Verdict
    point_count: int
    distance: FloatArray
    tilt: FloatArray
    unknowns: int
    log_likelihood: float

    @property
    def exists(self) -> bool:
        """Whether the points show such a shape at all: neither none to begin with, nor one at a limit."""
        return not (self.verdict.breaks(Assumption.ENOUGH_DATA) or self.verdict.breaks(Assumption.WITHIN_BOUNDS))

    @property
    def center_sd(self) -> FloatArray:
        """Standard deviation of the center along each axis of the frame of the points, shape (3,) [m]."""
        block, R = self.covariance[:3, :3], self.shape.rotation
        open_ended = ~np.isfinite(block.diagonal())
        finite = np.where(np.isfinite(block), block, 0.0)
        variance = (R @ finite @ R.T).diagonal().copy()
        variance[(np.abs(R[:, open_ended]) > 1e-9).any(axis=1)] = np.inf
        return np.sqrt(np.maximum(variance, 0.0))

    @property
    def turn_sd(self) -> FloatArray:
        """Standard deviation of a turn about each of the shape's axes, shape (3,) [rad]."""
        return np.sqrt(self.covariance.diagonal()[3:6])

    @property
    def sizes_sd(self) -> FloatArray:
        """Standard deviations of `shape.sizes` [m]."""
        return np.sqrt(self.covariance.diagonal()[6:])


_STARTS: Mapping[PrimitiveKind, tuple[type[PrimitiveShape], Callable[[FloatArray, FloatArray], list[Any]]]] = {
    PrimitiveKind.PLANE: (PlaneShape, plane_starts),
    PrimitiveKind.SPHERE: (SphereShape, sphere_starts),
    PrimitiveKind.CYLINDER: (CylinderShape, cylinder_starts),
    PrimitiveKind.ELLIPSOID: (EllipsoidShape, ellipsoid_starts),
    PrimitiveKind.BOX: (BoxShape, box_starts),
    PrimitiveKind.TORUS: (TorusShape, torus_starts),
}


def fit_primitive(
    cloud: TouchCloud,
    kind: PrimitiveKind,
    *,
    correlation_points: float = 1.0,
    offset_sd: float = TIP_SIZE_SD,
) -> PrimitiveFit[Any]:
    """Return the shape of one kind that is nearest to points and normals.

    The sum of squares of exact distances and of differences between normals, each over its error as estimated from
    the residuals, is least. The result moves with the points and scales with their unit. On a spherical cap of
    15 degrees normals make the radius four times as good; but where they all lean outwards by half a degree,
    points alone would be three times better.

    Args:
        cloud: What was felt; thin a dense one first (`TouchCloud.thinned`), a few hundred points do.
        kind: Which shape.
        correlation_points: Over how many neighbouring points errors are alike: n points then count as
            n / correlation_points independent ones (2 L / b for errors of correlation length L in stretches of
            length b). Rather too large than too small: for a raster, the points of a row, since speed and friction
            push a whole row in the same direction.
        offset_sd: By how much all points may be off along their normals at once [m], and 0.4 of it smoothly over
            place and time; 0 where tip and robot are exact.

    Raises:
        InvalidValueError: Fewer points than unknowns, all points in one place, `correlation_points` below 1, or
            `offset_sd` below 0.
    """
    if not (np.isfinite(correlation_points) and correlation_points >= 1.0):
        raise InvalidValueError(
            f"correlation_points = {correlation_points!r}: must be a finite number, 1 or above"
        )
    if not (np.isfinite(offset_sd) and offset_sd >= 0.0):
        raise InvalidValueError(f"offset_sd = {offset_sd!r} m: must be a finite length, 0 or above")
    form, starts = _STARTS[kind]
    if len(cloud) < form.MIN_POINTS:
        raise InvalidValueError(
            f"{len(cloud)} contacts cannot determine a {kind.value}: give {form.MIN_POINTS} or more"
        )
    origin = cloud.position.mean(axis=0)
    scale = float(np.sqrt(((cloud.position - origin) ** 2).sum(axis=1).mean()))
    if scale <= 16.0 * np.finfo(float).eps * float(np.abs(cloud.position).max()):
        raise InvalidValueError(
            f"the {len(cloud)} contacts are all in one place, at {origin.tolist()} m: touch elsewhere too"
        )
    points = (cloud.position - origin) / scale
    candidates = starts(points, cloud.normal)
    if not candidates:
        return _no_shape(form, cloud)
    found: Solution[Any] = solve(candidates, points, cloud.normal)
    if kind is PrimitiveKind.ELLIPSOID:
        found = _renamed(found, points, cloud.normal)
    smooth = SmoothErrors.of(points, cloud.normal, offset_sd / scale)
    free, condition, undetermined = _covariance(found, correlation_points, smooth)
    covariance = _in_sizes(found.shape, free, scale)
    shape = found.shape.placed(origin, scale, cloud.position)
    sizes_sd = np.sqrt(covariance.diagonal()[6:])
    broken = (
        *determination(found, shape, cloud.normal, sizes_sd, undetermined),
        *residual_checks(found, points, cloud.normal, correlation_points, smooth),
    )
    return PrimitiveFit(
        shape=shape,
        covariance=covariance,
        position_sd=scale * found.distance_sd,
        normal_sd=found.normal_sd,
        condition=condition,
        verdict=Verdict(broken),
        point_count=len(cloud),
        distance=scale * found.at.distance,
        tilt=found.trust[:, np.newaxis] * found.at.normal @ found.shape.rotation.T,
        unknowns=found.at.distance_slope.shape[1],
        log_likelihood=log_likelihood(found.distance_sd, found.normal_sd, found.trust),
    )


def _covariance(
    found: Solution[Any], correlation_points: float, smooth: SmoothErrors
) -> tuple[FloatArray, float, bool]:
    """Return the covariance of the free unknowns, its condition, and whether something is left open."""
    J = found.jacobian
    count = J.shape[1]
    _, singular, axes = np.linalg.svd(J, full_matrices=False)
    effective = 3.0 * len(found.trust) / correlation_points
    lost = singular < singular[0] / UNDETERMINED_SD
    condition = float(singular[0] / singular[-1]) if singular[-1] > 0.0 else float("inf")
    if effective <= count:
        return np.full((count, count), np.inf), condition, True
    spread = axes[~lost].T / singular[~lost]
    variance = correlation_points * effective / (effective - count)
    inverse = spread @ spread.T
    moved = smooth.moved(found, inverse)
    covariance = variance * inverse + moved @ moved.T
    open_ended = (np.abs(axes[lost]) > 1e-3).any(axis=0)
    covariance[open_ended, open_ended] = np.inf
    return covariance, condition, bool(lost.any())


def _in_sizes(shape: PrimitiveShape, free: FloatArray, scale: float) -> FloatArray:
    """Return the covariance of (shift, turn, sizes) in metres and radians from that of the free unknowns."""
    table = shape.sizes_by_free()
    open_free = ~np.isfinite(free.diagonal())
    covariance = table @ np.where(np.isfinite(free), free, 0.0) @ table.T
    open_ended: npt.NDArray[np.bool_] = np.any(np.abs(table[:, open_free]) > 0.0, axis=1)
    if isinstance(shape, BoxShape):  # with one end felt, neither middle nor length is known
        one_end = np.logical_not(shape.touched[:3] & shape.touched[3:])
        open_ended[:3] |= one_end
        open_ended[6:9] |= one_end
    lengths = np.array([scale] * 3 + [1.0] * 3 + [scale] * len(shape.SIZES))
    covariance = covariance * np.outer(lengths, lengths)
    covariance[open_ended, :] = 0.0
    covariance[:, open_ended] = 0.0
    covariance[open_ended, open_ended] = np.inf
    return np.asarray(covariance)


def _renamed(found: Solution[EllipsoidShape], points: FloatArray, normals: FloatArray) -> Solution[EllipsoidShape]:
    """The same ellipsoid, its axes in order of length."""
    shape = found.shape.sorted_axes()
    at = linearised(shape, points, normals)
    return Solution(shape, at, found.distance_sd, found.normal_sd, found.trust, found.converged)


def _no_shape(form: type[PrimitiveShape], cloud: TouchCloud) -> PrimitiveFit[Any]:
    """The result where there is no such shape to see."""
    if form is not BoxShape:
        raise AssertionError(f"{form.__name__} always has a start")
    nothing = BoxShape(cloud.position.mean(axis=0), np.eye(3), np.full(3, np.nan), np.nan, np.zeros(6, dtype=bool))
    return PrimitiveFit(
        shape=nothing,
        covariance=np.diag(np.full(10, np.inf)),
        position_sd=float("inf"),
        normal_sd=float("inf"),
        condition=float("inf"),
        verdict=Verdict(
            (BrokenAssumption(Assumption.ENOUGH_DATA, "no two faces were felt", "feel round an edge of it"),)
        ),
        point_count=len(cloud),
        distance=np.full(len(cloud), np.nan),
        tilt=np.full((len(cloud), 3), np.nan),
        unknowns=BoxShape.MIN_POINTS,
        log_likelihood=float("-inf"),
    )
