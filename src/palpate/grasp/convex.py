"""Grasp forces under limits that are second-order cones: dual Newton steps, and an interior point behind them."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from palpate.errors import FloatArray
from palpate.grasp.balance import balance
from palpate.grasp.certificate import certified_reach
from palpate.grasp.contacts import GraspContacts
from palpate.grasp.dual_newton import HI, LO, MU, RESERVE
from palpate.grasp.grasp_proof import LARGEST_FORCES
from palpate.grasp.interior_point import InteriorPoint, InteriorPointResult, InteriorPointStatus
from palpate.grasp.least_effort import LeastEffort, Outcome
from palpate.grasp.least_violation import least_violation
from palpate.grasp.objective import Objective
from palpate.grasp.result import GraspForces, SolveStatus
from palpate.grasp.scaled import ScaledGrasp
from palpate.grasp.sharpened import sharpened

__all__ = ["Convex"]

ABSENT = 1e3
"""Largest force, over the load, of a contact that is not there: above any margin that matters."""

SLACK = 1e-9
"""Share by which an actuator may be beyond its limit before forces that know nothing of it are refused; and of the
load by which the largest margin may be below zero."""


@dataclass(frozen=True, slots=True, eq=False)
class _Proof:
    y: FloatArray
    reach: float


class Convex:
    """Solves one load after another, for e that does not depend on the load and p = 2."""

    def __init__(self, grasp: GraspContacts, objective: Objective, effort_weight: float) -> None:
        """Compile and allocate, so that solving need not."""
        self._objective, self._weight = objective, effort_weight
        self._room, self._actuators = 0, 0
        self._newton = LeastEffort(ScaledGrasp.of(grasp), effort_weight)
        self.update(grasp)

    def update(self, grasp: GraspContacts) -> None:
        """Take contacts that have moved, come or gone."""
        self._grasp = grasp
        self._scaled = ScaledGrasp.of(grasp)
        self._prepare(len(grasp), 0 if grasp.actuator_limit is None else grasp.actuator_limit.shape[1])
        if len(self._newton) == len(grasp):
            self._newton.update(self._scaled)
        else:
            self._newton = LeastEffort(self._scaled, self._weight)

    def solve(self, wrench: FloatArray, *, warm: bool) -> GraspForces:
        """Return the forces for a finite load, shape (6,) [N, N m]."""
        if self._objective is not Objective.MIN_EFFORT:
            return self._by_interior_point(wrench)
        newton = self._newton
        if not warm:
            newton.y[:] = 0.0
        forces = np.empty((len(newton), 4))
        outcome, used = newton.solve(wrench, forces)
        if outcome == Outcome.SOLVED and self._actuators_bear(forces):
            out = newton.out
            return GraspForces(
                forces,
                float(out[6]),
                out[8:].copy(),
                out[:6].copy(),
                self._scaled.multiplier(newton.y) * float(out[7]),
                used,
                SolveStatus.SOLVED,
            )
        y = newton.y.copy()
        newton.y[:] = 0.0  # where it got lost is no place to begin
        if outcome == Outcome.INFEASIBLE:
            proof = self._proof(wrench, y)
            if proof is not None:
                return self._least_violation(wrench, proof, used)
        return self._by_interior_point(wrench)

    def _by_interior_point(self, wrench: FloatArray) -> GraspForces:
        load, size = self._scaled.load(wrench)
        if self._objective is Objective.LOAD_FACTOR:
            load, size = _direction(load, size)
        result = self._interior(self._objective, load, size)
        status = _STATUS[result.status]
        if status is SolveStatus.INFEASIBLE:
            proof = self._proof(wrench, result.certificate, result, size)
            return self._least_violation(wrench, proof, result.iterations)
        undecided = result.status in (InteriorPointStatus.NEARLY, InteriorPointStatus.MAX_ITERATIONS)
        if undecided and self._objective in (Objective.MIN_EFFORT, Objective.MIN_PEAK):
            found = self._least_violation(wrench, None, result.iterations)
            if found.status is SolveStatus.INFEASIBLE:
                return found
        forces = self._scaled.forces(result.forces[: len(self._grasp)], size)
        if self._objective is Objective.LOAD_FACTOR:
            if result.status is InteriorPointStatus.UNBOUNDED or not wrench.any():
                return self._any_load(wrench)
            factor = result.theta
            return self._result(forces, factor, factor * wrench, result.dual, result.iterations, status, factor)
        if self._objective is Objective.MAX_MARGIN and result.theta < -SLACK:
            status = SolveStatus.INFEASIBLE
        if self._objective is Objective.MIN_EFFORT:
            return self._result(forces, None, wrench, result.dual * size, result.iterations, status)
        return self._result(forces, result.theta * size, wrench, result.dual, result.iterations, status)

    def _any_load(self, wrench: FloatArray) -> GraspForces:
        """Return forces that hold the load, of which any multiple could be held."""
        forces, newton = np.empty((len(self._grasp), 4)), self._newton
        newton.y[:] = 0.0
        outcome, used = newton.solve(wrench, forces)
        if outcome != Outcome.SOLVED:
            load, size = self._scaled.load(wrench)
            forces = self._scaled.forces(least_violation(self._scaled.sized(size), load, self._weight)[0], size)
        return self._result(forces, math.inf, wrench, np.zeros(6), used, SolveStatus.SOLVED, math.inf)

    def _least_violation(self, wrench: FloatArray, proof: _Proof | None, iterations: int) -> GraspForces:
        """Return the forces that leave least of the load, and how much of it could be held."""
        load, size = self._scaled.load(wrench)
        forces, left = least_violation(self._scaled.sized(size), load, self._weight)
        if proof is None:
            proof = self._proof(wrench, left)
        load, unit = _direction(load, size)
        factor = self._interior(Objective.LOAD_FACTOR, load, unit)
        if proof is None and not self._actuators:
            rows, bearing = self._scaled.sized(unit), factor.forces[: len(self._grasp)]
            proof = self._proof(wrench, sharpened(rows, load, bearing, factor.dual))
        if self._actuators and factor.status is InteriorPointStatus.SOLVED:
            # what leaves least knows nothing of actuators; this keeps their limits
            forces, size = factor.forces[: len(self._grasp)], unit
        result = self._result(
            self._scaled.forces(forces, size),
            math.inf,
            wrench,
            np.full(6, math.nan),
            iterations,
            SolveStatus.MAX_ITERATIONS if proof is None else SolveStatus.INFEASIBLE,
            factor.theta if factor.status is InteriorPointStatus.SOLVED else 0.0,
        )
        return result if proof is None else replace(result, certificate=proof.y, reach=proof.reach)

    def _proof(
        self,
        wrench: FloatArray,
        y: FloatArray | None,
        result: InteriorPointResult | None = None,
        size: float = 1.0,
    ) -> _Proof | None:
        """Return scaled multipliers as a proof that nothing holds the load, if they are one."""
        if y is None or not y.any():
            return None
        turned = self._scaled.multiplier(y)
        length = float(np.linalg.norm(turned))
        push, limits = None, self._grasp.actuator_limit
        if result is not None and limits is not None:
            dual = float(np.linalg.norm(result.dual))
            scaled = result.multipliers[: len(self._grasp), -2 * self._actuators :] / dual
            push = scaled * size / np.repeat(limits, 2, axis=1) / length
        reach = certified_reach(self._grasp, wrench, turned / length, push)
        least = LARGEST_FORCES * self._scaled.load(wrench)[1]
        return _Proof(turned / length, reach) if reach >= least else None

    def _prepare(self, contacts: int, actuators: int) -> None:
        """Build the interior points, unless those there are have room for as many contacts."""
        if contacts <= self._room and actuators == self._actuators:
            return
        self._room, self._actuators = max(contacts, self._room), actuators
        wanted = {self._objective, Objective.LOAD_FACTOR}
        self._rows = np.zeros((self._room, RESERVE))
        with ThreadPoolExecutor(len(wanted)) as compilers:  # seconds each, if they are not compiled yet
            points = compilers.map(lambda each: InteriorPoint(self._room, each, actuators, self._weight), wanted)
            self._interior_points = dict(zip(wanted, points, strict=True))

    def _interior(self, objective: Objective, load: FloatArray, size: float) -> InteriorPointResult:
        """Return the interior point's result; where there is no contact it sees one that pushes nothing."""
        grasp, n, maps, limits = self._grasp, len(self._grasp), None, None
        rows = self._rows
        if n < self._room:
            rows[n:] = 0.0
            rows[n:, MU], rows[n:, HI] = 1.0, ABSENT
        rows[:n] = self._scaled.rows[:, :RESERVE]
        rows[:n, LO:RESERVE] /= size
        if grasp.actuator_map is not None and grasp.actuator_limit is not None:
            maps, limits = np.zeros((self._room, self._actuators, 4)), np.ones((self._room, self._actuators))
            maps[:n], limits[:n] = self._scaled.actuators(grasp.actuator_map, grasp.actuator_limit, size)
        return self._interior_points[objective].solve(rows, load, maps, limits)

    def _actuators_bear(self, forces: FloatArray) -> bool:
        grasp = self._grasp
        if grasp.actuator_map is None or grasp.actuator_limit is None:
            return True
        loads = np.einsum("nkj,nj->nk", grasp.actuator_map, forces)
        return bool((np.abs(loads) <= grasp.actuator_limit * (1.0 + SLACK)).all())

    def _result(
        self,
        forces: FloatArray,
        objective: float | None,
        held: FloatArray,
        y: FloatArray,
        iterations: int,
        status: SolveStatus,
        load_factor: float | None = None,
        certificate: FloatArray | None = None,
    ) -> GraspForces:
        """Return the result; without an objective it is the effort."""
        scaled, residual, margins = self._scaled, np.empty(6), np.empty(len(forces))
        effort = balance(scaled.rows, scaled.center, scaled.length, held, self._weight, forces, residual, margins)
        return GraspForces(
            forces,
            effort if objective is None else objective,
            margins,
            residual,
            scaled.multiplier(y),
            iterations,
            status,
            load_factor,
            certificate,
        )


def _direction(load: FloatArray, size: float) -> tuple[FloatArray, float]:
    """Return a load of length 1, and its unit: of load_factor only the direction counts."""
    length = float(np.linalg.norm(load))
    return (load / length, size * length) if length > 0.0 else (load, size)


_STATUS = {
    InteriorPointStatus.SOLVED: SolveStatus.SOLVED,
    InteriorPointStatus.NEARLY: SolveStatus.SOLVED,
    InteriorPointStatus.UNBOUNDED: SolveStatus.SOLVED,
    InteriorPointStatus.INFEASIBLE: SolveStatus.INFEASIBLE,
    InteriorPointStatus.MAX_ITERATIONS: SolveStatus.MAX_ITERATIONS,
}
