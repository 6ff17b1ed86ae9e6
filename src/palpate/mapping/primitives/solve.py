"""Weighted least squares of distance and normal at once: Levenberg-Marquardt with weights from the residuals."""

from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
import numpy.typing as npt

from palpate.compiling import njit
from palpate.errors import FloatArray
from palpate.mapping.primitives.shape import PrimitiveShape, turned

FIRST_RATIO = 0.05
"""Error of a distance over error of a normal, to begin with [m/rad], in units of the root mean square distance of
the points from their middle: 0.03 mm and 0.5 degrees (3.4 mm) on an object of some 10 cm."""

FIRST_NORMAL_SD = 0.1
"""Error of a normal to begin with, where a sharp edge caps it [rad]: of a shape not yet fitted."""

SMALLEST_RATIO, LARGEST_RATIO = 1e-3, 10.0
"""Limits of that ratio as estimated, in the same units: either kind of data keeps a say."""

FINEST = 1e-6
"""Errors smaller than this, in the same units and in rad, are taken for this: 20 nm on an object of 5 cm. Exact
data would otherwise be judged by their rounding."""

WEIGHINGS = 4
"""Estimates of the two errors, each followed by a solution; they settle after two or three."""

SETTLED = 0.02
"""Relative change of the ratio of errors at which it has settled: a tenth of what 200 points know of it."""

FIRST_STEPS, STEPS = 12, 40
"""Steps at most from each start, and after each weighing."""

CONVERGED = 1e-9
"""Relative decrease of the sum of squares at which steps stop: a step then moves the shape by some 1e-4 of its
standard deviation."""

Shape = TypeVar("Shape", bound=PrimitiveShape)


@dataclass(frozen=True, slots=True, eq=False)
class Linearised:
    """Residuals at a shape, and their change with it.

    Attributes:
        distance: Shape (n,) [scaled m].
        normal: Measured less the shape's normal, in the shape's axes, shape (n, 3).
        distance_slope: Shape (n, k).
        normal_slope: Shape (n, 3, k).
        curvature: Size of the Hessian of the distance at each point, shape (n,).
    """

    distance: FloatArray
    normal: FloatArray
    distance_slope: FloatArray
    normal_slope: FloatArray
    curvature: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Solution(Generic[Shape]):
    """Where the iteration ended.

    Attributes:
        shape: In scaled units.
        at: The residuals there.
        distance_sd: Root mean square error of a distance, at least `FINEST`.
        normal_sd: Root mean square error of a normal in each of its two directions [rad], at least `FINEST`.
        trust: Weight of each normal below 1 where the surface bends sharply, shape (n,).
        converged: Whether steps stopped by themselves.
    """

    shape: Shape
    at: Linearised
    distance_sd: float
    normal_sd: float
    trust: FloatArray
    converged: bool

    @property
    def jacobian(self) -> FloatArray:
        """Residuals over their errors by unknowns, shape (4 n, k)."""
        weights = _weights(self.distance_sd, self.normal_sd, self.trust)
        return _stacked(self.at.distance_slope, self.at.normal_slope, weights)

    @property
    def residual(self) -> FloatArray:
        """Residuals over their errors, as rows of `jacobian`, shape (4 n,)."""
        weights = _weights(self.distance_sd, self.normal_sd, self.trust)
        return _stacked(self.at.distance[:, np.newaxis], self.at.normal[:, :, np.newaxis], weights)[:, 0]


def solve(starts: list[Shape], points: FloatArray, normals: FloatArray) -> Solution[Shape]:
    """Return the shape nearest to `points` and `normals`, both (n, 3), scaled to unit size.

    The errors of distances and normals are not known: each is estimated from the residuals (maximum likelihood of
    two scales). Where the surface bends with curvature k, an error s of the point turns the normal by k s, which
    adds to the normal's own error: at a sharp edge a normal says nothing.
    """
    best: tuple[float, Shape, Linearised, FloatArray, bool] | None = None
    for start in starts:
        at = linearised(start, points, normals)
        trust = _trust(at, FIRST_RATIO, FIRST_NORMAL_SD)
        _, shape, at, converged = _descend(
            start, at, points, normals, _weights(FIRST_RATIO, 1.0, trust), FIRST_STEPS
        )
        likelihood = log_likelihood(*_errors(at, trust), trust)
        if best is None or likelihood > best[0]:
            best = (likelihood, shape, at, trust, converged)
    assert best is not None  # callers give at least one start
    _, shape, at, trust, converged = best
    ratio = FIRST_RATIO
    for _ in range(WEIGHINGS):
        distance_sd, normal_sd = _errors(at, trust)
        trust = _trust(at, distance_sd / normal_sd, normal_sd)
        distance_sd, normal_sd = _errors(at, trust)
        _, shape, at, converged = _descend(
            shape, at, points, normals, _weights(distance_sd, normal_sd, trust), STEPS
        )
        if abs(distance_sd / normal_sd - ratio) < SETTLED * ratio:
            break
        ratio = distance_sd / normal_sd
    distance_sd, normal_sd = _errors(at, trust)
    return Solution(shape, at, distance_sd, normal_sd, trust, converged)


def linearised(shape: PrimitiveShape, points: FloatArray, normals: FloatArray) -> Linearised:
    """Return residuals of a shape, and how they change with its pose and sizes.

    In the shape's axes u = R'(p - c). A shift by v and a turn by w change u by u x w - v, and the normal, seen
    from outside, by w x m more.
    """
    u, measured = (points - shape.center) @ shape.rotation, normals @ shape.rotation
    local = shape.local_geometry(u, measured)
    by_motion, turned_by_motion = _by_motion(u, local.normal, local.bend, np.array(shape.MOTIONS))
    return Linearised(
        distance=local.distance,
        normal=measured - local.normal,
        distance_slope=np.concatenate([by_motion, local.distance_by_size], axis=1),
        normal_slope=-np.concatenate([turned_by_motion, local.normal_by_size], axis=2),
        curvature=np.sqrt((local.bend**2).sum(axis=(1, 2))),
    )


