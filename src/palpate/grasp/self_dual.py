"""One iteration of a primal-dual interior point method on a grasp, as a CasADi graph.

The convex problem of `statement` is embedded in a homogeneous self-dual one (Goulart & Chen 2024, "Clarabel", for
quadratic objectives): tau scales everything, and either tau stays positive and v / tau is optimal, or kappa does
and what is left is a proof that there are no forces (or that theta has no limit). With a contact's v in its cone,
slacks s of its rows, and multipliers y of equilibrium and z of the limits:

    P v + A'y - z_cone - R'z_rows = 0            for each contact
    q tau + B'y - sum t'z_rows = 0               for theta
    sum A v + B theta + b tau = 0                equilibrium
    s = R v + t theta + h tau                    rows
    kappa = -(v'P v / tau + q theta - b'y + sum h'z_rows)

Steps are Mehrotra's, with Nesterov-Todd scaling (Nesterov & Todd 1997); each contact is eliminated by itself
(`contact_step`), which leaves eight equations (`bordered`). Work and memory are linear in the number of contacts,
the size of the code does not depend on it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi

from palpate.grasp.bordered import Bordered
from palpate.grasp.contact_problem import kernel
from palpate.grasp.contact_step import ContactStep
from palpate.grasp.objective import Objective
from palpate.grasp.record import RecordLayout
from palpate.grasp.statement import CONTACT, FORCES, WRENCH, state_contact

__all__ = ["SelfDual", "self_dual"]

SX, MX = casadi.SX, casadi.MX

SETTLED = 1e-4
"""Kappa over tau below which there is a solution, and tau stays: what moves it then is rounding."""

RESIDUAL = 1e-9
"""Largest residual of a solution, over the load's scale."""

GAP = 1e-8
"""Largest difference between what a solution costs and what at least it must, relative."""

SMALL = 1e-3
"""Objective, over that of the load's scale, below which the gap counts absolutely."""

OTHER_LOAD = 3e-10
"""Share of the load by which another may differ whose optimum it is, where no better is found: next to the largest
load that is held cost grows by multipliers without bound, and rounding lets no gap be smaller than that."""

TINY = 1e-300
"""Keeps quotients of zeros finite."""


@dataclass(frozen=True, slots=True, eq=False)
class SelfDual:
    """The graphs for n contacts; each contact is a column.

    Attributes:
        begin: (contacts, load, actuator_rows, actuator_limits, shy) -> (data, points, shared): scales, and starts;
            shy is the share of the distance to the boundary of the cones that a step goes.
        iterate: (data, points, shared) -> (points, shared).
        finish: (contacts, actuator_rows, actuator_limits, points, shared) -> (forces, multipliers, theta, dual).
        shared: What `shared` holds: among others `error`, the residuals and the gap over their tolerances;
            `doubt`, what multipliers lack of a proof over what they would prove; `drift`, the same of forces with
            which theta grows for ever.
        data: Numbers of a column of `data`.
        points: Numbers of a column of `points`.
        multipliers: Numbers of a column of `multipliers`.
    """

    begin: Any
    iterate: Any
    finish: Any
    shared: RecordLayout
    data: int
    points: int
    multipliers: int


SHARED = RecordLayout(
    y=WRENCH, theta=1, tau=1, kappa=1, r_y=WRENCH, r_theta=1, r_tau=1, mu=1, quadratic=1, load=WRENCH, push=WRENCH,
    idle=21, scale=1, shy=1, primal=1, gap=1, error=1, error_of_other=1, doubt=1, drift=1,
)  # fmt: skip


def self_dual(n: int, objective: Objective, actuators: int, effort_weight: float) -> SelfDual:
    """Build the graphs for n contacts with k actuators each."""
    one = state_contact(objective, actuators, effort_weight)
    contact = ContactStep(one)
    shared = _Shared(contact)
    return SelfDual(
        _begin(n, actuators, contact, shared),
        _iterate(n, contact, shared),
        _finish(n, actuators, contact, shared),
        SHARED,
        contact.problem.data.size,
        contact.problem.point.size,
        contact.problem.limits,
    )


