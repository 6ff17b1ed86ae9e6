"""What touches say about the unknowns: three equations each, with their noise.

With the sensor at R, p, a target at E, rounded by r, and y = R'(E - p):
    max over u of u.y - h(u) - r + delta(f_n) = 0                      the gap, measured by the arm
    m - c x f - q u = 0,   c = x(u) - share delta u                    the lever, measured by the sensor
The spin torque q is whatever it is, which leaves two of the second; divided by f_n they are lengths, by which the
contact lies elsewhere than on the line of the force.
"""

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray, InvalidValueError
from palpate.sensing.contact_jacobian import cross_matrices
from palpate.sensing.tip_calibration.contact import touching
from palpate.sensing.tip_calibration.instrument import Instrument
from palpate.sensing.tip_calibration.targets import TargetKind
from palpate.sensing.tip_calibration.touches import Touches
from palpate.sensing.tip_calibration.unknowns import Unknowns
from palpate.surfaces.near_sphere import HARMONICS


def deviation_basis(u: FloatArray, count: int) -> tuple[FloatArray, FloatArray]:
    """Return the first `count` fields of small deviations of a tip from its shape, and the places of each.

    The fields are harmonic polynomials of degrees 2 and 3 on the sphere of normals, in the tip's own axes, as of a
    `NearSphere`, added to the tip's support function. A tip whose support function is off by d(u) lies d(u)
    further out where its normal is u.

    Args:
        u: Unit normals in the tip's axes, shape (n, 3).
        count: Of `HARMONICS`.

    Returns:
        Values, shape (n, count), and gradients of their extensions of degree 1, shape (n, 3, count).
    """
    n = len(u)
    values, places = np.zeros((n, count)), np.zeros((n, 3, count))
    for i, terms in enumerate(HARMONICS[:count]):
        degree = sum(next(iter(terms)))
        for powers, factor in terms.items():
            values[:, i] += factor * np.prod(u ** np.array(powers), axis=1)
            for axis in range(3):
                if powers[axis]:
                    lower = np.array(powers)
                    lower[axis] -= 1
                    places[:, axis, i] += factor * powers[axis] * np.prod(u**lower, axis=1)
        places[:, :, i] += (1 - degree) * values[:, i, None] * u
    return values, places


NO_ERRORS = np.zeros(0)
FREEDOM = {TargetKind.POINT: 2, TargetKind.LINE: 1, TargetKind.PLANE: 0}


@dataclass(frozen=True, slots=True, eq=False)
class Solved:
    """n touches at some values of the unknowns.

    Attributes:
        normal: u, outward normal of the tip where it touches, sensor frame, shape (n, 3).
        gap: u.y - h(u) - r + delta [m], shape (n,).
        lever: Shape (n, 2) [m].
        basis: Directions of `lever`, as rows, shape (n, 2, 3).
        centroid: c, shape (n, 3) [m].
        normal_force: Shape (n,) [N].
        indentation: delta, shape (n,) [m].
    """

    normal: FloatArray
    gap: FloatArray
    lever: FloatArray
    basis: FloatArray
    centroid: FloatArray
    normal_force: FloatArray
    indentation: FloatArray

    @property
    def residuals(self) -> FloatArray:
        """Gap and lever, shape (n, 3) [m]."""
        return np.column_stack([self.gap, self.lever])


