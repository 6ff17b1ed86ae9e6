"""Whether a fitted shape can be used: what determines it, and whether its residuals are noise."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc, ndtri

from palpate.errors import FloatArray
from palpate.estimation import (
    Assumption,
    BrokenAssumption,
    white_in_direction,
    white_in_place,
    white_in_time,
)
from palpate.mapping.primitives.box import BoxShape
from palpate.mapping.primitives.shape import PrimitiveShape
from palpate.mapping.primitives.solve import FINEST, Shape, Solution

WEAK_RELATIVE_SD = 0.1
"""Above this standard deviation of a size, relative to it, the points say little about it."""

CHANCE = 1e-3
"""Probability under noise alone below which a test counts as failed: six tests refuse about 1 fit in 200."""

MOST_LEVERAGE = 0.5
"""Of one contact on its own residual, from which on the fit follows it (Huber, "Robust Statistics", 1981)."""

THIN = 0.1
"""Of the points' size: what they extend by less along an axis is no place."""

SMOOTH_SHARE = 0.4
"""Of the standard deviation of the tip's size: 0.02 mm for each way in which robot and object are not true."""

APART = 3.0
"""Contacts share their errors over so many correlation lengths; tests take means over these."""

FEWEST = 10
"""Such means for tests of whiteness."""

SHIFTED = 3.1
"""Of a standard deviation that smooth errors may move an unknown: chance alone does that to 1 fit in 100."""

LEANING_DEVIATIONS = 4.5
"""Of the error of normals, by which one of them must lean to show a face: the most of 200 by chance are 3.5."""

MEDIAN_ERROR = 1.17
"""Relative standard deviation of a scale from a median of n absolute values, times the root of n."""

FEEL_MORE = "feel more of the object, where it curves"


def determination(
    found: Solution[Shape], shape: PrimitiveShape, normals: FloatArray, sizes_sd: FloatArray, lost: bool
) -> Iterator[BrokenAssumption]:
    """Return what keeps the points from determining the shape.

    Args:
        found: In scaled units.
        shape: The same in metres.
        normals: Measured, shape (n, 3).
        sizes_sd: Of its sizes [m].
        lost: Whether some combination of unknowns does not matter to the points.
    """
    if not found.converged:
        yield BrokenAssumption(Assumption.CONVERGED, "the fit still moved when its steps ran out", FEEL_MORE)
    sd, sizes = sizes_sd, shape.sizes
    if isinstance(shape, BoxShape):
        # a rounding of next to nothing is known well enough, and a length with one end felt is reported as open
        yield from _chance_faces(shape, normals, found.normal_sd)
        sd, sizes = sd[:3], np.where(np.isfinite(sd[:3]) | found.shape.at_limit, sizes[:3], np.inf)
    elif found.shape.at_limit or (len(sizes) > 0 and np.isinf(sizes_sd).all()):
        # a torus with no radius that the points show is one by name alone: they may as well lie on a cone
        longest = ", ".join(f"{1e3 * size:.3g} mm" for size in sizes)
        yield BrokenAssumption(
            Assumption.WITHIN_BOUNDS,
            f"sizes of {longest} are at a limit: the points show a simpler shape, or a cone",
            "take the simpler shape, or " + FEEL_MORE,
        )
    weak = sd > WEAK_RELATIVE_SD * sizes
    if lost or weak.any():
        names = [f"{name} ± {1e3 * s:.2g} mm" for name, s, off in zip(shape.SIZES, sd, weak, strict=False) if off]
        most = f", at most {100.0 * WEAK_RELATIVE_SD:g} % of each" if names else ""
        yield BrokenAssumption(
            Assumption.CONDITIONED, (", ".join(names) or "a turn or shift does not matter") + most, FEEL_MORE
        )


