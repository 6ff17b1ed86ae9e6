"""Grasp forces under limits that are no cones: e grows with the load, or force and torque share otherwise (p < 2).

With gamma > 0 the loads that a contact bears are no convex set. First come convex problems from the inside: cones
that touch the limit surfaces at the last forces (`inscribed`), until those stay. From there the nonlinear
programme goes on (`programme`). Whatever it finds is made exact by one more convex problem, in which no contact
presses less, so that e is at least what is counted on; the best of all that keeps the true limits is the result.
"""

import math
from dataclasses import replace
from functools import lru_cache
from typing import Any

import casadi
import numpy as np

from palpate.errors import FloatArray
from palpate.grasp.problem.contacts import GraspContacts
from palpate.grasp.problem.inscribed import inscribed
from palpate.grasp.problem.objective_spec import Objective
from palpate.grasp.problem.result import GraspForces, SolveStatus
from palpate.grasp.problem.scaled import ScaledGrasp
from palpate.grasp.problem.statement import CONTACT, FORCES, WRENCH, state_contact
from palpate.grasp.solvers.convex import Convex
from palpate.grasp.solvers.dual_newton import RESERVE

__all__ = ["Curved", "programme"]

ROUND = 1e-6
"""Friction force and torque are each taken for sqrt(x^2 + ROUND^2), over the load: the norm's corner gets a slope.
It only makes the limit stricter."""

MIN_NORMAL_FORCE = 1e-6
"""Normal force, over the load, below which e shrinks no more: there f^gamma has no slope."""

OPTIONS: Any = {
    "print_time": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.bound_relax_factor": 0.0,  # the default of 1e-8 lets limits be violated
    "ipopt.tol": 1e-9,
    "ipopt.constr_viol_tol": 1e-10,
    "ipopt.max_iter": 150,
    "ipopt.warm_start_init_point": "yes",
    "ipopt.mu_init": 1e-3,
}


@lru_cache(maxsize=32)
def programme(n: int, objective: Objective, actuators: int, effort_weight: float) -> Any:
    """Return a CasADi solver of n contacts.

    Unknowns are (f, u1, u2, u3) of each contact and theta. Parameters are, contact by contact, the 16 numbers of
    `statement`, gamma, p, and by what e at a scaled force of 1 exceeds the spin length; then the load and, if
    there are any, actuator rows and limits. Constraints: equilibrium = 0, then limits >= 0.
    """
    gamma, p, ratio = casadi.SX.sym("gamma"), casadi.SX.sym("p"), casadi.SX.sym("ratio")
    one = state_contact(objective, actuators, effort_weight)
    f, u = one.forces[0], one.forces[1:4]
    grown = ratio * casadi.fmax(f, MIN_NORMAL_FORCE) ** gamma
    slide2, spin2 = casadi.sumsqr(u[:2]) + ROUND**2, (u[2] / grown) ** 2 + ROUND**2
    used = (slide2 ** (0.5 * p) + spin2 ** (0.5 * p)) ** (1.0 / p)
    flat = casadi.reshape(one.actuator_rows.T, -1, 1)
    contact = casadi.Function(
        "contact",
        [one.forces, one.theta, casadi.vertcat(one.contact, gamma, p, ratio), flat, one.actuator_limits],
        [one.cost, one.wrench, casadi.vertcat(one.cone[0] - used, one.rows)],
    )
    x, theta = casadi.SX.sym("x", FORCES, n), casadi.SX.sym("theta")
    given = casadi.SX.sym("given", CONTACT + 3, n)
    load = casadi.SX.sym("load", WRENCH)
    rows, limits = casadi.SX.sym("rows", FORCES * actuators, n), casadi.SX.sym("limits", actuators, n)
    cost, wrench, room = one.price * theta, (load if one.bears_load else theta * load), []
    for i in range(n):
        part, pushed, left = contact(x[:, i], theta, given[:, i], rows[:, i], limits[:, i])
        cost, wrench = cost + part, wrench + pushed
        room.append(left)
    everything = casadi.vertcat(casadi.vec(x), theta)
    parameters = casadi.vertcat(casadi.vec(given), load, casadi.vec(rows), casadi.vec(limits))
    if objective is Objective.MIN_EFFORT:
        cost += theta**2  # which nothing else mentions
    stated: Any = {"x": everything, "p": parameters, "f": cost, "g": casadi.vertcat(wrench, *room)}
    return casadi.nlpsol("grasp", "ipopt", stated, OPTIONS)


