"""How often planned forces hold, by drawing what is not known."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from palpate.errors import FloatArray, InvalidValueError, numbers
from palpate.grasp.problem.cone_check import check_cones
from palpate.grasp.problem.contacts import GraspContacts
from palpate.grasp.problem.scaled import ScaledGrasp
from palpate.grasp.robust.uncertainty import GraspUncertainty
from palpate.grasp.solvers.dual_newton import HI, LO, MU, E, N, P
from palpate.grasp.solvers.least_effort import Outcome
from palpate.grasp.solvers.reserved_effort import ReservedEffort

__all__ = ["SampledHolding", "sample_holding"]

ROUNDING = 1e-9
"""Of the largest normal force: by so much forces may be beyond a limit."""

EMPTY = 1e-6
"""A contact that presses with a smaller share of the largest normal force bears nothing."""

BALANCED = 1e-6
"""Of the load, which forces that hold it may leave."""


@dataclass(frozen=True, slots=True)
class SampledHolding:
    """Shares of draws in which planned forces hold.

    Attributes:
        fixed: Every contact bears exactly the forces planned, in its own frame, within its own true limit. What
            errs in places, normals and load does not enter: forces that do not change cannot answer it. 0 if they
            do not balance the load as believed.
        redistributing: Normal forces are as planned; some tangential forces and spin torques within the true
            limits balance the true load at the true places.
        draws: How many.
        undecided: Of these, where no solver said whether it redistributes: they count as not held.
    """

    fixed: float
    redistributing: float
    draws: int
    undecided: int

    @property
    def fixed_error(self) -> float:
        """Standard error of `fixed`: with one draw more of either kind, so that it is never 0."""
        return _standard_error(self.fixed, self.draws)

    @property
    def redistributing_error(self) -> float:
        """Standard error of `redistributing`, likewise."""
        return _standard_error(self.redistributing, self.draws)


def _standard_error(share: float, draws: int) -> float:
    likely = (share * draws + 1.0) / (draws + 2.0)
    return math.sqrt(likely * (1.0 - likely) / draws)


def sample_holding(
    grasp: GraspContacts,
    uncertainty: GraspUncertainty,
    wrench: FloatArray,
    forces: FloatArray,
    draws: int = 2000,
    seed: int = 0,
) -> SampledHolding:
    """Draw friction, spin lengths, places, normals and loads, and count in how many draws planned forces hold.

    It takes about 25 us per draw of few contacts, and knows nothing of how the forces were planned.

    Args:
        grasp: As believed, its limits cones.
        uncertainty: Of it and of the load; normal distributions.
        wrench: As expected, shape (6,) [N, N m].
        forces: As planned, by whatever, shape (n, 4) [N, N, N, N m].
        draws: How many.
        seed: Of the draws.

    Raises:
        InvalidValueError: Limits that are no cones, shapes that do not fit, no draw, or what is not finite.
    """
    check_cones(grasp, "holding is sampled")
    n, wrench, forces = len(grasp), numbers("wrench", wrench), numbers("forces", forces)
    if len(uncertainty) != n or forces.shape != (n, 4) or wrench.shape != (6,):
        raise InvalidValueError(
            f"uncertainty is of {len(uncertainty)} contacts, forces have shape {forces.shape}, wrench "
            f"{wrench.shape}: must be {n}, {(n, 4)} and (6,), as the grasp has {n} contacts"
        )
    if draws < 1 or not (np.isfinite(forces).all() and np.isfinite(wrench).all()):
        raise InvalidValueError(f"draws = {draws}, forces or wrench: must be at least 1, and finite")
    drawn = _Drawn.of(grasp, uncertainty, wrench, draws, seed)
    fixed = _balanced(grasp, wrench, forces) * float(np.mean(drawn.within(forces)))
    outcomes = drawn.redistributing(grasp, forces[:, 0])
    return SampledHolding(fixed, outcomes.count(Outcome.SOLVED) / draws, draws, outcomes.count(Outcome.UNDECIDED))


def _balanced(grasp: GraspContacts, wrench: FloatArray, forces: FloatArray) -> bool:
    scaled = ScaledGrasp.of(grasp)
    left, size = scaled.load(grasp.grasp_map @ forces.ravel() + wrench)
    return float(np.abs(left).max()) * size <= BALANCED * max(scaled.load(wrench)[1], float(forces[:, 0].max()))


@dataclass(frozen=True, slots=True, eq=False)
class _Drawn:
    """Grasps and loads as they may really be.

    Attributes:
        friction: mu, shape (draws, n).
        spin_length: e, shape (draws, n) [m].
        positions: Object frame, shape (draws, n, 3) [m].
        frames: [n t1 t2], shape (draws, n, 3, 3).
        loads: About the object's origin, shape (draws, 6) [N, N m].
    """

    friction: FloatArray
    spin_length: FloatArray
    positions: FloatArray
    frames: FloatArray
    loads: FloatArray

    @classmethod
    def of(
        cls, grasp: GraspContacts, unsure: GraspUncertainty, wrench: FloatArray, draws: int, seed: int
    ) -> "_Drawn":
        rng, n = np.random.default_rng(seed), len(grasp)

        def errors(covariance: FloatArray) -> FloatArray:
            return rng.multivariate_normal(np.zeros(len(covariance)), covariance, draws, method="eigh")

        tilt = np.stack([errors(each) for each in unsure.normal], axis=1)
        # n x (a t1 + b t2) = a t2 - b t1
        turns = tilt[..., :1] * grasp.frames[:, :, 2] - tilt[..., 1:] * grasp.frames[:, :, 1]
        turned = Rotation.from_rotvec(turns.reshape(-1, 3)).as_matrix().reshape(draws, n, 3, 3)
        return cls(
            grasp.friction + errors(unsure.friction),
            grasp.spin_length + errors(unsure.spin_length),
            grasp.positions + np.stack([errors(each) for each in unsure.position], axis=1),
            turned @ grasp.frames,
            wrench + errors(unsure.load),
        )

    def within(self, forces: FloatArray) -> NDArray[np.bool_]:
        """Return in which draws all contacts bear forces (n, 4) within their limits, shape (draws,)."""
        spin = np.abs(forces[:, 3])
        with np.errstate(divide="ignore", invalid="ignore"):
            spun = np.where(spin > 0.0, spin / np.maximum(self.spin_length, 0.0), 0.0)
        size = np.sqrt(forces[:, 1] ** 2 + forces[:, 2] ** 2 + spun**2)
        held = size <= self.friction * forces[:, 0] + ROUNDING * forces[:, 0].max()
        return np.asarray(held.all(axis=1))

    def redistributing(self, grasp: GraspContacts, press: FloatArray) -> list[Outcome]:
        """Return for each draw whether friction balances the load where contacts press with `press` (n,) [N]."""
        pressing = press > EMPTY * press.max()
        whole = ScaledGrasp.of(grasp)
        base = replace(whole, rows=whole.rows[pressing])
        base.rows[:, LO] = base.rows[:, HI] = press[pressing]
        count = len(base.rows)
        if not count:
            return [Outcome.INFEASIBLE if load.any() else Outcome.SOLVED for load in self.loads]
        solver, forces, outcomes = ReservedEffort(0.01), np.empty((count, 4)), []
        for k, load in enumerate(self.loads):
            rows = base.rows.copy()
            rows[:, P : P + 3] = (self.positions[k, pressing] - base.center) / base.length
            rows[:, N : N + 9] = self.frames[k, pressing].transpose(0, 2, 1).reshape(-1, 9)
            rows[:, E], rows[:, MU] = self.spin_length[k, pressing] / base.length, self.friction[k, pressing]
            if (rows[:, [E, MU]] > 0.0).all():
                outcomes.append(solver.solve(replace(base, rows=rows), load, forces))
            else:
                outcomes.append(Outcome.INFEASIBLE)
        return outcomes
