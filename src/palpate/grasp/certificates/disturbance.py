"""How large a disturbance a grasp holds, in a given direction and in the worst one."""

from dataclasses import dataclass, replace

import numpy as np

from palpate.errors import FloatArray, InvalidValueError, positive, vector
from palpate.grasp.certificates.support_function import BearableWrenches
from palpate.grasp.optimizer import GraspForceOptimizer
from palpate.grasp.problem.cone_check import check_cones
from palpate.grasp.problem.contacts import GraspContacts
from palpate.grasp.problem.result import SolveStatus
from palpate.grasp.problem.scaled import ScaledGrasp
from palpate.grasp.solvers.least_effort import LeastEffort, Outcome

__all__ = ["LargestDisturbance", "cones_around", "largest_by_halving", "largest_disturbance", "worst_disturbance"]

BISECTION_ACCURACY = 1e-4
"""Of the factor found, relative: each halving takes tens of milliseconds."""

BISECTION_STEPS = 60
"""Doublings and halvings, at most."""


def cones_around(grasp: GraspContacts) -> GraspContacts | None:
    """Return cones that hold whatever a grasp holds, actuators left aside; None where e grows without end.

    e is that of the largest force, and |(f_t, tau / e)|_p is no less than its 2-norm for p below 2.
    """
    grows = grasp.load_exponent > 0.0
    if not np.isfinite(grasp.force_max[grows]).all():
        return None
    length = grasp.spin_length * np.where(grows, grasp.force_max, 1.0) ** grasp.load_exponent
    cones, nothing = np.full(len(grasp), 2.0), np.zeros(len(grasp))
    return replace(
        grasp,
        spin_length=length,
        load_exponent=nothing,
        norm_exponent=cones,
        actuator_map=None,
        actuator_limit=None,
    )


def largest_by_halving(
    grasp: GraspContacts, load: FloatArray, direction: FloatArray, first: float, bound: float, endless: float
) -> tuple[float, FloatArray]:
    """Return the factor of a disturbance up to which forces were found, and these, shape (n, 4) [N, N, N, N m].

    What a limit that is no cone holds need not be convex: a factor that fails ends the search, whether or not a
    larger one would be held again.

    Args:
        grasp: Any.
        load: What acts on the object anyway, shape (6,) [N, N m].
        direction: The disturbance, shape (6,) [N, N m].
        first: Factor to try first if there is no bound.
        bound: No larger factor is held.
        endless: Factors from here on count as infinite.
    """
    optimizer, forces = GraspForceOptimizer(grasp), np.zeros((len(grasp), 4))
    low, high, factor = 0.0, bound, 0.0
    for _ in range(BISECTION_STEPS):
        result = optimizer.solve(load + factor * direction)
        if result.status is SolveStatus.SOLVED:
            low, forces = factor, result.forces
        elif factor == 0.0:
            break
        else:
            high = factor
        if low >= endless:
            return np.inf, forces
        if np.isfinite(high) and high - low <= BISECTION_ACCURACY * high:
            break
        factor = 0.5 * (low + high) if np.isfinite(high) else max(2.0 * low, first)
    return low, forces


ACCURACY = 1e-9
"""Of the factor found, relative."""

STEPS = 200
"""Cuts and halvings, at most: more than halving 1e6 down to 1e-9 of a factor takes."""

MAX_FACTOR = 1e6
"""Factors beyond this, over the largest force allowed, count as without end."""

DESCENTS = 30
"""Steps from one start to the nearest worst direction, at most."""


@dataclass(frozen=True, slots=True, eq=False)
class LargestDisturbance:
    """The largest multiple of a disturbance that is held beside a load.

    Attributes:
        factor: Of the direction: held up to here. 0 if the load alone is not held; infinite if any multiple is.
        bound: No factor above this is held, which `normal` proves: the same but for rounding if limits are cones
            and there are no actuators, else that of cones around what is held; infinite where there are none.
        direction: The disturbance, about the object's origin, shape (6,) [N, N m].
        forces: That hold `factor` times it, shape (n, 4) [N, N, N, N m].
        normal: y (6,) with y . direction = 1: y . load <= `BearableWrenches.reach` for all loads that are held.
    """

    factor: float
    bound: float
    direction: FloatArray
    forces: FloatArray
    normal: FloatArray


