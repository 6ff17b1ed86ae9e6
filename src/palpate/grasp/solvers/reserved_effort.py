"""Least effort under limits of which a part is kept back: dual Newton steps, and clarabel behind them."""

from palpate.errors import FloatArray
from palpate.grasp.problem.objective_spec import Objective
from palpate.grasp.problem.scaled import ScaledGrasp
from palpate.grasp.solvers.dual_newton import HI, LO
from palpate.grasp.solvers.least_effort import LeastEffort, Outcome

__all__ = ["ReservedEffort"]


class ReservedEffort:
    """Solves one set of limits after another.

    Where Newton's method does not decide, clarabel minimises the effort of the forces beyond the part kept back.
    Those forces hold; their effort is not quite the least if that part is large.
    """

    def __init__(self, effort_weight: float) -> None:
        """Take eps."""
        self._weight = effort_weight
        self._newton: LeastEffort | None = None

    def solve(self, limits: ScaledGrasp, wrench: FloatArray, forces: FloatArray) -> Outcome:
        """Fill forces (n, 4) [N, N, N, N m] and return the outcome.

        Args:
            limits: Contacts; while their number stays, the next solution starts warm.
            wrench: What else acts on the object, about its origin, shape (6,) [N, N m].
            forces: Room for the result; of an undecided one, where it stopped.
        """
        if (limits.rows[:, HI] < limits.rows[:, LO]).any():  # more is kept back than force_max allows
            return Outcome.INFEASIBLE
        if self._newton is None or len(self._newton) != len(limits.rows):
            self._newton = LeastEffort(limits, self._weight)
        self._newton.update(limits)
        outcome = Outcome(self._newton.solve(wrench, forces)[0])
        if outcome == Outcome.SOLVED:
            return outcome
        self._newton.y[:] = 0.0  # where it got lost is no place to begin
        return outcome if outcome == Outcome.INFEASIBLE else self._by_clarabel(limits, wrench, forces)

    def _by_clarabel(self, limits: ScaledGrasp, wrench: FloatArray, forces: FloatArray) -> Outcome:
        from palpate.grasp.problem.cone_form import CoupledProgramme
        from palpate.grasp.problem.limits import CoupledLimits
        from palpate.grasp.solvers.conic import ConicOutcome

        load, size = limits.load(wrench)
        none = CoupledLimits.none(len(limits.rows))
        found = CoupledProgramme(limits, Objective.MIN_EFFORT, self._weight, none).of(load, size).solve()
        if found.outcome == ConicOutcome.SOLVED:
            forces[:] = limits.forces(found.x.reshape(-1, 4), size)
            return Outcome.SOLVED
        return Outcome.INFEASIBLE if found.outcome == ConicOutcome.INFEASIBLE else Outcome.UNDECIDED
