"""Proofs that no forces hold a load.

Multipliers y prove that no forces hold the load if y . (sum wrench(x_i) + load) > 0 for all x within the limits.
For one contact and given y the least of y . wrench(x) is known in closed form: with g = A'y it is f (g_n - mu
|g_u|) at f_min or f_max. Nothing of how y was found enters, so that what is claimed is true to rounding.
"""

from __future__ import annotations

from typing import Any

import casadi

from palpate.grasp.objective import Objective
from palpate.grasp.statement import CONTACT, FORCES, WRENCH, state_contact

__all__ = ["LARGEST_FORCES", "proof_value"]

LARGEST_FORCES = 1e8
"""Sum of forces, in units of load or preload, for which a proof must hold where f_max is infinite: to rounding,
none is without doubt for all."""


def proof_value(n: int, objective: Objective, actuators: int) -> Any:
    """Return a Function: by how much multipliers y prove that a load cannot be held; a proof if above zero.

    Actuator limits are taken off with multipliers of their own, of whatever value. For max_margin friction may be
    as large as the normal forces (theta is free), for the others it is at most mu f.

    Returns:
        A Function of contacts (16, n), load (6,), actuator_rows (4 k, n), actuator_limits (k, n), y (6,) and
        actuator multipliers (2 k, n), those of J x <= limit and -J x <= limit by turns.
    """
    one = state_contact(objective, actuators)
    y, z = casadi.SX.sym("y", WRENCH), casadi.SX.sym("z", 2 * actuators)
    mu, least, most = (one.contact[i] for i in (CONTACT - 3, CONTACT - 2, CONTACT - 1))
    flat = casadi.reshape(one.actuator_rows.T, -1, 1)
    slope = casadi.jacobian(one.wrench, one.forces).T @ y
    total = casadi.SX(0.0)
    for i in range(actuators):
        bounded = one.actuator_limits[i] < casadi.inf
        size = one.row_sizes[-2 * actuators + 2 * i]  # rows are over their sizes
        up, down = (
            casadi.if_else(bounded, casadi.fmax(each, 0.0) / size, 0.0) for each in (z[2 * i], z[2 * i + 1])
        )
        slope += one.actuator_rows[i, :].T * (up - down)
        total -= (up + down) * casadi.if_else(bounded, one.actuator_limits[i], 0.0)
    sideways = casadi.norm_2(slope[1:])
    if objective is Objective.MAX_MARGIN:
        pays, wrong = slope[0], sideways
    else:
        pays, wrong = slope[0] - mu * sideways, casadi.SX(0.0)
    endless = (most == casadi.inf) * (pays < 0.0)
    ends = casadi.if_else(pays < 0.0, casadi.if_else(endless, 0.0, most), least)
    total += pays * ends
    wrong += casadi.if_else(endless, -pays, 0.0)
    contact = casadi.Function("contact_proof", [one.contact, flat, one.actuator_limits, y, z], [total, wrong])
    contacts, load = casadi.MX.sym("contacts", CONTACT, n), casadi.MX.sym("load", WRENCH)
    rows = casadi.MX.sym("actuator_rows", FORCES * actuators, n)
    limits = casadi.MX.sym("actuator_limits", actuators, n)
    dual, multipliers = casadi.MX.sym("y", WRENCH), casadi.MX.sym("z", 2 * actuators, n)
    gained, wrongs = contact.map("contact_proof_map", "serial", n, [3], [0])(
        contacts, rows, limits, dual, multipliers
    )
    value = casadi.dot(dual, load) + gained - LARGEST_FORCES * casadi.mmax(wrongs)
    return casadi.Function("proof_value", [contacts, load, rows, limits, dual, multipliers], [value])