def largest_disturbance(
    grasp: GraspContacts, direction: FloatArray, load: FloatArray | None = None
) -> LargestDisturbance:
    """Return how many times a disturbance is held beside a load.

    Cuts from outside, halvings from inside: forces are found for a factor, or multipliers y that no forces meet.
    The latter bound it: y . (load + factor direction) <= reach(y).

    Where limits are no cones, or there are actuator limits, it halves between forces that `GraspForceOptimizer`
    finds and cones around the limits: to 1e-4, in about a second.

    Args:
        grasp: Any; without a largest force a closed grasp holds anything.
        direction: The disturbance, about the object's origin, shape (6,) [N, N m].
        load: What acts on the object anyway, as weight, shape (6,) [N, N m]; None for nothing.

    Raises:
        InvalidValueError: A direction that is zero.
    """
    towards = np.array(vector("direction", direction, 6, "N, N m"))
    if grasp.is_convex and grasp.actuator_map is None:
        return _Search(grasp, load).largest(towards)
    cones = cones_around(grasp)
    # without a largest force e may grow for ever: then any cones do for the scale, and nothing is proven
    around = _Search(_plain(grasp) if cones is None else cones, load)
    most = around.largest(towards)
    bound, normal = (np.inf, np.full(6, np.nan)) if cones is None else (most.bound, most.normal)
    held, size = around.load, around.size(towards)
    factor, forces = largest_by_halving(grasp, held, towards, 1.0 / size, bound, around.most / size)
    return LargestDisturbance(factor, bound, towards, forces, normal)


def worst_disturbance(
    grasp: GraspContacts, length: float, load: FloatArray | None = None, starts: int = 64, seed: int = 0
) -> LargestDisturbance:
    """Return the disturbance that is held least, of all with |(force, moment / length)| = 1 N.

    The distance from the load to the border of what is held: not convex, so that it is searched from many starts.
    From each direction the border is found and its normal taken for the next direction, which never goes farther;
    where both agree the border is nearest, there. Guaranteed: `bound` is an upper bound of the true worst (a load
    just beyond it is not held, proven by `normal`), and the border is nearest among directions close by. Not
    guaranteed: that no start would have found a nearer one.

    Args:
        grasp: Whose limits are cones, without actuator limits, with a largest force.
        length: What a moment of 1 N m is to be compared with: the moment of 1 N so far off, as the object's radius
            [m].
        load: What acts on the object anyway.
        starts: How many directions to start from, beside the twelve along the axes.
        seed: Of those.

    Raises:
        InvalidValueError: A grasp beyond cones or without largest forces, or no positive length.
    """
    check_cones(grasp, "the worst disturbance is")
    positive("length", length, "m")
    if not np.isfinite(grasp.force_max).all():
        raise InvalidValueError("force_max is infinite: without a largest force nothing limits what a grasp holds")
    unit = np.array([1.0, 1.0, 1.0, length, length, length])
    search = _Search(grasp, load)
    random = np.random.default_rng(seed).standard_normal((starts, 6))
    best: LargestDisturbance | None = None
    for start in np.vstack([np.eye(6), -np.eye(6), random]):
        found = search.nearest(start / np.linalg.norm(start) * unit, unit)
        if best is None or found.factor < best.factor:
            best = found
        if best.factor <= 0.0:
            break
    assert best is not None
    return best


def _plain(grasp: GraspContacts) -> GraspContacts:
    """The places and normals, with cones."""
    return GraspContacts(grasp.positions, grasp.frames, grasp.friction, grasp.spin_length)