@dataclass(frozen=True, slots=True, eq=False)
class TouchEquations:
    """The equations of a set of touches.

    Args:
        unknowns: What is to be found.
        touches: What was felt.
        instrument: What measured it.

    Raises:
        InvalidValueError: A touch names no target, or does not push.
    """

    unknowns: Unknowns
    touches: Touches
    instrument: Instrument
    _start: FloatArray = field(init=False)
    _helper: FloatArray = field(init=False)
    _radius: FloatArray = field(init=False)
    _freedom: npt.NDArray[np.intp] = field(init=False)

    def __post_init__(self) -> None:
        touches, targets = self.touches, self.unknowns.targets
        if len(touches) and not (touches.target.min() >= 0 and touches.target.max() < len(targets)):
            raise InvalidValueError(f"target of a touch: must be from 0 to {len(targets) - 1}")
        object.__setattr__(self, "_radius", np.array([t.radius for t in targets])[touches.target])
        object.__setattr__(self, "_freedom", np.array([FREEDOM[t.kind] for t in targets])[touches.target])
        object.__setattr__(self, "_start", np.zeros((len(touches), 3)))
        object.__setattr__(self, "_helper", np.zeros((len(touches), 3)))
        solved = self._solved(self.unknowns.typed[None], None)
        helper = np.zeros_like(solved.normal)
        np.put_along_axis(helper, np.argmin(np.abs(solved.normal), axis=1)[:, None], 1.0, axis=1)
        object.__setattr__(self, "_start", solved.normal)
        object.__setattr__(self, "_helper", helper)
        if not (solved.normal_force > 0.0).all():
            worst = int(np.argmin(solved.normal_force))
            raise InvalidValueError(
                f"touch {worst}, of {targets[touches.target[worst]].name}: its force pulls "
                f"({solved.normal_force[worst]:.3g} N along the normal); wrenches are what the object exerts on "
                "the finger, in the sensor frame; is the target where it is said to be?"
            )

    def solved(self, values: FloatArray, errors: FloatArray = NO_ERRORS) -> Solved:
        """Return the touches at values of the unknowns, shape (P,).

        Args:
            values: Of the unknowns.
            errors: Of the sensor's matrix, shape (36,) by rows, in units of `accuracy` and of the ranges: by that
                much too large are its readings. None if empty.
        """
        return self._solved(values[None], self._start, errors)

    def _solved(
        self,
        values: FloatArray,
        start: FloatArray | None,
        errors: FloatArray = NO_ERRORS,
        shifts: FloatArray | None = None,
    ) -> Solved:
        """Return n touches at K sets of values, shape (K, P), one set after the other: K n touches.

        Args:
            values: Of the unknowns.
            start: Normals to start from, shape (n, 3); from the tip's center if not given.
            errors: See `solved`.
            shifts: By which the targets lie elsewhere in the sensor frame, shape (K, 3) [m].
        """
        unknowns, shape = self.unknowns, self.unknowns.tip.shape
        count, n = len(values), len(self.touches)
        at, freedom = (np.tile(each, count) for each in (self.touches.target, self._freedom))
        radius = np.tile(self._radius, count)
        one = np.repeat(np.arange(count), n)  # which set a row belongs to
        turned, moved = unknowns.mounted(values, self.touches.rotation, self.touches.position)
        rotation, position = turned.reshape(-1, 3, 3), moved.reshape(-1, 3)
        places = unknowns.places(values)
        place, direction = places.place[one, at], places.direction[one, at]
        y = np.einsum("nji,nj->ni", rotation, place - position)
        if shifts is not None:
            y = y + shifts[one]
        line = np.einsum("nji,nj->ni", rotation, direction)
        center, sizes, deviations = (unknowns.of(block, values)[one] for block in ("center", "size", "deviations"))
        axes = unknowns.rotation(values)[one]

        def support(u: FloatArray, rows: npt.NDArray[np.intp]) -> tuple[FloatArray, FloatArray]:
            own = np.einsum("nji,nj->ni", axes[rows], u)
            h, x = shape.support(sizes[rows], own)
            if deviations.shape[1]:
                further, moved = deviation_basis(own, deviations.shape[1])
                h = h + np.einsum("nk,nk->n", further, deviations[rows])
                x = x + np.einsum("nik,nk->ni", moved, deviations[rows])
            center_of = center[rows]
            place = np.einsum("nij,nj->ni", axes[rows], x) + center_of
            return h + np.einsum("ni,ni->n", u, center_of), place

        first = y - center if start is None else np.tile(start, (count, 1))
        first[freedom == 0] = -line[freedom == 0]
        along = np.zeros_like(line)
        along[freedom == 1] = line[freedom == 1]
        first -= np.einsum("ni,ni->n", first, along)[:, None] * along
        first /= np.linalg.norm(first, axis=1, keepdims=True)
        u, gap, x = touching(support, y, first, freedom, line)

        stiffness, exponent = (each[one] for each in unknowns.skin(values))
        right = self.touches.wrench
        if len(errors):
            right = right - (self._relative @ errors.reshape(6, 6).T) * self.instrument.ranges
        wrench = np.tile(right, (count, 1))
        force, moment = wrench[:, :3], wrench[:, 3:]
        normal_force = -np.einsum("ni,ni->n", u, force)
        indentation = (np.maximum(normal_force, 0.0) / stiffness) ** exponent
        centroid = x - unknowns.tip.share * indentation[:, None] * u
        first = np.cross(u, np.tile(self._helper, (count, 1)))
        length = np.linalg.norm(first, axis=1, keepdims=True)
        first = first / np.where(length > 0.0, length, 1.0)
        basis = np.stack([first, np.cross(u, first)], axis=1)
        missing = moment - np.cross(centroid, force)
        lever = np.einsum("nki,ni->nk", basis, np.cross(u, missing)) / _positive(normal_force)[:, None]
        return Solved(u, gap - radius + indentation, lever, basis, centroid, normal_force, indentation)

    def jacobian(self, values: FloatArray, errors: FloatArray = NO_ERRORS) -> FloatArray:
        """Return the derivatives of `Solved.residuals` by the unknowns in units of their deviations, (n, 3, P)."""
        steps = STEP * np.diag(self.unknowns.sd)
        both = self._solved(values + np.concatenate([steps, -steps]), self._start, errors).residuals
        ahead, behind = both.reshape(2, len(values), len(self.touches), 3)
        return np.asarray((ahead - behind).transpose(1, 2, 0) / (2.0 * STEP))

    def by_place(self, values: FloatArray, errors: FloatArray = NO_ERRORS) -> FloatArray:
        """Return the derivatives by where the targets lie in the sensor frame, shape (n, 3, 3)."""
        steps = PLACE_STEP * np.eye(3)
        sets = np.tile(values, (6, 1))
        both = self._solved(sets, self._start, errors, np.concatenate([steps, -steps])).residuals
        ahead, behind = both.reshape(2, 3, len(self.touches), 3)
        return np.asarray((ahead - behind).transpose(1, 2, 0) / (2.0 * PLACE_STEP))

    def noise(self, solved: Solved, by_place: FloatArray, scatter: float) -> FloatArray:
        """Return the covariance of each touch's three residuals, shape (n, 3, 3) [m^2].

        Args:
            solved: The touches.
            by_place: See `by_place`.
            scatter: Standard deviation of the sensor's place, each axis [m]: of the arm, and of what no model has.
        """
        variance = self.touches.wrench_sd**2
        softness = self._softness(solved)
        found = scatter**2 * by_place @ by_place.transpose(0, 2, 1)
        found[:, 0, 0] += softness**2 * (solved.normal**2 * variance[:, :3]).sum(axis=1)
        by_missing, by_force = self._lever_by_wrench(solved)
        found[:, 1:, 1:] += (by_missing * variance[:, None, 3:]) @ by_missing.transpose(0, 2, 1)
        found[:, 1:, 1:] += (by_force * variance[:, None, :3]) @ by_force.transpose(0, 2, 1)
        return found

    def shared(self, solved: Solved) -> FloatArray:
        """Return what errors of the sensor's matrix, which all touches share, do to them.

        Returns:
            Derivatives of the residuals by the errors of `solved`, shape (n, 3, 36) [m]; (n, 3, 0) if its matrix
            is exact.
        """
        n = len(self.touches)
        if not self.instrument.accuracy > 0.0:
            return np.zeros((n, 3, 0))
        by_missing, by_force = self._lever_by_wrench(solved)
        by_wrench = np.zeros((n, 3, 6))
        by_wrench[:, 1:, :3], by_wrench[:, 1:, 3:] = by_force, by_missing
        by_wrench[:, 0, :3] = -self._softness(solved)[:, None] * solved.normal
        less = -by_wrench * self.instrument.ranges
        return np.asarray(np.einsum("nki,nj->nkij", less, self._relative).reshape(n, 3, 36))

    @property
    def _relative(self) -> FloatArray:
        """Wrenches in units of the ranges, times the accuracy, shape (n, 6)."""
        return self.instrument.accuracy * self.touches.wrench / self.instrument.ranges

    def by_softness(self, solved: Solved) -> FloatArray:
        """Return the derivatives by the logarithm of the stiffness, shape (n, 3) [m]."""
        less = self.unknowns.tip.exponent * solved.indentation
        moved = self.unknowns.tip.share * less[:, None] * solved.normal
        return np.column_stack([-less, self._lever_by_place(solved, moved)])

    def by_share(self, solved: Solved) -> FloatArray:
        """Return the derivatives by the tip's share of the indentation, shape (n, 3) [m]."""
        deeper = -solved.indentation[:, None] * solved.normal
        return np.column_stack([np.zeros(len(deeper)), self._lever_by_place(solved, deeper)])

    def by_deviations(self, values: FloatArray, solved: Solved, count: int) -> FloatArray:
        """Return the derivatives by deviations of the shape, shape (n, 3, count); see `deviation_basis`."""
        axes = self.unknowns.rotation(values)
        further, moved = deviation_basis(solved.normal @ axes, count)
        levers = [self._lever_by_place(solved, moved[:, :, i] @ axes.T) for i in range(count)]
        return np.concatenate([-further[:, None, :], np.stack(levers, axis=2)], axis=1)

    def _lever_by_place(self, solved: Solved, moved: FloatArray) -> FloatArray:
        """Change of the levers where contacts lie elsewhere by `moved` (n, 3), shape (n, 2)."""
        missing = -np.cross(moved, self.touches.wrench[:, :3])
        lever = np.einsum("nki,ni->nk", solved.basis, np.cross(solved.normal, missing))
        return np.asarray(lever / _positive(solved.normal_force)[:, None])

    def _softness(self, solved: Solved) -> FloatArray:
        """How much deeper the skin gives way per force, shape (n,) [m/N]."""
        return self.unknowns.tip.exponent * solved.indentation / _positive(solved.normal_force)

    def _lever_by_wrench(self, solved: Solved) -> tuple[FloatArray, FloatArray]:
        """Derivatives of the lever by moment and force, shape (n, 2, 3)."""
        across_normal = (
            solved.basis @ cross_matrices(solved.normal) / _positive(solved.normal_force)[:, None, None]
        )
        return across_normal, -across_normal @ cross_matrices(solved.centroid)


PLACE_STEP = 1e-7
"""[m], for central differences over a tip of millimetres."""

STEP = 1e-4
"""Of an unknown's deviation, for central differences: 1e-8 of a residual, that is rounding and curvature alike."""


def _positive(force: FloatArray) -> FloatArray:
    """Keep what does not push from dividing by zero: such touches are refused, or far from the solution."""
    return np.maximum(force, 1e-6)