class _Shared:
    """Functions of what all contacts share."""

    def __init__(self, contact: ContactStep) -> None:
        self._contact, self._price = contact, contact.problem.one.price
        self._bears_load = contact.problem.one.bears_load
        self._border = Bordered(has_theta=self._price != 0.0)

    def summed(self) -> Any:
        """(before, y, theta, tau, kappa, sums, worst, n) -> shared, with its residuals."""
        before = SX.sym("before", SHARED.size)
        y, theta, tau, kappa = SX.sym("y", WRENCH), SX.sym("theta"), SX.sym("tau"), SX.sym("kappa")
        sums, worst, n = SX.sym("sums", WRENCH + 4), SX.sym("worst", 4), SX.sym("n")
        given = SHARED.parts(before)
        pushed, t_z, h_z, complementarity, quadratic = casadi.vertsplit(sums, [0, 6, 7, 8, 9, 10])
        b, B, q = self._load(given), given["push"], self._price
        has_theta = q != 0.0
        r_y = -(pushed + B * theta + b * tau)
        unproved = casadi.dot(B, y) - t_z if has_theta else SX(0.0)
        r_theta = -(q * tau + unproved) if has_theta else SX(0.0)
        earned = casadi.dot(b, y) - h_z
        value, bound = 0.5 * quadratic / tau**2 + q * theta / tau, -0.5 * quadratic / tau**2 + earned / tau
        excess = casadi.fmax(casadi.fabs(value - bound), complementarity / tau**2)
        cost = casadi.fmax(casadi.fabs(value), SMALL)
        gap = excess / cost
        moved = OTHER_LOAD * casadi.mmax(casadi.fabs(y)) / tau if self._bears_load else SX(0.0)
        primal = casadi.fmax(casadi.mmax(casadi.fabs(r_y)), worst[1]) / tau
        dual = casadi.fmax(casadi.fabs(r_theta), worst[0]) / (tau + casadi.mmax(casadi.fabs(y)))
        drift = casadi.fmax(casadi.mmax(casadi.fabs(pushed + B * theta)), worst[3])
        values = SHARED.pack(
            y=y, theta=theta, tau=tau, kappa=kappa, r_y=r_y, r_theta=r_theta,
            r_tau=-(kappa + quadratic / tau + q * theta - earned),
            mu=(complementarity + tau * kappa) / (n * (1 + self._contact.problem.limits - FORCES) + 1),
            quadratic=quadratic, load=given["load"], push=B, idle=given["idle"],
            scale=given["scale"], shy=given["shy"],
            primal=primal, gap=gap,
            error=(primal + dual) / RESIDUAL + gap / GAP,  # a sum: fmax would hide what is not a number
            error_of_other=primal / OTHER_LOAD + dual / RESIDUAL + excess / casadi.fmax(GAP * cost, moved),
            doubt=casadi.fmax(worst[2], casadi.fabs(unproved)) / casadi.fmax(earned, TINY),
            drift=drift / casadi.fmax(-q * theta, TINY),
        )  # fmt: skip
        return kernel("summed", [before, y, theta, tau, kappa, sums, worst, n], [values])

    def idle(self) -> Any:
        """(lower triangle of A A', summed) -> that of the projection on wrenches that no contact pushes."""
        reach = SX.sym("reach", WRENCH * (WRENCH + 1) // 2)
        return kernel("idle", [reach], [self._border.unreached(reach)])

    def bordered(self) -> Any:
        """(sums, shared) -> matrix of the equations in (y, theta, tau), and its factors."""
        sums, shared = SX.sym("sums", self._contact.elimination.sums.size), SX.sym("shared", SHARED.size)
        a, g = self._contact.elimination.sums.parts(sums), SHARED.parts(shared)
        b, q = self._load(g), self._price
        matrix = self._border.matrix.pack(
            m=a["m"],
            g=g["push"] - a["a_theta"],
            p=b - a["a_tau"],
            l=-b + a["a_tau"] - a["a_slope"],
            c=casadi.vertcat(
                a["theta_theta"],
                q + a["theta_tau"],
                q + a["tau_theta"],
                a["tau_tau"] - g["quadratic"] / g["tau"] ** 2 - g["kappa"] / g["tau"],
            ),
            moves=g["kappa"] > SETTLED * g["tau"],
        )
        return kernel("bordered", [sums, shared], [matrix, self._border.factored(matrix, g["idle"])])

    def directed(self) -> Any:
        """(matrix, factor, right, shared, left, bend) -> steps of (y, theta, tau), and of kappa."""
        matrix, factor, shared, left = self._symbols()
        right, bend = SX.sym("right", self._contact.elimination.right.size), SX.sym("bend")
        r, g = self._contact.elimination.right.parts(right), SHARED.parts(shared)
        y, theta, tau = self._border.refined(
            matrix,
            factor,
            r["y"] - left * g["r_y"],
            left * g["r_theta"] + r["theta"],
            left * g["r_tau"] - bend / g["tau"] + r["tau"],
        )
        direction = self._contact.problem.direction.pack(y=y, theta=theta, tau=tau)
        kappa = (bend - g["kappa"] * tau) / g["tau"]
        return kernel("directed", [matrix, factor, right, shared, left, bend], [direction, kappa])

    def mended(self) -> Any:
        """(matrix, factor, shared, left, pushed, direction) -> what (y, theta, tau) and kappa still lack."""
        matrix, factor, shared, left = self._symbols()
        pushed, direction = SX.sym("pushed", WRENCH), SX.sym("direction", self._contact.problem.direction.size)
        g, d = SHARED.parts(shared), self._contact.problem.direction.parts(direction)
        lacking = pushed + g["push"] * d["theta"] + self._load(g) * d["tau"] - left * g["r_y"]
        y, theta, tau = self._border.solved(matrix, factor, lacking, SX(0.0), SX(0.0))
        more = self._contact.problem.direction.pack(y=y, theta=theta, tau=tau)
        given = [matrix, factor, shared, left, pushed, direction]
        return kernel("mended", given, [more, -g["kappa"] * tau / g["tau"]])

    def unit_of_dual(self, scale: Any) -> Any:
        """Objective over load: of min_effort the load, of load_factor one over it, otherwise one."""
        if self._contact.problem.quadratic:
            return scale
        return 1.0 if self._bears_load else 1.0 / scale

    def unit_of_theta(self, scale: Any) -> Any:
        """A force, but of load_factor one."""
        return scale if self._bears_load else 1.0

    def push(self, load: Any, by_contacts: Any) -> Any:
        """What theta pushes: contacts, and the load where theta multiplies it."""
        return by_contacts if self._bears_load else by_contacts + load

    def _load(self, shared: dict[str, Any]) -> Any:
        return shared["load"] if self._bears_load else SX.zeros(WRENCH)

    def _symbols(self) -> tuple[Any, Any, Any, Any]:
        border = self._border
        matrix, factor = SX.sym("matrix", border.matrix.size), SX.sym("factor", border.factor.size)
        return matrix, factor, SX.sym("shared", SHARED.size), SX.sym("left")


def _moved(n: int, contact: ContactStep, *given: Any) -> tuple[Any, Any, Any]:
    new, sums, worst = contact.problem.moved().map("moved_all", "serial", n, [3, 4, 5, 6], [1])(*given)
    return new, sums, casadi.vertcat(*[casadi.mmax(each) for each in casadi.vertsplit(worst)])


def _begin(n: int, actuators: int, contact: ContactStep, shared: _Shared) -> Any:
    contacts, load = MX.sym("contacts", CONTACT, n), MX.sym("load", WRENCH)
    rows, limits = MX.sym("actuator_rows", FORCES * actuators, n), MX.sym("actuator_limits", actuators, n)
    shy = MX.sym("shy")
    size = casadi.fmax(casadi.norm_2(load), casadi.mmax(contacts[CONTACT - 2, :]))
    scale = casadi.if_else(size > 0.0, size, 1.0)
    data, push, reach = contact.problem.prepared().map("prepared_all", "serial", n, [3], [1, 2])(
        contacts, rows, limits, scale
    )
    start, still = casadi.repmat(contact.problem.start(), 1, n), MX.zeros(contact.problem.steps.size, n)
    points, sums, worst = _moved(n, contact, data, start, still, 0.0, MX.zeros(WRENCH), 0.0, 1.0)
    nothing = {name: MX.zeros(where.stop - where.start) for name, where in SHARED.where.items()}
    given = nothing | {"load": load / scale, "push": shared.push(load / scale, push), "scale": scale, "shy": shy}
    given["idle"] = shared.idle()(reach)
    first = shared.summed()(SHARED.pack(**given), MX.zeros(WRENCH), 0.0, 1.0, 1.0, sums, worst, n)
    return casadi.Function("begin", [contacts, load, rows, limits, shy], [data, points, first])


def _iterate(n: int, contact: ContactStep, common: _Shared) -> Any:
    data, points = MX.sym("data", contact.problem.data.size, n), MX.sym("points", contact.problem.point.size, n)
    shared = MX.sym("shared", SHARED.size)
    now = SHARED.parts(shared)
    kept, sums, right = contact.elimination.eliminated().map("eliminated_all", "serial", n, [2], [1, 2])(
        data, points, now["tau"]
    )
    matrix, factor = common.bordered()(sums, shared)
    directed = common.directed()

    bend = -now["tau"] * now["kappa"]
    direction, kappa = directed(matrix, factor, right, shared, 1.0, bend)
    predicted = contact.problem.direction.parts(direction)["tau"]
    aims, by_correction, by_centering, each = contact.aimed().map("aimed_all", "serial", n, [3, 4], [1, 2])(
        data, points, kept, direction, now["mu"]
    )
    blocked = _blocked(now, predicted, kappa, each)
    sigma = (1.0 - 1.0 / casadi.fmax(1.0, blocked)) ** 3

    bend += sigma * now["mu"] - predicted * kappa
    right += by_correction + sigma * by_centering
    direction, kappa = directed(matrix, factor, right, shared, 1.0 - sigma, bend)
    tried, pushed = contact.tried().map("tried_all", "serial", n, [4, 5], [1])(
        data, points, kept, aims, direction, sigma
    )
    mend, kappa_mend = common.mended()(matrix, factor, shared, 1.0 - sigma, pushed, direction)
    steps, each = contact.stepped().map("stepped_all", "serial", n, [4, 5, 7], [])(
        data, points, kept, aims, direction, sigma, tried, mend
    )
    along, kappa = contact.problem.direction.parts(direction + mend), kappa + kappa_mend
    length = 1.0 / casadi.fmax(1.0, _blocked(now, along["tau"], kappa, each) / now["shy"])

    y, theta, tau = (now[name] + length * along[name] for name in ("y", "theta", "tau"))
    there, sums, worst = _moved(n, contact, data, points, steps, length, y, theta, tau)
    then = common.summed()(shared, y, theta, tau, now["kappa"] + length * kappa, sums, worst, n)
    return casadi.Function("iterate", [data, points, shared], [there, then])


def _blocked(now: dict[str, Any], tau: Any, kappa: Any, each: Any) -> Any:
    return casadi.fmax(casadi.fmax(-tau / now["tau"], -kappa / now["kappa"]), casadi.mmax(each))


def _finish(n: int, actuators: int, contact: ContactStep, shared: _Shared) -> Any:
    contacts, points = MX.sym("contacts", CONTACT, n), MX.sym("points", contact.problem.point.size, n)
    rows, limits = MX.sym("actuator_rows", FORCES * actuators, n), MX.sym("actuator_limits", actuators, n)
    values = MX.sym("shared", SHARED.size)
    now = SHARED.parts(values)
    tau, scale = now["tau"], now["scale"]
    forces, multipliers = contact.problem.finished(shared.unit_of_dual).map(
        "finished_all", "serial", n, [4, 5, 6], []
    )(contacts, rows, limits, points, now["theta"], tau, scale)
    theta = now["theta"] * shared.unit_of_theta(scale) / tau
    dual = now["y"] * (shared.unit_of_dual(scale) / tau)
    return casadi.Function("finish", [contacts, rows, limits, points, values], [forces, multipliers, theta, dual])
