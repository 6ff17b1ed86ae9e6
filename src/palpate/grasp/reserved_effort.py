"""Least effort under limits of which a part is kept back: dual Newton steps, and an interior point behind them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from palpate.errors import FloatArray
from palpate.grasp.dual_newton import HI, LO, MU, RESERVE
from palpate.grasp.interior_result import InteriorPointStatus
from palpate.grasp.least_effort import LeastEffort, Outcome
from palpate.grasp.objective import Objective
from palpate.grasp.scaled import ScaledGrasp

if TYPE_CHECKING:
    from palpate.grasp.interior_point import InteriorPoint

__all__ = ["ReservedEffort"]

ABSENT = 1e3
"""Largest force, over the load, of a contact that is not there: above any margin that matters."""


class ReservedEffort:
    """Solves one set of limits after another.

    Where Newton's method does not decide, the interior point takes the effort of what presses beyond the part kept
    back: of forces that hold, not quite the least if that part is large.
    """

    def __init__(self, contacts: int, effort_weight: float) -> None:
        """Compile for so many contacts, or fewer."""
        self._weight, self._room, self._n = effort_weight, 0, 0
        self._newton: LeastEffort | None = None
        self.resize(contacts)

    def resize(self, contacts: int) -> None:
        """Take another number of contacts; only more than ever before make it compile."""
        if contacts > self._room:
            self._room = contacts
            self._behind = _interior_point(contacts, self._weight)
        if contacts != self._n:
            self._n, self._newton = contacts, None

    def solve(self, limits: ScaledGrasp, wrench: FloatArray, forces: FloatArray) -> Outcome:
        """Fill forces (n, 4) [N, N, N, N m] and return the outcome.

        Args:
            limits: Of as many contacts as expected.
            wrench: What else acts on the object, about its origin, shape (6,) [N, N m].
            forces: Room for the result; of an undecided one, where it stopped.
        """
        if (limits.rows[:, HI] < limits.rows[:, LO]).any():  # more is kept back than force_max allows
            return Outcome.INFEASIBLE
        if self._newton is None:
            self._newton = LeastEffort(limits, self._weight)
        self._newton.update(limits)
        outcome = Outcome(self._newton.solve(wrench, forces)[0])
        if outcome == Outcome.SOLVED:
            return outcome
        self._newton.y[:] = 0.0  # where it got lost is no place to begin
        return outcome if outcome == Outcome.INFEASIBLE else self._by_interior_point(limits, wrench, forces)

    def _by_interior_point(self, limits: ScaledGrasp, wrench: FloatArray, forces: FloatArray) -> Outcome:
        load, size = limits.load(wrench)
        rows = np.zeros((self._room, RESERVE))
        rows[self._n :, MU], rows[self._n :, HI] = 1.0, ABSENT
        rows[: self._n] = limits.sized(size)[:, :RESERVE]
        result = self._behind.solve(rows, load)
        if result.status is InteriorPointStatus.SOLVED:
            forces[:] = limits.forces(result.forces[: self._n], size)
            return Outcome.SOLVED
        return Outcome.INFEASIBLE if result.status is InteriorPointStatus.INFEASIBLE else Outcome.UNDECIDED


def _interior_point(contacts: int, effort_weight: float) -> InteriorPoint:
    """Import it, with CasADi (a second that only grasps need), and build one."""
    from palpate.grasp.interior_point import InteriorPoint

    return InteriorPoint(contacts, Objective.MIN_EFFORT, 0, effort_weight)