def solve(
    solver: Any,
    contacts: FloatArray,
    load: FloatArray,
    actuator_rows: FloatArray | None,
    actuator_limits: FloatArray | None,
    start: FloatArray,
    theta: float,
) -> FloatArray:
    """Return scaled forces (n, 4) near a local optimum, as far as it came; limits may be violated.

    Args:
        solver: What `programme` made.
        contacts: Its parameters, shape (n, 19).
        load: Scaled, shape (6,).
        actuator_rows: Shape (n, k, 4).
        actuator_limits: Shape (n, k).
        start: Scaled forces, shape (n, 4).
        theta: Where theta starts.
    """
    more = (
        []
        if actuator_rows is None or actuator_limits is None
        else [actuator_rows.ravel(), actuator_limits.ravel()]
    )
    rooms = solver.size1_out("g") - WRENCH
    found = solver(
        x0=np.append(start.ravel(), theta),
        p=np.concatenate([contacts.ravel(), load, *more]),
        lbg=np.zeros(WRENCH + rooms),
        ubg=np.concatenate([np.zeros(WRENCH), np.full(rooms, np.inf)]),
    )
    return np.array(found["x"]).ravel()[:-1].reshape(-1, FORCES)


PASSES = 30
"""Convex problems until the cones stay; 3 to 10 are usual."""

STAYS = 1e-7
"""Change of forces, over the largest, at which cones are taken to stay."""

LESS = 0.99
"""As long as no more than this share of what was left of a load is left with the next cones, they are moved on."""

FIRST = (1.0, 8.0)
"""Where the cones first touch: at loads of so many times the load's own size on every contact. The second is for
loads that only larger contacts bear."""

KEEPS = 1e-9
"""Share of the load by which a limit may be violated by rounding."""

LIGHTER = 1e-6
"""By how much less than found each contact may press when forces are made exact."""