def _chance_faces(shape: BoxShape, normals: FloatArray, normal_sd: float) -> Iterator[BrokenAssumption]:
    """Faces that only normals within their noise lean towards."""
    facing = normals @ shape.rotation
    most = np.concatenate([-facing.min(axis=0), facing.max(axis=0)])
    doubtful = shape.touched & (most < LEANING_DEVIATIONS * normal_sd)
    if doubtful.any():
        yield BrokenAssumption(
            Assumption.CONDITIONED,
            f"{np.count_nonzero(doubtful)} of its faces show only by normals that lean towards them, by at most "
            f"{math.degrees(math.asin(min(float(most[doubtful].max()), 1.0))):.2g} degrees, where their error is "
            f"{math.degrees(normal_sd):.2g}",
            FEEL_MORE,
        )


def residual_checks(
    found: Solution[Shape],
    points: FloatArray,
    normals: FloatArray,
    correlation_points: float,
    smooth: "SmoothErrors",
) -> Iterator[BrokenAssumption]:
    """Return what makes the residuals look like something else than noise.

    Args:
        found: In scaled units.
        points: In the order they were felt, shape (n, 3), in the same units.
        normals: Measured, shape (n, 3).
        correlation_points: Over how many points errors are alike.
        smooth: Errors that are no noise, as far as they are allowed for.
    """
    tilt = found.trust[:, np.newaxis] * found.at.normal @ found.shape.rotation.T
    tilt = tilt @ np.linalg.eigh(points.T @ points)[1]  # along axes that turn with the points
    columns = [column for column in (found.at.distance, *tilt.T) if math.sqrt(np.mean(column**2)) > FINEST]
    if not columns:
        return
    yield from _far_off(found.at.distance, tilt)
    # few contacts lie on the edges of a box, and little hangs on its rounding
    followed = _column_space(found.jacobian)
    yield from _influence(_column_space(found.jacobian[:, :-1]) if isinstance(found.shape, BoxShape) else followed)
    yield from _disagreement(found, correlation_points, smooth)
    yield from smooth.check(found, followed, correlation_points)
    length = math.ceil(APART * correlation_points) if correlation_points > 1.0 else 1
    count = len(points) // length
    if count < FEWEST:
        return
    if smooth.sd.any():
        left = smooth.left(found, followed, correlation_points)
        columns = [left[:, 0], *(left[:, 1:] @ found.shape.rotation.T @ np.linalg.eigh(points.T @ points)[1]).T]
    places, residuals = _means(points, length), _means(np.column_stack(columns), length)
    facing = _means(normals @ found.shape.rotation - found.at.normal, length)
    facing /= np.maximum(np.linalg.norm(facing, axis=1, keepdims=True), FINEST)
    tests = {
        Assumption.WHITE_IN_TIME: [white_in_time(residuals)],
        Assumption.WHITE_IN_PLACE: [white_in_place(places, each) for each in residuals.T],
        Assumption.WHITE_IN_DIRECTION: [white_in_direction(facing, each) for each in residuals.T],
    }
    remedies = {
        Assumption.WHITE_IN_TIME: "look for a drift, or give correlation_points",
        Assumption.WHITE_IN_PLACE: "the object has another shape, or texture",
        Assumption.WHITE_IN_DIRECTION: "check the tip's size, the sensor's calibration, or take another shape",
    }
    for assumption, chances in tests.items():
        chance = min(chances) * len(chances)
        if chance < CHANCE:
            found_that = f"chance alone does so in {100.0 * chance:.2g} % of fits, at least {100.0 * CHANCE:g} %"
            yield BrokenAssumption(assumption, found_that, remedies[assumption])


