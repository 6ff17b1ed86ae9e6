"""The nonlinear programme of grasp forces, for limits that are no cones: `statement`, solved by ipopt."""

from functools import lru_cache
from typing import Any

import casadi
import numpy as np

from palpate.errors import FloatArray
from palpate.grasp.problem.objective import Objective
from palpate.grasp.problem.statement import CONTACT, FORCES, WRENCH, state_contact

__all__ = ["programme"]

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
