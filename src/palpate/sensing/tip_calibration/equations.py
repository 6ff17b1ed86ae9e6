"""What touches say about the unknowns: three equations each, with their noise.

With the sensor at R, p, a target at E, rounded by r, and y = R'(E - p):
    max over u of u.y - h(u) - r + delta(f_n) = 0                      the gap, measured by the arm
    m - c x f - q u = 0,   c = x(u) - share delta u                    the lever, measured by the sensor
The spin torque q is whatever it is, which leaves two of the second; divided by f_n they are lengths, by which the
contact lies elsewhere than on the line of the force.
"""

from dataclasses import dataclass, field

import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.sensing.contact_jacobian import cross_matrices
from palpate.sensing.tip_calibration.contact import touching
from palpate.sensing.tip_calibration.deviations import deviation_basis
from palpate.sensing.tip_calibration.targets import TargetKind
from palpate.sensing.tip_calibration.touches import Touches
from palpate.sensing.tip_calibration.unknowns import Unknowns

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

    Raises:
        InvalidValueError: A touch names no target, or does not push.
    """

    unknowns: Unknowns
    touches: Touches
    _start: FloatArray = field(init=False)
    _helper: FloatArray = field(init=False)
    _radius: FloatArray = field(init=False)
    _freedom: np.ndarray = field(init=False)  # type: ignore[type-arg]

    def __post_init__(self) -> None:
        touches, targets = self.touches, self.unknowns.targets
        if len(touches) and not (touches.target.min() >= 0 and touches.target.max() < len(targets)):
            raise InvalidValueError(f"target of a touch: must be from 0 to {len(targets) - 1}")
        object.__setattr__(self, "_radius", np.array([t.radius for t in targets])[touches.target])
        object.__setattr__(self, "_freedom", np.array([FREEDOM[t.kind] for t in targets])[touches.target])
        object.__setattr__(self, "_start", np.zeros((len(touches), 3)))
        object.__setattr__(self, "_helper", np.zeros((len(touches), 3)))
        solved = self._solved(self.unknowns.typed, None)
        helper = np.zeros_like(solved.normal)
        np.put_along_axis(helper, np.argmin(np.abs(solved.normal), axis=1)[:, None], 1.0, axis=1)
        object.__setattr__(self, "_start", solved.normal)
        object.__setattr__(self, "_helper", helper)
        if not (solved.normal_force > 0.0).all():
            worst = int(np.argmin(solved.normal_force))
            raise InvalidValueError(
                f"touch {worst}, of {targets[touches.target[worst]].name}: its force pulls "
                f"({solved.normal_force[worst]:.3g} N along the normal); wrenches are what the object exerts on the "
                "finger, in the sensor frame; is the target where it is said to be?"
            )

    def solved(self, values: FloatArray) -> Solved:
        """Return the touches at values of the unknowns, shape (P,)."""
        return self._solved(values, self._start)

    def _solved(self, values: FloatArray, start: FloatArray | None) -> Solved:
        unknowns, touches = self.unknowns, self.touches
        rotation, position = unknowns.mounted(values, touches.rotation, touches.position)
        places = unknowns.places(values)
        at = touches.target
        y = np.einsum("nji,nj->ni", rotation, places.place[at] - position)
        line = np.einsum("nji,nj->ni", rotation, places.direction[at])
        center, axes = unknowns.of("center", values), unknowns.rotation(values)
        sizes, deviations = unknowns.of("size", values), unknowns.of("deviations", values)
        support_of_shape = unknowns.tip.shape.support

        def support(u: FloatArray, rows: object) -> tuple[FloatArray, FloatArray]:
            own = u @ axes
            h, x = support_of_shape(sizes, own)
            if len(deviations):
                further, moved = deviation_basis(own, len(deviations))
                h, x = h + further @ deviations, x + moved @ deviations
            return h + u @ center, x @ axes.T + center

        if start is None:
            start = y - center
        start = np.where((self._freedom == 0)[:, None], -line, start)
        along = np.where((self._freedom == 1)[:, None], line, 0.0)
        start = start - np.einsum("ni,ni->n", start, along)[:, None] * along
        start = start / np.linalg.norm(start, axis=1, keepdims=True)
        u, gap, x = touching(support, y, start, self._freedom, line)

        stiffness, exponent = unknowns.stiffness(values)
        force, moment = touches.wrench[:, :3], touches.wrench[:, 3:]
        normal_force = -np.einsum("ni,ni->n", u, force)
        indentation = (np.maximum(normal_force, 0.0) / stiffness) ** exponent
        centroid = x - unknowns.tip.share * indentation[:, None] * u
        first = np.cross(u, self._helper)
        length = np.linalg.norm(first, axis=1, keepdims=True)
        first = first / np.where(length > 0.0, length, 1.0)
        basis = np.stack([first, np.cross(u, first)], axis=1)
        missing = moment - np.cross(centroid, force)
        lever = np.einsum("nki,ni->nk", basis, np.cross(u, missing)) / _positive(normal_force)[:, None]
        return Solved(u, gap - self._radius + indentation, lever, basis, centroid, normal_force, indentation)

    def jacobian(self, values: FloatArray) -> FloatArray:
        """Return the derivatives of `Solved.residuals` by the unknowns in units of their deviations, (n, 3, P)."""
        sd = self.unknowns.sd
        columns = []
        for i in range(len(values)):
            step = np.zeros_like(values)
            step[i] = STEP * sd[i]
            columns.append(
                (self.solved(values + step).residuals - self.solved(values - step).residuals) / (2.0 * STEP)
            )
        return np.stack(columns, axis=2)

    def noise(self, solved: Solved, gap_sd: float) -> FloatArray:
        """Return the covariance of each touch's three residuals, shape (n, 3, 3) [m^2].

        Args:
            solved: The touches.
            gap_sd: By how much the arm repeats badly, and target and tip are not what the model has them for [m].
        """
        variance = self.touches.wrench_sd**2
        softness = self._softness(solved)
        found = np.zeros((len(self.touches), 3, 3))
        found[:, 0, 0] = gap_sd**2 + softness**2 * (solved.normal**2 * variance[:, :3]).sum(axis=1)
        by_missing, by_force = self._lever_by_wrench(solved)
        found[:, 1:, 1:] = (by_missing * variance[:, None, 3:]) @ by_missing.transpose(0, 2, 1)
        found[:, 1:, 1:] += (by_force * variance[:, None, :3]) @ by_force.transpose(0, 2, 1)
        return found

    def shared(self, solved: Solved, ranges: FloatArray, accuracy: float) -> FloatArray:
        """Return what errors of the sensor's calibration, which all touches share, do to them.

        Args:
            solved: The touches.
            ranges: Of the sensor, shape (6,) [N, N m].
            accuracy: Standard deviation of every entry of its matrix, in units of the ranges.

        Returns:
            Residuals per unit deviation of 36 entries, shape (n, 3, 36) [m].
        """
        n = len(self.touches)
        relative = accuracy * self.touches.wrench / ranges
        by_missing, by_force = self._lever_by_wrench(solved)
        by_wrench = np.zeros((n, 3, 6))
        by_wrench[:, 1:, :3], by_wrench[:, 1:, 3:] = by_force, by_missing
        by_wrench[:, 0, :3] = -self._softness(solved)[:, None] * solved.normal
        return np.asarray(np.einsum("nki,nj->nkij", by_wrench * ranges, relative).reshape(n, 3, 36))

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


STEP = 1e-4
"""Of an unknown's deviation, for central differences: 1e-8 of a residual, that is rounding and curvature alike."""


def _positive(force: FloatArray) -> FloatArray:
    """Keep what does not push from dividing by zero: such touches are refused, or far from the solution."""
    return np.maximum(force, 1e-6)