@dataclass(frozen=True, slots=True, eq=False)
class SmoothErrors:
    """What may move points along their normals without looking like noise, as k functions of unit size.

    First the same for all (a tip of another size), then what changes with place as a quadric does (a robot or an
    object that is not quite true), then drifts of the robot along three axes as polynomials of their order.

    Attributes:
        functions: Shape (n, k).
        sd: Of their factors, shape (k,) [m, or scaled].
    """

    functions: FloatArray
    sd: FloatArray

    @classmethod
    def of(cls, points: FloatArray, normals: FloatArray, offset_sd: float) -> "SmoothErrors":
        """Return those of points about their middle in units of their size, in the order they were felt."""
        x, y, z = points.T
        place = np.column_stack([x, y, z, x * x, y * y, z * z, x * y, y * z, z * x])
        place -= place.mean(axis=0)
        place /= np.maximum(np.sqrt((place**2).mean(axis=0)), THIN)
        order = np.linspace(-1.0, 1.0, len(points))
        drifts = [math.sqrt(2 * k + 1) * np.polynomial.Legendre.basis(k)(order) for k in (1, 2, 3)]
        drift = np.column_stack([each[:, np.newaxis] * normals for each in drifts])
        sd = offset_sd * np.repeat([1.0, SMOOTH_SHARE, SMOOTH_SHARE], [1, place.shape[1], drift.shape[1]])
        return cls(np.column_stack([np.ones(len(points)), place, drift]), sd)

    def moved(self, found: Solution[Shape], inverse: FloatArray) -> FloatArray:
        """Return by how much each moves the unknowns, shape (unknowns, k); `inverse` is that of J'J."""
        J = found.jacobian.reshape(len(found.trust), 4, -1)[:, 0]
        return np.asarray(inverse @ (J.T @ self.on_points(found)))

    def on_points(self, found: Solution[Shape]) -> FloatArray:
        """Return by how much each moves points along their normals, over their error, shape (n, k)."""
        return self.functions * self.sd / found.distance_sd

    def on_residuals(self, found: Solution[Shape]) -> FloatArray:
        """Return what each makes of residuals over their errors, shape (4 n, k)."""
        rows = np.zeros((len(found.trust), 4, len(self.sd)))
        rows[:, 0] = self.on_points(found)
        return rows.reshape(-1, len(self.sd))

    def left(self, found: Solution[Shape], followed: FloatArray, correlation_points: float) -> FloatArray:
        """Return residuals without what these most likely make of them, over their errors, shape (n, 4).

        `followed` is what the unknowns can follow, orthonormal columns.
        """
        made = self.on_residuals(found)
        made -= followed @ (followed.T @ made)
        residual, noise = found.residual, correlation_points * np.eye(len(self.sd))
        factors = np.linalg.solve(made.T @ made + noise, made.T @ residual)
        return np.asarray(residual - made @ factors).reshape(-1, 4)

    def shift(self, found: Solution[Shape], followed: FloatArray, correlation_points: float) -> FloatArray:
        """Return how far what these most likely are moves each unknown, over what chance alone does to that."""
        made = self.on_residuals(found)
        moved = np.linalg.lstsq(found.jacobian, made, rcond=1e-9)[0]
        made -= followed @ (followed.T @ made)
        G = made.T @ made
        inverse = np.linalg.inv(G + correlation_points * np.eye(len(G)))
        to_unknowns = moved @ inverse
        shift = to_unknowns @ (made.T @ found.residual)
        square = np.einsum("ij,jk,ik->i", to_unknowns, G @ G + correlation_points * G, to_unknowns)
        return np.asarray(np.abs(shift) / np.sqrt(np.maximum(square, FINEST**2)))

    def check(
        self, found: Solution[Shape], followed: FloatArray, correlation_points: float
    ) -> Iterator[BrokenAssumption]:
        """A score test: whether residuals follow these by more than noise and what is allowed for."""
        U = followed.reshape(len(found.trust), 4, -1)[:, 0]
        F = self.functions / found.distance_sd
        A = F.T @ F - (F.T @ U) @ (U.T @ F)  # of what the unknowns cannot follow
        values, axes = np.linalg.eigh(correlation_points * A + (A * self.sd**2) @ A)
        pulled = axes.T @ (F.T @ (found.at.distance / found.distance_sd))
        shown = values > 1e-6 * values.max()
        square = float((pulled[shown] ** 2 / values[shown]).sum())
        if chdtrc(int(shown.sum()), square) < CHANCE:
            yield BrokenAssumption(
                Assumption.WHITE_IN_TIME,
                f"points are off smoothly over place or time, chi^2 {square:.0f} of {int(shown.sum())}",
                "look for a drift, or take another shape",
            )
            return
        shift = self.shift(found, followed, correlation_points)
        if shift.max() > SHIFTED:
            yield BrokenAssumption(
                Assumption.WHITE_IN_TIME,
                f"what points are off by smoothly moves the shape {shift.max():.2g} times as far as it should, at "
                f"most {SHIFTED:g}",
                "look for a drift, or take another shape",
            )