class Curved:
    """Solves one load after another, for any limit surface."""

    def __init__(self, grasp: GraspContacts, objective: Objective, effort_weight: float) -> None:
        """Derive and compile, so that solving need not."""
        self._objective, self._weight = objective, effort_weight
        self._convex: Convex | None = None
        self.update(grasp)

    def update(self, grasp: GraspContacts) -> None:
        """Take contacts that have moved, come or gone."""
        self._grasp = grasp
        self._scaled = ScaledGrasp.of(grasp)
        cones = inscribed(grasp, np.tile([1.0, 0.0, 0.0, 0.0], (len(grasp), 1)))
        if self._convex is None:
            self._convex = Convex(cones, self._objective, self._weight)
        else:
            self._convex.update(cones)
        k = 0 if grasp.actuator_limit is None else grasp.actuator_limit.shape[1]
        self._programme = programme(len(grasp), self._objective, k, self._weight)
        self._last: FloatArray | None = None

    def solve(self, wrench: FloatArray, *, warm: bool) -> GraspForces:
        """Return the forces for a finite load, shape (6,) [N, N m]."""
        size = self._scaled.load(wrench)[1]
        starts = [np.tile([factor * size, 0.0, 0.0, 0.0], (len(self._grasp), 1)) for factor in FIRST]
        if warm and self._last is not None:
            starts.insert(0, self._last)
        tried, best = [], None
        for start in starts:
            found = self._from_inside(start, wrench, size)
            tried.append(found)
            best = self._better(best, found, wrench, size)
        for each in tried:
            if each.status is SolveStatus.SOLVED:
                better = self._exact(self._by_programme(each, wrench), wrench)
                best = self._better(best, better, wrench, size)
        if best is None:
            return self._refused(tried, wrench)
        self._last = best.forces
        return best

    def _from_inside(self, start: FloatArray, wrench: FloatArray, size: float) -> GraspForces:
        """Return the forces at which inscribed cones stay; they may press less than those counted on."""
        forces, before, left = start, np.inf, np.inf
        for _ in range(PASSES):
            found = self._solve(inscribed(self._grasp, forces), wrench)
            if found.status is not SolveStatus.SOLVED:
                # cones that touch where least of the load is left may bear all of it
                still = float(np.linalg.norm(found.equilibrium_residual))
                if not still < LESS * left:
                    return found
                forces, left = found.forces, still
                continue
            moved = float(np.abs(found.forces[:, 0] - forces[:, 0]).max())
            forces = found.forces if moved < before else 0.5 * (forces + found.forces)
            before = moved
            if moved <= STAYS * max(size, float(np.abs(forces[:, 0]).max())):
                break
        return self._exact(forces, wrench)

    def _exact(self, forces: FloatArray, wrench: FloatArray) -> GraspForces:
        """Return the best forces in the cones at `forces` among those that press no less: they keep the limits."""
        least = np.clip(forces[:, 0] * (1.0 - LIGHTER), self._grasp.force_min, self._grasp.force_max)
        at = np.column_stack([least, forces[:, 1:]])
        cones = inscribed(self._grasp, at)
        return self._solve(
            replace(cones, force_min=np.where(self._grasp.load_exponent > 0.0, least, cones.force_min)), wrench
        )

    def _solve(self, cones: GraspContacts, wrench: FloatArray) -> GraspForces:
        assert self._convex is not None
        self._convex.update(cones)
        return self._convex.solve(wrench, warm=True)

    def _by_programme(self, found: GraspForces, wrench: FloatArray) -> FloatArray:
        grasp, scaled = self._grasp, self._scaled
        load, size = scaled.load(wrench)
        maps, limits = None, None
        if grasp.actuator_map is not None and grasp.actuator_limit is not None:
            maps, limits = scaled.actuators(grasp.actuator_map, grasp.actuator_limit, size)
        contacts = np.column_stack(
            [scaled.sized(size)[:, :RESERVE], grasp.load_exponent, grasp.norm_exponent, size**grasp.load_exponent]
        )
        start = found.forces / size
        start[:, 3] /= grasp.spin_length
        theta = 0.0 if self._objective is Objective.MIN_EFFORT else self._value(found)
        if self._objective in (Objective.MAX_MARGIN, Objective.MIN_PEAK):
            theta /= size
        forces = solve(self._programme, contacts, load, maps, limits, start, theta)
        return scaled.forces(forces, size)

    def _value(self, found: GraspForces) -> float:
        """The objective of forces under the true limits."""
        forces = found.forces
        match self._objective:
            case Objective.MIN_EFFORT:
                u2 = (forces[:, 1:3] ** 2).sum() + ((forces[:, 3] / self._grasp.spin_length) ** 2).sum()
                return float((forces[:, 0] ** 2).sum() + self._weight * u2)
            case Objective.MAX_MARGIN:
                return float(self._grasp.margins(forces).min())
            case Objective.MIN_PEAK:
                return float(forces[:, 0].max())
        return float(found.load_factor or 0.0)

    def _better(
        self, best: GraspForces | None, found: GraspForces, wrench: FloatArray, size: float
    ) -> GraspForces | None:
        """Return the better of two of which the first keeps the limits; None if neither does."""
        if found.status is not SolveStatus.SOLVED:
            return best
        margins = self._grasp.margins(found.forces)
        if margins.min() < -KEEPS * size:
            return best
        value = self._value(found)
        larger = self._objective in (Objective.MAX_MARGIN, Objective.LOAD_FACTOR)
        if best is not None and (value <= best.objective if larger else value >= best.objective):
            return best
        return replace(found, objective=value, margin=margins, local=True)

    def _refused(self, tried: list[GraspForces], wrench: FloatArray) -> GraspForces:
        """Return what is known of a load for which no forces were found: what leaves least of it, within limits.

        It is infeasible for certain if larger limits, which are cones, cannot hold it either.
        """
        left = min(tried, key=lambda each: float(np.linalg.norm(each.equilibrium_residual)))
        forces = self._exact(left.forces, wrench)
        result = replace(
            forces,
            objective=math.inf,
            margin=self._grasp.margins(forces.forces),
            load_factor=None,
            certificate=None,
        )
        around = self._around()
        proof = None if around is None else self._solve(around, wrench).certificate
        status = SolveStatus.MAX_ITERATIONS if proof is None else SolveStatus.INFEASIBLE
        return replace(result, status=status, certificate=proof)

    def _around(self) -> GraspContacts | None:
        """Return cones around all limit surfaces; None where e grows without end."""
        grasp = self._grasp
        grows = grasp.load_exponent > 0.0
        if not np.isfinite(grasp.force_max[grows]).all():
            return None
        length = grasp.spin_length * np.where(grows, grasp.force_max, 1.0) ** grasp.load_exponent
        zero = np.zeros(len(grasp))
        return replace(grasp, spin_length=length, load_exponent=zero, norm_exponent=zero + 2.0)
