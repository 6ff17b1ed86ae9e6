"""Grasp forces under limits that are second-order cones: dual Newton steps, and clarabel behind them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from palpate.errors import FloatArray
from palpate.grasp.certificates.infeasibility import LARGEST_FORCES, certified_reach, proof_from
from palpate.grasp.problem.balance import balance
from palpate.grasp.problem.cone_form import CoupledProgramme
from palpate.grasp.problem.contacts import GraspContacts
from palpate.grasp.problem.limits import actuator_limits
from palpate.grasp.problem.objective_spec import Objective
from palpate.grasp.problem.result import GraspForces, SolveStatus
from palpate.grasp.problem.scaled import ScaledGrasp
from palpate.grasp.solvers.conic import ConicOutcome, ConicSolution
from palpate.grasp.solvers.least_effort import LeastEffort, Outcome, least_violation

__all__ = ["Convex"]

SLACK = 1e-9
"""Share by which an actuator may be beyond its limit before forces that know nothing of it are refused; and of the
load by which the largest margin may be below zero."""


CERTAIN = 1e-12
"""Error of the optimality conditions above which a proof of the contrary is looked for first."""


@dataclass(frozen=True, slots=True, eq=False)
class _Proof:
    y: FloatArray
    reach: float


class Convex:
    """Solves one load after another, for e that does not depend on the load and p = 2."""

    def __init__(self, grasp: GraspContacts, objective: Objective, effort_weight: float) -> None:
        """Allocate, so that solving need not."""
        self._objective, self._weight = objective, effort_weight
        self._newton = LeastEffort(ScaledGrasp.of(grasp), effort_weight)
        self.update(grasp)

    def update(self, grasp: GraspContacts) -> None:
        """Take contacts that have moved, come or gone."""
        self._grasp = grasp
        self._scaled = ScaledGrasp.of(grasp)
        self._limits = actuator_limits(grasp.actuator_map, grasp.actuator_limit, len(grasp))
        self._programmes: dict[Objective, CoupledProgramme] = {}
        if len(self._newton) == len(grasp):
            self._newton.update(self._scaled)
        else:
            self._newton = LeastEffort(self._scaled, self._weight)

    def solve(self, wrench: FloatArray, *, warm: bool) -> GraspForces:
        """Return the forces for a finite load, shape (6,) [N, N m]."""
        if self._objective is not Objective.MIN_EFFORT:
            return self._by_clarabel(wrench)
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
            proof = self._proof_by(wrench, y)
            if proof is not None:
                return self._least_violation(wrench, proof, used)
        return self._by_clarabel(wrench)

    def _by_clarabel(self, wrench: FloatArray) -> GraspForces:
        objective = self._objective
        solution, size = self._solve(objective, wrench)
        used = solution.iterations
        if solution.outcome == ConicOutcome.INFEASIBLE:
            return self._least_violation(wrench, self._proof(wrench, objective, solution), used)
        if objective is Objective.LOAD_FACTOR:
            if solution.outcome == ConicOutcome.UNBOUNDED or not wrench.any():
                return self._any_load(wrench)
        elif not solution.error <= CERTAIN and objective is not Objective.MAX_MARGIN:
            # next to the largest load an answer within tolerances may belong to a load that is not held
            found = self._least_violation(wrench, None, used)
            if found.status is SolveStatus.INFEASIBLE:
                return found
        status = SolveStatus.SOLVED if solution.outcome == ConicOutcome.SOLVED else SolveStatus.MAX_ITERATIONS
        n, theta, y = len(self._grasp), self._programmes[objective].theta(solution.x), solution.y[:6]
        forces = self._scaled.forces(solution.x[: 4 * n].reshape(n, 4), size)
        match objective:
            case Objective.LOAD_FACTOR:
                return self._result(forces, theta, theta * wrench, y, used, status, theta)
            case Objective.MIN_EFFORT:
                return self._result(forces, None, wrench, y * size, used, status)
            case Objective.MAX_MARGIN if theta < -SLACK * size:
                status = SolveStatus.INFEASIBLE
        return self._result(forces, theta, wrench, y, used, status)

    def _solve(self, objective: Objective, wrench: FloatArray) -> tuple[ConicSolution, float]:
        """Return clarabel's solution and its unit of force [N]."""
        if objective not in self._programmes:
            stated = CoupledProgramme(self._scaled, objective, self._weight, self._limits)
            self._programmes[objective] = stated
        load, size = self._scaled.load(wrench)
        return self._programmes[objective].of(load, size).solve(), size

    def _proof(self, wrench: FloatArray, objective: Objective, solution: ConicSolution) -> _Proof | None:
        """Return the multipliers of the last problem solved as a proof that nothing holds the load."""
        y, reach = proof_from(
            self._grasp, self._scaled, wrench, self._limits, self._programmes[objective], solution
        )
        return None if y is None or reach is None else _Proof(y, reach)

    def _proof_by(self, wrench: FloatArray, y: FloatArray) -> _Proof | None:
        """Return scaled multipliers as a proof that contacts alone cannot hold the load."""
        turned = self._scaled.multiplier(y)
        length = float(np.linalg.norm(turned))
        if not length > 0.0:
            return None
        reach = certified_reach(self._grasp, wrench, turned / length)
        return _Proof(turned / length, reach) if reach >= LARGEST_FORCES * self._scaled.load(wrench)[1] else None

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
            proof = self._proof_by(wrench, left)
        factor, unit = self._solve(Objective.LOAD_FACTOR, wrench)
        solved = factor.outcome == ConicOutcome.SOLVED
        if proof is None:
            # what bounds the factor proves as much, also where the load is hardly too large
            proof = self._proof(wrench, Objective.LOAD_FACTOR, factor)
        if self._limits.names and solved:
            # what leaves least knows nothing of actuators; this keeps their limits
            forces, size = factor.x[:-1].reshape(-1, 4), unit
        result = self._result(
            self._scaled.forces(forces, size),
            math.inf,
            wrench,
            np.full(6, math.nan),
            iterations,
            SolveStatus.MAX_ITERATIONS if proof is None else SolveStatus.INFEASIBLE,
            self._programmes[Objective.LOAD_FACTOR].theta(factor.x) if solved else 0.0,
        )
        return result if proof is None else replace(result, certificate=proof.y, reach=proof.reach)

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