def _far_off(distance: FloatArray, tilt: FloatArray) -> Iterator[BrokenAssumption]:
    """Contacts off by more than the largest of n would be, at a scale from medians."""
    n = len(distance)
    loose = 1.0 + 3.0 * MEDIAN_ERROR / math.sqrt(n)
    limits = (-float(ndtri(0.25 * CHANCE / n)), math.sqrt(-2.0 * math.log(0.5 * CHANCE / n)))
    medians = (float(ndtri(0.75)), math.sqrt(2.0 * math.log(2.0)))
    for what, size, limit, median in zip(
        ("point", "normal"), (np.abs(distance), np.linalg.norm(tilt, axis=1)), limits, medians, strict=True
    ):
        sd = max(float(np.median(size)) / median, FINEST)
        far = size > loose * limit * sd
        if far.any():
            yield BrokenAssumption(
                Assumption.NO_OUTLIERS,
                f"{what}s of {np.count_nonzero(far)} of {n} contacts are off by up to {size.max() / sd:.3g} "
                f"standard deviations, at most {loose * limit:.2g}; the worst is number {int(size.argmax())}",
                "leave these out, or look at what is there",
            )


def _column_space(jacobian: FloatArray) -> FloatArray:
    """Return what unknowns can follow, as orthonormal columns."""
    U, singular, _ = np.linalg.svd(jacobian, full_matrices=False)
    return np.asarray(U[:, singular > 1e-9 * singular[0]])


def _influence(followed: FloatArray) -> Iterator[BrokenAssumption]:
    leverage = (followed**2).sum(axis=1)
    if leverage.max() > MOST_LEVERAGE:
        yield BrokenAssumption(
            Assumption.EVEN_INFLUENCE,
            f"contact {int(leverage.argmax()) // 4} decides {100.0 * leverage.max():.0f} % of its own residual, "
            f"at most {100.0 * MOST_LEVERAGE:.0f} %",
            "feel more contacts near it",
        )


def _disagreement(
    found: Solution[Shape], correlation_points: float, smooth: SmoothErrors
) -> Iterator[BrokenAssumption]:
    """A score test: at the fit, what points pull at the unknowns, normals pull back; more than noise would?

    The gradient g of the points' part has covariance A_p (A_p + A_n)^-1 A_n, for information A of points and
    normals.
    """
    rows = found.jacobian.reshape(len(found.trust), 4, -1)
    of_points = rows[:, 0]
    P, N = of_points.T @ of_points, np.einsum("nij,nik->jk", rows[:, 1:], rows[:, 1:])
    g = of_points.T @ (found.at.distance / found.distance_sd)
    scale = 1.0 / np.sqrt(np.maximum((P + N).diagonal(), FINEST))
    P, N, g = P * np.outer(scale, scale), N * np.outer(scale, scale), g * scale
    inverse = np.linalg.pinv(P + N, rcond=1e-9, hermitian=True)
    allowed = scale[:, np.newaxis] * (of_points.T @ smooth.on_points(found))
    allowed -= P @ inverse @ allowed
    values, axes = np.linalg.eigh(correlation_points * P @ inverse @ N + allowed @ allowed.T)
    shared = values > 1e-6
    if not shared.any():
        return
    square = float(((axes[:, shared].T @ g) ** 2 / values[shared]).sum())
    if chdtrc(int(shared.sum()), square) < CHANCE:
        yield BrokenAssumption(
            Assumption.CONSISTENT,
            f"points and normals ask for shapes {math.sqrt(square):.3g} standard deviations apart",
            "look for a drift, for leaning normals, or take another shape",
        )


def _means(rows: FloatArray, length: int) -> FloatArray:
    count = len(rows) // length
    return np.asarray(rows[: count * length].reshape(count, length, -1).mean(axis=1))