class _Search:
    def __init__(self, grasp: GraspContacts, load: FloatArray | None) -> None:
        self._grasp, self._scaled = grasp, ScaledGrasp.of(grasp)
        self._behind: GraspForceOptimizer | None = None
        self._solver = LeastEffort(self._scaled, 1e-2)
        self._borne = BearableWrenches.of(grasp)
        self.load = np.zeros(6) if load is None else np.array(vector("load", load, 6, "N, N m"))
        limit = grasp.force_max[np.isfinite(grasp.force_max)]
        self.most = MAX_FACTOR * float(limit.max(initial=1.0))
        self._shape = (len(grasp), 4)
        self._metric = np.array([1.0, 1.0, 1.0, *[self._scaled.length] * 3])

    def size(self, direction: FloatArray) -> float:
        """Return how large a disturbance is, moments over the grasp's size [N]."""
        size = float(np.linalg.norm(direction / self._metric))
        if size == 0.0:
            raise InvalidValueError("direction is zero: a disturbance needs one")
        return size

    def largest(self, direction: FloatArray) -> LargestDisturbance:
        """Return how far it goes along a direction."""
        metric, size = self._metric, self.size(direction)
        forces, kept = np.zeros(self._shape), np.zeros(self._shape)
        normal = direction / metric**2 / size**2
        low, high = -1.0, self._bound(normal, direction)
        factor = 0.0
        for step in range(STEPS):
            outcome, y = self._held(self.load + factor * direction, forces)
            if outcome == Outcome.SOLVED:
                low, kept = factor, forces.copy()
                if low >= self.most / size:
                    return LargestDisturbance(np.inf, np.inf, direction, kept, normal)
            else:
                along = float(y @ direction)
                cut = self._bound(y / along, direction) if along > 0.0 else np.inf
                if cut < high:
                    high, normal = cut, y / along
                if factor == 0.0:
                    return LargestDisturbance(0.0, max(high, 0.0), direction, kept, normal)
                if outcome == Outcome.INFEASIBLE:
                    high = min(high, factor)
                elif high > factor:  # undecided: on the border within rounding, as far as this solver sees
                    high = factor
            if high - low <= ACCURACY * max(abs(low), 1e-300) or high <= 0.0:
                break
            factor = min(0.5 * (low + high), 16.0 * low + 1.0 / size)
            if np.isfinite(high) and high - low < 0.1 * high:
                factor = max(factor, high - 0.1 * (high - low)) if step % 2 else factor
        return LargestDisturbance(max(low, 0.0), max(high, low, 0.0), direction, kept, normal)

    def nearest(self, direction: FloatArray, unit: FloatArray) -> LargestDisturbance:
        """Return the border's nearest point close to a direction of unit length."""
        best = self.largest(direction)
        for _ in range(DESCENTS):
            # the point of the supporting plane that is nearest in this metric
            towards = best.normal * unit
            found = self.largest(towards / np.linalg.norm(towards) * unit)
            if not found.factor < best.factor * (1.0 - 1e-7):
                break
            best = found
        return best

    def _held(self, load: FloatArray, forces: FloatArray) -> tuple[int, FloatArray]:
        """Fill forces if they hold a load; return the outcome and multipliers of it."""
        self._solver.y[:] = 0.0
        outcome, _ = self._solver.solve(load, forces)
        if outcome != Outcome.UNDECIDED:
            return outcome, self._scaled.multiplier(self._solver.y)
        if self._behind is None:
            self._behind = GraspForceOptimizer(self._grasp)
        result = self._behind.solve(load, warm_start=False)
        if result.status is SolveStatus.SOLVED:
            forces[:] = result.forces
            return Outcome.SOLVED, result.dual
        if result.certificate is not None:
            return Outcome.INFEASIBLE, result.certificate
        return Outcome.UNDECIDED, self._scaled.multiplier(self._solver.y)

    def _bound(self, y: FloatArray, direction: FloatArray) -> float:
        """The factor that y, with y . direction = 1, allows."""
        return self._borne.reach(y) - float(y @ self.load)
