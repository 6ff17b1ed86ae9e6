"""Grasp forces where contacts share more than the object: common actuators, own limits, own objectives."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import replace

import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.grasp.certificates.infeasibility import limits_exclude_each_other, proof_from
from palpate.grasp.problem.balance import balance
from palpate.grasp.problem.cone_form import CoupledProgramme
from palpate.grasp.problem.contacts import GraspContacts
from palpate.grasp.problem.convex_forms import Quadratic
from palpate.grasp.problem.limits import actuator_limits, shared_limits
from palpate.grasp.problem.objective_spec import Objective, Wanted
from palpate.grasp.problem.own_terms import OwnTerms, SmoothTerms
from palpate.grasp.problem.result import GraspForces, SolveStatus
from palpate.grasp.problem.scaled import ScaledGrasp
from palpate.grasp.solvers.conic import ConicOutcome, ConicSolution
from palpate.grasp.solvers.nonlinear import NonlinearProgramme
from palpate.grasp.solvers.sequential import ENDLESS, Sequence, Stationary, newton

__all__ = ["Coupled"]

SLACK = 1e-9
"""Largest margin below zero, over the load, that is none."""


class Coupled:
    """Solves one load after another; friction limits are cones, all else is as somebody wants it."""

    def __init__(self, grasp: GraspContacts, wanted: Wanted) -> None:
        """Trace and compile, so that solving need not."""
        self._wanted = wanted
        self._terms: OwnTerms | None = None
        self._contacts = 0
        self._rows: tuple[int, ...] = ()
        self._last: ConicSolution | None = None
        self.update(grasp)

    def update(self, grasp: GraspContacts, wanted: Wanted | None = None) -> None:
        """Take contacts that have moved, come or gone, or other limits of shared actuators.

        Raises:
            InvalidValueError: Limits that are no cones, or own functions that do not suit so many contacts.
        """
        wanted = self._wanted if wanted is None else wanted
        _check(grasp)
        n, terms, last = len(grasp), self._terms, self._last
        if terms is None or n != self._contacts:
            terms, last = OwnTerms.traced(n, wanted.own_objective, wanted.subject_to), None
        limits = shared_limits(wanted.shared_actuators, n)
        limits = limits.and_also(actuator_limits(grasp.actuator_map, grasp.actuator_limit, n))
        self._limits, self._terms, self._wanted = limits.and_also(terms.limits), terms, wanted
        self._grasp, self._contacts, self._scaled = grasp, n, ScaledGrasp.of(grasp)
        objective: Objective | Quadratic
        if wanted.own_objective is None:
            objective = wanted.objective
        else:
            objective = terms.objective or Quadratic(np.zeros((4 * n, 4 * n)), np.zeros(4 * n), 0.0)
        self._programme = self._stated(objective)
        by_effort = terms.smooth is not None and terms.smooth.has_objective
        self._start = self._stated(Objective.MIN_EFFORT) if by_effort else self._programme
        before, self._rows = self._rows, self._programme.rows
        self._last = last if self._rows == before else None

    def solve(self, wrench: FloatArray, *, warm: bool) -> GraspForces:
        """Return the forces for a finite load, shape (6,) [N, N m]."""
        load, size = self._scaled.load(wrench)
        assert self._terms is not None
        last = self._last if warm else None
        self._last = None
        if self._terms.smooth is None:
            return self._convex(wrench, load, size, last)
        return self._by_sequence(wrench, load, size, self._terms.smooth, last)

    def _stated(self, objective: Objective | Quadratic, only: Collection[int] | None = None) -> CoupledProgramme:
        limits = self._limits if only is None else self._limits.chosen(only)
        return CoupledProgramme(self._scaled, objective, self._wanted.effort_weight, limits)

    def _convex(
        self, wrench: FloatArray, load: FloatArray, size: float, last: ConicSolution | None
    ) -> GraspForces:
        programme = self._programme.of(load, size)
        solution = None if last is None else programme.near(last)
        if solution is None or solution.outcome != ConicOutcome.SOLVED:
            solution = programme.solve()
            if solution.outcome == ConicOutcome.UNBOUNDED and self._wanted.objective is Objective.LOAD_FACTOR:
                return self._any_load(wrench)
            if solution.outcome != ConicOutcome.SOLVED:
                return self._not_solved(wrench, load, size, solution, self._programme)
        self._last = solution
        return self._result(wrench, solution, self._programme.unit)

    def _any_load(self, wrench: FloatArray) -> GraspForces:
        """Return the least forces that hold the load, of which any multiple could be held."""
        held = Coupled(self._grasp, replace(self._wanted, objective=Objective.MIN_EFFORT))
        result = held.solve(wrench, warm=False)
        if result.status is not SolveStatus.SOLVED:
            return result
        return replace(result, objective=math.inf, dual=np.zeros(6), load_factor=math.inf)

    def _by_sequence(
        self, wrench: FloatArray, load: FloatArray, size: float, terms: SmoothTerms, last: ConicSolution | None
    ) -> GraspForces:
        base = self._programme.of(load, size)
        units, used = self._programme.units * size, 0
        if last is not None:
            programme = NonlinearProgramme(base, units, terms, last.x)
            near = newton(programme, last)
            if near is not None and near.away is None:
                return self._local(wrench, programme, near, near.steps)
            found = Sequence(programme).from_(last.x)
            used = found.steps
            if not found.reason:
                return self._local(wrench, programme, found, used)
        first = self._start.of(load, size).solve()
        if first.outcome != ConicOutcome.SOLVED:
            # these limits alone exclude each other, whatever the others are
            return self._not_solved(wrench, load, size, first, self._start)
        start = np.zeros(base.q.size)
        start[: first.x.size] = first.x
        programme = NonlinearProgramme(base, units, terms, start)
        found = Sequence(programme).from_(start)
        used += found.steps
        if not found.reason:
            return self._local(wrench, programme, found, used)
        result = self._result(wrench, found.solution, math.nan)
        status = SolveStatus.MAX_ITERATIONS
        return replace(result, objective=math.inf, iterations=used, status=status, reason=found.reason, local=True)

    def _local(
        self, wrench: FloatArray, programme: NonlinearProgramme, found: Stationary, used: int
    ) -> GraspForces:
        self._last = found.solution
        unit = self._programme.unit * programme.unit  # one of them is 1
        return replace(self._result(wrench, found.solution, unit), iterations=used, local=True)

    def _result(self, wrench: FloatArray, solution: ConicSolution, unit: float) -> GraspForces:
        """Return what is optimal, from scaled unknowns and multipliers over `unit`."""
        programme, scaled, terms = self._programme, self._scaled, self._terms
        assert terms is not None
        w, v = programme.forces(solution.x), solution.x
        forces = w.reshape(-1, 4)
        theta, status, factor = programme.theta(v), SolveStatus.SOLVED, None
        named = None if self._wanted.own_objective is not None else self._wanted.objective
        held = wrench
        if named is Objective.LOAD_FACTOR:
            factor = theta
            held = factor * wrench
        residual, margins = np.empty(6), np.empty(len(forces))
        weight = self._wanted.effort_weight
        value = balance(scaled.rows, scaled.center, scaled.length, held, weight, forces, residual, margins)
        if named in (Objective.MAX_MARGIN, Objective.MIN_PEAK, Objective.LOAD_FACTOR):
            value = theta
        elif named is None:
            smooth = terms.smooth
            if terms.objective is not None:
                value = terms.objective(w)
            elif smooth is not None:
                value = smooth(w, np.zeros(smooth.count))[0]
        if named is Objective.MAX_MARGIN and theta < -SLACK * programme.size:
            status = SolveStatus.INFEASIBLE
        dual = scaled.multiplier(solution.y[:6]) * (unit / programme.size)
        return GraspForces(forces, value, margins, residual, dual, solution.iterations, status, factor)

    def _not_solved(
        self,
        wrench: FloatArray,
        load: FloatArray,
        size: float,
        solution: ConicSolution,
        programme: CoupledProgramme,
    ) -> GraspForces:
        """Return forces within all convex limits that hold most of the load, and why not all of it."""
        most = self._stated(Objective.LOAD_FACTOR)
        bearable = most.of(load, size).solve()
        factor, w = None, np.zeros(4 * self._contacts)
        certificate: FloatArray | None = None
        reach: float | None = None
        if solution.outcome == ConicOutcome.INFEASIBLE:
            certificate, reach = proof_from(self._grasp, self._scaled, wrench, self._limits, programme, solution)
        infeasible, reason = certificate is not None, "undecided"
        if bearable.outcome == ConicOutcome.SOLVED:
            w, factor = most.forces(bearable.x), most.theta(bearable.x)
            if certificate is None and solution.outcome != ConicOutcome.UNBOUNDED:
                # what bounds the factor proves as much, also where the load is hardly too large
                certificate, reach = proof_from(self._grasp, self._scaled, wrench, self._limits, most, bearable)
                infeasible = certificate is not None
            if factor < 1.0:
                reason = f"the limits leave {factor:.6g} of the load at most"
        elif bearable.outcome == ConicOutcome.INFEASIBLE:
            infeasible = limits_exclude_each_other(self._grasp, wrench, self._limits, most, bearable)
            certificate = reach = None
            reason = f"limits exclude each other, whatever the load: {self._excluding(load, size)}"
        if solution.outcome == ConicOutcome.UNBOUNDED:
            reason = ENDLESS
        elif solution.outcome == ConicOutcome.INFEASIBLE and not infeasible:
            reason += "; exact arithmetic does not prove it"
        scaled, residual, margins = self._scaled, np.empty(6), np.empty(self._contacts)
        forces, weight = w.reshape(-1, 4), self._wanted.effort_weight
        balance(scaled.rows, scaled.center, scaled.length, wrench, weight, forces, residual, margins)
        status = SolveStatus.INFEASIBLE if infeasible else SolveStatus.MAX_ITERATIONS
        nan, used = np.full(6, math.nan), solution.iterations
        return GraspForces(
            forces, math.inf, margins, residual, nan, used, status, factor, certificate, reach, reason=reason
        )

    def _excluding(self, load: FloatArray, size: float) -> str:
        """Name coupled limits that exclude each other, none of which could be left out (Chinneck's deletion)."""
        kept = list(range(len(self._limits.names)))
        for each in tuple(kept):
            fewer = [k for k in kept if k != each]
            if (
                self._stated(Objective.LOAD_FACTOR, fewer).of(load, size).solve().outcome
                == ConicOutcome.INFEASIBLE
            ):
                kept = fewer
        return ", ".join(self._limits.names[k] for k in kept) or "bounds of normal forces"


def _check(grasp: GraspContacts) -> None:
    if not grasp.is_convex:
        raise InvalidValueError(
            f"load_exponent = {grasp.load_exponent.tolist()}, norm_exponent = {grasp.norm_exponent.tolist()}: own "
            "objectives, own limits and shared actuators are known for cones alone; give e at the force expected "
            "as spin_length, load_exponent = 0 and norm_exponent = 2"
        )
