"""What problem is solved: a grasp's forces, their limits and what is wanted of them, stated once, symbolically.

Contact i pushes the object with x_i = (f, u1, u2, u3), u = (f_t1, f_t2, tau / c): along its frame [n t1 t2] and,
as a torque, about n. In words:

    equilibrium       sum wrench(x_i) + load = 0     (load_factor: ... + theta load = 0)
    limit surface     mu f - theta >= |(|(u1, u2)|, u3 / f^gamma)|_p     (theta: max_margin only)
    bounds            f_min <= f <= f_max            (min_peak: and f <= theta)
    actuators         |J x_i| <= tau_max
    objective         min_effort  least   sum f^2 + eps |u|^2
                      max_margin  largest theta
                      min_peak    least   theta
                      load_factor largest theta

Units are the caller's, who scales: forces, lengths (so that moments are force times length), and moments about any
point. `programme` and `optimality` are derived from here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi

from palpate.grasp.problem.objective_spec import Objective

__all__ = ["ContactStatement", "cone_margin", "dual_cone_margin", "optimality", "state_contact"]

CONTACT = 16
"""Numbers of a contact: place, n, t1, t2 (three each), spin length c, friction mu, f_min, f_max."""

FORCES = 4
"""Forces of a contact: (f, u1, u2, u3)."""

WRENCH = 6
"""Equations of equilibrium: forces, then moments."""


@dataclass(frozen=True, slots=True, eq=False)
class ContactStatement:
    """One contact's share of the problem: symbols, and expressions in them.

    Attributes:
        contact: Symbol, (16,): place, n, t1, t2, c, mu, f_min, f_max; infinite f_max means none.
        actuator_rows: Symbol, (k, 4): J.
        actuator_limits: Symbol, (k,): tau_max; infinity means none.
        forces: Symbol, (4,): x = (f, u1, u2, u3).
        theta: Symbol: the number that all contacts share.
        wrench: (6,): what x does to the object.
        cone: (4,): must lie in the cone `cone_margin` >= 0: room for friction, then what uses it.
        rows: (m,): must be >= 0: the bounds, then the peak, then the actuators, each over its size.
        row_sizes: (m,): 1, or the limit where that is larger, so that infinite limits leave a row of 1.
        cost: Its share of what is to be least; that of theta is `price`.
        price: What one unit of theta costs, once for all contacts: -1, 0 or 1.
        bears_load: Whether the load enters equilibrium as it is; otherwise theta times the load does.
    """

    contact: Any
    actuator_rows: Any
    actuator_limits: Any
    forces: Any
    theta: Any
    wrench: Any
    cone: Any
    rows: Any
    row_sizes: Any
    cost: Any
    price: float
    bears_load: bool


def state_contact(
    objective: Objective, actuators: int = 0, effort_weight: float = 0.01, load_exponent: Any = 0.0
) -> ContactStatement:
    """State what one contact adds to the problem.

    Symbols and units: forces (f, u1, u2, u3) are of one unit [N], u3 = tau / c with the spin length c [m], so that
    a torque of c u3 [N m] acts about n; `contact` packs place [m], n, t1, t2, c [m], mu, f_min and f_max [N], 16
    numbers. `casadi.Function("margin", [one.contact, one.forces], [cone_margin(one.cone, 2.0)])` is the margin to
    slip in N, to be used in a programme of one's own.

    Args:
        objective: What is wanted.
        actuators: k, how many actuators stand behind the contact.
        effort_weight: eps.
        load_exponent: gamma, a number or a symbol; 0 keeps e constant and the problem convex.
    """
    contact = casadi.SX.sym("contact", CONTACT)
    place, n, t1, t2 = contact[0:3], contact[3:6], contact[6:9], contact[9:12]
    c, mu, least, most = contact[12], contact[13], contact[14], contact[15]
    rows_j = casadi.SX.sym("actuator_rows", actuators, FORCES)
    limits = casadi.SX.sym("actuator_limits", actuators)
    x, theta = casadi.SX.sym("x", FORCES), casadi.SX.sym("theta")
    f, u = x[0], x[1:4]

    force = n * f + t1 * u[0] + t2 * u[1]
    wrench = casadi.vertcat(force, casadi.cross(place, force) + n * (c * u[2]))

    room = mu * f - theta if objective is Objective.MAX_MARGIN else mu * f
    constant = isinstance(load_exponent, float) and load_exponent == 0.0
    spin = u[2] if constant else u[2] / casadi.fmax(f, TINY) ** load_exponent
    cone = casadi.vertcat(room, u[0], u[1], spin)

    rows, sizes = [_at_most(-f, -least), _at_most(f, most)], [_size(least), _size(most)]
    if objective is Objective.MIN_PEAK:
        rows.append(theta - f)
        sizes.append(casadi.SX(1.0))
    for i in range(actuators):
        loaded = rows_j[i, :] @ x
        rows += [_at_most(loaded, limits[i]), _at_most(-loaded, limits[i])]
        sizes += 2 * [_size(limits[i])]

    effort = f**2 + effort_weight * casadi.sumsqr(u)
    price = {Objective.MIN_EFFORT: 0.0, Objective.MIN_PEAK: 1.0}.get(objective, -1.0)
    return ContactStatement(
        contact,
        rows_j,
        limits,
        x,
        theta,
        wrench,
        cone,
        casadi.vertcat(*rows),
        casadi.vertcat(*sizes),
        effort if objective is Objective.MIN_EFFORT else casadi.SX(0),
        price,
        objective is not Objective.LOAD_FACTOR,
    )


def cone_margin(cone: Any, norm_exponent: Any) -> Any:
    """Return s0 - |(|(s1, s2)|, s3)|_p of a point s (4,): zero or more inside the cone of the limit surface.

    Its gradient exists everywhere: where s1, s2 or s3 are zero, so is their part of it, which is a subgradient.

    Args:
        cone: s, CasADi or numbers: of a contact `ContactStatement.cone` (room for friction, then what uses it).
        norm_exponent: p, how force and torque share, 1 to 2; 2 makes it a second-order cone.
    """
    slide, spin = casadi.sqrt(casadi.sumsqr(cone[1:3]) + TINY), casadi.sqrt(cone[3] ** 2 + TINY)
    largest = casadi.fmax(slide, spin)
    shares = (slide / largest) ** norm_exponent + (spin / largest) ** norm_exponent
    return cone[0] - largest * shares ** (1.0 / norm_exponent)


def dual_cone_margin(multiplier: Any, norm_exponent: Any) -> Any:
    """Return z0 - |(|(z1, z2)|, z3)|_q, 1/p + 1/q = 1: zero or more for multipliers z (4,) of the cone.

    With p = 1 the norm is the larger of the two; there q is replaced by 1e12, which is the same to rounding.
    """
    return cone_margin(multiplier, norm_exponent / casadi.fmax(norm_exponent - 1.0, 1e-12))


TINY = 1e-300
"""Keeps quotients of zeros finite."""


def optimality(n: int, objective: Objective, actuators: int = 0, effort_weight: float = 0.01) -> Any:
    """Return the optimality conditions of n contacts as a CasADi Function; at an optimum all of them hold.

    For constant e they are sufficient (the problem is convex), otherwise necessary.

    Returns:
        A Function of contacts (16, n), load (6,), actuator_rows (4 k, n) with each J row by row, actuator_limits
        (k, n), exponents (2, n), which are gamma and p, forces (4, n), theta, and the multipliers dual (6,),
        cone_multipliers (4, n) and row_multipliers (m, n). It gives stationarity (4 n + 1,) = 0, equilibrium (6,)
        = 0, feasibility (smallest cone margin and row, >= 0), dual_feasibility (the same of the multipliers, >=
        0), complementarity (largest product of limit and multiplier, = 0), gap (primal minus dual objective, = 0)
        and objective.
    """
    exponents, y = casadi.SX.sym("exponents", 2), casadi.SX.sym("dual", WRENCH)
    one, p = state_contact(objective, actuators, effort_weight, exponents[0]), exponents[1]
    z = casadi.SX.sym("cone_multiplier", FORCES)
    m = casadi.SX.sym("row_multiplier", one.rows.numel())
    products = casadi.vertcat(casadi.dot(z, one.cone), m * one.rows)
    lagrangian = one.cost + casadi.dot(y, one.wrench) - casadi.sum1(products)
    slope = casadi.gradient(lagrangian, casadi.vertcat(one.forces, one.theta))
    flat = casadi.reshape(one.actuator_rows.T, -1, 1)
    values = [
        slope[:FORCES],
        slope[FORCES],
        one.wrench,
        casadi.mmin(casadi.vertcat(cone_margin(one.cone, p), one.rows)),
        casadi.mmin(casadi.vertcat(dual_cone_margin(z, p), m)),
        casadi.mmax(casadi.fabs(products)),
        one.cost,
        lagrangian - slope[:FORCES].T @ one.forces - slope[FORCES] * one.theta,
    ]
    given = [one.contact, flat, one.actuator_limits, exponents, one.forces, one.theta, y, z, m]
    contact = casadi.Function("contact_optimality", given, values)

    sizes = [CONTACT, FORCES * actuators, actuators, 2, FORCES, 1, WRENCH, FORCES, one.rows.numel()]
    shared = {5, 6}
    each = [casadi.MX.sym(f"in{i}", size, 1 if i in shared else n) for i, size in enumerate(sizes)]
    found = contact.map(n)(*[casadi.repmat(a, 1, n) if i in shared else a for i, a in enumerate(each)])
    slopes, theta_slopes, wrenches, inside, dual_inside, product, costs, constants = found
    load, theta, dual = casadi.MX.sym("load", WRENCH), each[5], each[6]
    pushed = load if one.bears_load else theta * load
    # theta's own terms: its price, and the load where theta multiplies it
    on_theta = one.price + casadi.sum2(theta_slopes) + (0.0 if one.bears_load else casadi.dot(dual, load))
    primal = casadi.sum2(costs) + one.price * theta
    lower = casadi.sum2(constants) + (casadi.dot(dual, load) if one.bears_load else 0.0)
    contacts, flat, limits, exponents, forces, theta, dual, z, m = each
    return casadi.Function(
        "optimality",
        [contacts, load, flat, limits, exponents, forces, theta, dual, z, m],
        [
            casadi.vertcat(casadi.vec(slopes), on_theta),
            casadi.sum2(wrenches) + pushed,
            casadi.mmin(inside),
            casadi.mmin(dual_inside),
            casadi.mmax(product),
            primal - lower,
            primal,
        ],
        [
            *("contacts", "load", "actuator_rows", "actuator_limits", "exponents"),
            *("forces", "theta", "dual", "cone_multipliers", "row_multipliers"),
        ],
        ["stationarity", "equilibrium", "feasibility", "dual_feasibility", "complementarity", "gap", "objective"],
    )


def _size(limit: Any) -> Any:
    return casadi.fmax(casadi.fabs(limit), 1.0)


def _at_most(value: Any, limit: Any) -> Any:
    """What is left up to a limit, over its size: 1 if it is infinite."""
    return casadi.fmax(casadi.fmin(limit, 1.0), -1.0) - value / _size(limit)