def log_likelihood(distance_sd: float, normal_sd: float, trust: FloatArray) -> float:
    """Return that of Gaussian residuals with these errors at their most likely size, but for a constant.

    `trust` (n,) below 1 says where a bend widens the error of a normal.
    """
    spread = np.log(distance_sd) + 2.0 * np.log(normal_sd)
    return float(2.0 * np.log(trust).sum() - len(trust) * spread)


def moved(shape: Shape, step: FloatArray) -> Shape:
    """Return `shape` after a step in its motions and free sizes."""
    motion = np.zeros(6)
    count = len(shape.MOTIONS)
    motion[list(shape.MOTIONS)] = step[:count]
    center = shape.center + shape.rotation @ motion[:3]
    return shape.resized(step[count:], center, turned(shape.rotation, motion[3:]))


def _descend(
    shape: Shape, at: Linearised, points: FloatArray, normals: FloatArray, weights: FloatArray, steps: int
) -> tuple[float, Shape, Linearised, bool]:
    """Levenberg-Marquardt with fixed weights; returns sum of squares, shape, residuals, whether it converged."""
    cost, damping = _cost(at, weights), 1e-4
    for _ in range(steps):
        J = _stacked(at.distance_slope, at.normal_slope, weights)
        r = _stacked(at.distance[:, np.newaxis], at.normal[:, :, np.newaxis], weights)[:, 0]
        A, b = J.T @ J, J.T @ r
        scale = np.maximum(A.diagonal(), 1e-12 * max(float(A.diagonal().max()), 1e-300))
        while True:
            step = np.asarray(-np.linalg.solve(A + damping * np.diag(scale), b), dtype=np.float64)
            trial = moved(shape, step)
            there = linearised(trial, points, normals)
            reduced = _cost(there, weights)
            if reduced < cost:
                break
            damping *= 8.0
            if damping > 1e8 or cost == 0.0:
                return cost, shape, at, True  # no step is short enough: the bottom, to rounding
        decrease = (cost - reduced) / cost
        cost, shape, at, damping = reduced, trial, there, max(damping / 8.0, 1e-10)
        if decrease < CONVERGED:
            return cost, shape, at, True
    return cost, shape, at, False


def _cost(at: Linearised, weights: FloatArray) -> float:
    return float((weights[:, 0] * at.distance) @ (weights[:, 0] * at.distance)) + float(
        weights[:, 1] ** 2 @ (at.normal**2).sum(axis=1)
    )


def _weights(distance_sd: float, normal_sd: float, trust: FloatArray) -> FloatArray:
    """Weights of distance and normal of each point, shape (n, 2)."""
    return np.column_stack([np.full(len(trust), 1.0 / distance_sd), trust / normal_sd])


def _stacked(distance: FloatArray, normal: FloatArray, weights: FloatArray) -> FloatArray:
    """Distances (n, k) and normals (n, 3, k), weighed, as rows (4 n, k)."""
    rows = np.concatenate([distance[:, np.newaxis, :], normal], axis=1)
    rows[:, 0] *= weights[:, :1]
    rows[:, 1:] *= weights[:, 1:, np.newaxis]
    return rows.reshape(-1, rows.shape[2])


def _errors(at: Linearised, trust: FloatArray) -> tuple[float, float]:
    """Return root mean square residuals of distances and (per direction) of normals, their ratio limited."""
    distance = max(float(np.sqrt((at.distance**2).mean())), FINEST)
    normal = max(float(np.sqrt(0.5 * (trust**2 * (at.normal**2).sum(axis=1)).mean())), FINEST)
    if distance < SMALLEST_RATIO * normal:
        distance = SMALLEST_RATIO * normal
    return distance, max(normal, distance / LARGEST_RATIO)


def _trust(at: Linearised, ratio: float, normal_sd: float) -> FloatArray:
    """Error of a normal on a plane over that where the surface bends; at worst the normal is off by a radian."""
    turn = np.minimum(at.curvature * ratio, 1.0 / normal_sd)
    return np.asarray(1.0 / np.sqrt(1.0 + turn**2))


@njit(cache=True)
def _by_motion(
    points: FloatArray, normals: FloatArray, bends: FloatArray, motions: npt.NDArray[np.intp]
) -> tuple[FloatArray, FloatArray]:
    """Return how distances (n, k) and normals (n, 3, k) change with shifts and turns of a shape."""
    n, k = len(points), len(motions)
    distance, normal = np.empty((n, k)), np.empty((n, 3, k))
    moved, spun = np.zeros((6, 3)), np.zeros((6, 3))
    for i in range(3):
        moved[i, i] = -1.0
    for at in range(n):
        for i in range(3):  # columns of u x w and w x m by w
            a, b = (i + 1) % 3, (i + 2) % 3
            moved[3 + i, a], moved[3 + i, b] = points[at, b], -points[at, a]
            spun[3 + i, a], spun[3 + i, b] = -normals[at, b], normals[at, a]
        for j in range(k):
            by, spin = moved[motions[j]], spun[motions[j]]
            distance[at, j] = normals[at, 0] * by[0] + normals[at, 1] * by[1] + normals[at, 2] * by[2]
            for i in range(3):
                bend = bends[at, i]
                normal[at, i, j] = bend[0] * by[0] + bend[1] * by[1] + bend[2] * by[2] + spin[i]
    return distance, normal
