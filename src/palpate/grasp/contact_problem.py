"""One contact as the interior point method sees it: what does not change, its point, and what that lacks.

Its variable v is the point of its cone, v = (mu f - theta, u) for max_margin and (mu f, u) for the others, so that
all contacts have the same cone and it does not depend on theta; its limits are rows s = R v + t theta + h tau.
"""

from __future__ import annotations

from typing import Any

import casadi

from palpate.grasp.record import RecordLayout
from palpate.grasp.statement import CONTACT, FORCES, WRENCH, ContactStatement

__all__ = ["ContactProblem", "kernel"]

SX = casadi.SX


class ContactProblem:
    """Matrices and vectors of one contact, and functions that no elimination is needed for.

    Attributes:
        one: The statement that all is derived from.
        quadratic: Whether there is a P.
        rows: Number of rows.
        bounds: Rows that hold f alone.
        others: The other rows.
        data: What does not change: A (6, 4) by columns, weights of P, entries of R, h, and the sizes of rows.
        point: v, slack s of the rows, multipliers z of cone and rows, and what the linear equations lack.
        steps: Steps of v, s and z.
        direction: Steps of y, theta and tau.
    """

    def __init__(self, one: ContactStatement) -> None:
        """Derive all matrices from the statement."""
        self.one = one
        self.rows: int = one.rows.numel()
        self.quadratic = one.price == 0.0
        # x = V^-1 (v - tc theta)
        inverse = casadi.inv(casadi.jacobian(one.cone, one.forces))
        self._inverse, self._shift = inverse, casadi.jacobian(one.cone, one.theta)
        self._pushes = casadi.densify(casadi.jacobian(one.wrench, one.forces) @ inverse)
        self._reach = casadi.jacobian(one.rows, one.forces) @ inverse
        self._t = casadi.jacobian(one.rows, one.theta)
        self._h = casadi.substitute(one.rows, casadi.vertcat(one.forces, one.theta), SX.zeros(FORCES + 1))
        curvature = casadi.diag(casadi.hessian(one.cost, one.forces)[0]) * casadi.diag(inverse) ** 2
        self._weights = curvature[:2]  # the three of u are the same
        self.bounds = [i for i in range(self.rows) if self._reach[i, 1:].nnz() == 0]
        self.others = [i for i in range(self.rows) if i not in self.bounds]
        m = self.rows
        self.data = RecordLayout(pushes=WRENCH * FORCES, weights=2, reach=self._reach.nnz(), h=m, units=m)
        self.point = RecordLayout(v=FORCES, s=m, z=FORCES + m, r_v=FORCES, r_s=m)
        self.steps = RecordLayout(v=FORCES, s=m, z=FORCES + m)
        self.direction = RecordLayout(y=WRENCH, theta=1, tau=1)

    @property
    def limits(self) -> int:
        """Number of multipliers: the cone's and the rows'."""
        return FORCES + self.rows

    def prepared(self) -> Any:
        """(contact, actuator rows, limits, scale) -> (data, what theta pushes, lower triangle of A A')."""
        one, scale = self.one, SX.sym("scale")
        contact = casadi.vertcat(one.contact[: CONTACT - 2], one.contact[CONTACT - 2 :] / scale)
        units = casadi.if_else(one.row_sizes < casadi.inf, one.row_sizes, 1.0)
        given = [self._pushes, self._weights, casadi.vertcat(*self._reach.nonzeros()), self._h, units]
        pushes, weights, reach, h, units = casadi.substitute(
            given, [one.contact, one.actuator_limits], [contact, one.actuator_limits / scale]
        )
        data = self.data.pack(pushes=casadi.vec(pushes), weights=weights, reach=reach, h=h, units=units)
        arguments = [one.contact, casadi.vec(one.actuator_rows.T), one.actuator_limits, scale]
        square = pushes @ pushes.T
        reach_of_all = casadi.vertcat(*[square[i, j] for i in range(WRENCH) for j in range(i + 1)])
        return kernel("prepared", arguments, [data, -pushes @ self._shift, reach_of_all])

    def start(self) -> Any:
        """The middle of all cones."""
        middle = casadi.vertcat(1.0, casadi.DM.zeros(FORCES - 1))
        ones = casadi.DM.ones(self.rows)
        return self.point.pack(
            v=middle, s=ones, z=casadi.vertcat(middle, ones), r_v=casadi.DM.zeros(FORCES), r_s=0 * ones
        )

    def finished(self, unit_of_dual: Any) -> Any:
        """(contact, actuator rows, limits, point, theta, tau, scale) -> (forces, multipliers)."""
        one, point = self.one, SX.sym("point", self.point.size)
        theta, tau, scale = SX.sym("theta"), SX.sym("tau"), SX.sym("scale")
        parts = self.point.parts(point)
        forces = self._inverse @ (parts["v"] - self._shift * theta) * (scale / tau)
        contact = casadi.vertcat(one.contact[: CONTACT - 2], one.contact[CONTACT - 2 :] / scale)
        (sizes,) = casadi.substitute(
            [one.row_sizes], [one.contact, one.actuator_limits], [contact, one.actuator_limits / scale]
        )
        ratio = casadi.fmin(one.row_sizes, 1e300) / casadi.fmin(sizes, 1e300)
        z = parts["z"] * casadi.vertcat(SX.ones(FORCES), ratio) * (unit_of_dual(scale) / tau)
        flat = casadi.vec(one.actuator_rows.T)
        return kernel("finished", [one.contact, flat, one.actuator_limits, point, theta, tau, scale], [forces, z])

    def moved(self) -> Any:
        """(data, point, steps, length, y, theta, tau) -> (point there, sums, worst).

        Sums are what is pushed (6,), t'z, h'z, v'z + s'z and v'P v; the worst are what the gradient lacks, what
        the rows lack or, in units of the load, limits are exceeded by, what multipliers alone lack of a proof,
        and rows without tau.
        """
        data, point = SX.sym("data", self.data.size), SX.sym("point", self.point.size)
        steps, length = SX.sym("steps", self.steps.size), SX.sym("length")
        y, theta, tau = SX.sym("y", WRENCH), SX.sym("theta"), SX.sym("tau")
        A, weights, R, t, h = self.given(data)
        old, step = self.point.parts(point), self.steps.parts(steps)
        v, s, z = (old[name] + length * step[name] for name in ("v", "s", "z"))
        rows = z[FORCES:]
        pv = casadi.vertcat(weights[0] * v[0], weights[1] * v[1:])
        linear = A.T @ y - z[:FORCES] - R.T @ rows
        ray = R @ v + t * theta - s
        r_v, r_s = -(pv + linear), ray + h * tau
        new = self.point.pack(v=v, s=s, z=z, r_v=r_v, r_s=r_s)
        complementarity = casadi.dot(v, z[:FORCES]) + casadi.dot(s, rows)
        sums = casadi.vertcat(A @ v, casadi.dot(t, rows), casadi.dot(h, rows), complementarity, casadi.dot(pv, v))
        beyond = -(s + r_s) * self.data.parts(data)["units"]
        lacking = (
            casadi.fabs(r_v),
            casadi.vertcat(casadi.fabs(r_s), beyond),
            casadi.fabs(linear),
            casadi.fabs(ray),
        )
        worst = casadi.vertcat(*[casadi.mmax(each) for each in lacking])
        return kernel("moved", [data, point, steps, length, y, theta, tau], [new, sums, worst])

    def given(self, data: Any) -> tuple[Any, Any, Any, Any, Any]:
        """Return A, weights of P, R, t and h."""
        parts = self.data.parts(data)
        reach = SX(self._reach.sparsity(), parts["reach"])
        pushes = casadi.reshape(parts["pushes"], WRENCH, FORCES)
        return pushes, parts["weights"], reach, self._t - reach @ self._shift, parts["h"]


def kernel(name: str, given: list[Any], wanted: list[Any]) -> Any:
    """Return a Function of full matrices, which computes nothing twice."""
    once: Any = casadi.cse([casadi.densify(each) for each in wanted])
    return casadi.Function(name, given, once)
