"""What one iteration of the interior point method does with one contact.

Its variable v is the point of its cone, v = (mu f - theta, u) for max_margin and (mu f, u) for the others, so that
all contacts have the same cone and it does not depend on theta; its limits are rows s = R v + t theta + h tau.
With the scaling H of their multipliers the contact's curvature is

    K = P + W^-2 + R'H R,

and its step, given those of y, theta and tau, K^-1 (... - A'y - R'H t theta - R'H h tau). Bounds of f are the same
direction q many times over. Where f is held by a bound and the cone is slack, K is 1e10 along q and 1e-10 across
it: what bounds do is therefore not left to elimination but written out, K^-1 q = K0^-1 q / (1 + S q'K0^-1 q), S
being the sum of their weights and K0 the rest. Then no digits cancel, which is what limits such methods on linear
objectives.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi

from palpate.grasp.cone_scaling import HALF, ConeScaling, back, barrier, jordan, scaling, turn
from palpate.grasp.record import Record
from palpate.grasp.statement import CONTACT, FORCES, WRENCH, ContactStatement

__all__ = ["ContactStep", "kernel"]

SX = casadi.SX

PROXIMAL = 1e-8
"""Curvature, with linear objectives, below which steps are shortened: the solution is the same, rounding less."""


@dataclass(frozen=True, slots=True, eq=False)
class _Elimination:
    """What is known of a contact after `eliminated`, by name."""

    cone: ConeScaling
    parts: dict[str, Any]
    lower: Any
    pushes: Any
    rows: Any


class ContactStep:
    """The functions of one contact, and what their vectors hold.

    Attributes:
        data: What does not change: A (6, 4) by columns, weights of P, entries of R, h.
        point: v, slack s of the rows, multipliers z of cone and rows, and what the linear equations lack.
        kept: What `eliminated` finds out.
        sums: What all contacts add to the equations in y, theta and tau.
        right: The same for one right side.
        aims: What the corrector aims at.
        steps: Steps of v, s and z.
        direction: Steps of y, theta and tau.
    """

    def __init__(self, one: ContactStatement) -> None:
        """Derive all matrices from the statement."""
        self.one = one
        self._m: int = one.rows.numel()
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
        self._bounds = [i for i in range(self._m) if self._reach[i, 1:].nnz() == 0]
        self._others = [i for i in range(self._m) if i not in self._bounds]
        m = self._m
        self.data = Record(pushes=WRENCH * FORCES, weights=2, reach=self._reach.nnz(), h=m)
        self.point = Record(v=FORCES, s=m, z=FORCES + m, r_v=FORCES, r_s=m)
        self.kept = Record(
            frame=9, stretch=1, eta=1, det=1, pushes=WRENCH * FORCES, lower=10, along=FORCES, inside=1, share=1,
            stiff=2, on_theta=FORCES, on_tau=FORCES, by_theta=FORCES, by_tau=FORCES, slope=FORCES, weight=m,
            held=m,
        )  # fmt: skip
        self.sums = Record(
            m=21, a_theta=WRENCH, a_tau=WRENCH, a_slope=WRENCH, theta_theta=1, theta_tau=1, tau_theta=1, tau_tau=1
        )
        self.right = Record(y=WRENCH, theta=1, tau=1)
        self.aims = Record(correction=FORCES + m, centering=FORCES + m)
        self.steps = Record(v=FORCES, s=m, z=FORCES + m)
        self.direction = Record(y=WRENCH, theta=1, tau=1)

    @property
    def limits(self) -> int:
        """Number of multipliers: the cone's and the rows'."""
        return FORCES + self._m

    # --- between the caller's units and the method's

    def prepared(self) -> Any:
        """(contact, actuator rows, limits, scale) -> (data, what theta pushes)."""
        one, scale = self.one, SX.sym("scale")
        contact = casadi.vertcat(one.contact[: CONTACT - 2], one.contact[CONTACT - 2 :] / scale)
        given = [self._pushes, self._weights, casadi.vertcat(*self._reach.nonzeros()), self._h]
        pushes, weights, reach, h = casadi.substitute(
            given, [one.contact, one.actuator_limits], [contact, one.actuator_limits / scale]
        )
        data = self.data.pack(pushes=casadi.vec(pushes), weights=weights, reach=reach, h=h)
        arguments = [one.contact, casadi.vec(one.actuator_rows.T), one.actuator_limits, scale]
        return kernel("prepared", arguments, [data, -pushes @ self._shift])

    def start(self) -> Any:
        """The middle of all cones."""
        middle = casadi.vertcat(1.0, casadi.DM.zeros(FORCES - 1))
        ones = casadi.DM.ones(self._m)
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

    # --- where the method stands

    def moved(self) -> Any:
        """(data, point, steps, length, y, theta, tau) -> (point there, sums, worst).

        Sums are what is pushed (6,), t'z, h'z, v'z + s'z and v'P v; the worst are what the gradient and the rows
        lack, what multipliers alone lack of a proof, and rows without tau.
        """
        data, point = SX.sym("data", self.data.size), SX.sym("point", self.point.size)
        steps, length = SX.sym("steps", self.steps.size), SX.sym("length")
        y, theta, tau = SX.sym("y", WRENCH), SX.sym("theta"), SX.sym("tau")
        A, weights, R, t, h = self._given(data)
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
        worst = casadi.vertcat(*[casadi.mmax(casadi.fabs(each)) for each in (r_v, r_s, linear, ray)])
        return kernel("moved", [data, point, steps, length, y, theta, tau], [new, sums, worst])

    # --- elimination

    def eliminated(self) -> Any:
        """(data, point, tau) -> (kept, sums, right side of the predictor)."""
        data, point, tau = SX.sym("data", self.data.size), SX.sym("point", self.point.size), SX.sym("tau")
        A, weights, R, t, h = self._given(data)
        now = self.point.parts(point)
        s, z = now["s"], now["z"]
        w = scaling(now["v"], z[:FORCES])
        weight = z[FORCES:] / s
        q = _axis()

        lower, pivots = SX.eye(FORCES), casadi.vertsplit(w.curvature)
        pivots = [each + (weights[1] if self.quadratic else PROXIMAL) for each in pivots]
        rows = self._turned(R, w.frame)
        for i in self._others:
            _update(lower, pivots, weight[i], rows[i, :].T)
        # bounds of f, and what f costs beyond u, as (weight, R, t, h)
        bounds = [(weight[i], R[i, 0], t[i], h[i]) for i in self._bounds]
        if self.quadratic:
            bounds.append((weights[0] - weights[1], SX(1.0), SX(0.0), SX(0.0)))
        stiff = sum(a * r**2 for a, r, _, _ in bounds)
        on_theta, on_tau = sum(a * r * b for a, r, b, _ in bounds), sum(a * r * b for a, r, _, b in bounds)
        rest = _solved(_with_pivots(lower, pivots), q)
        inside = casadi.dot(q, rest)
        share = 1.0 / (1.0 + stiff * inside)
        along = rest * share
        _update(lower, pivots, stiff, q)
        lower = _with_pivots(lower, pivots)

        def pairs(first: int, second: int) -> Any:
            """Sum of weight x y less what K takes off, by Lagrange's identity: a sum of what is left."""
            total = sum(row[0] * row[first] * row[second] for row in bounds)
            for i, a in enumerate(bounds):
                for b in bounds[:i]:
                    one, two = a[1] * b[first] - b[1] * a[first], a[1] * b[second] - b[1] * a[second]
                    total = total + inside * a[0] * b[0] * one * two
            return total * share

        others_theta = _combined(rows, self._others, [weight[i] * t[i] for i in self._others])
        others_tau = _combined(rows, self._others, [weight[i] * h[i] for i in self._others])
        by_theta = along * on_theta + _solved(lower, others_theta)
        by_tau = along * on_tau + _solved(lower, others_tau)
        weighted = {
            (a, b): sum((weight[i] * x[i] * y[i] for i in self._others), SX(0.0))
            for a, x in (("t", t), ("h", h))
            for b, y in (("t", t), ("h", h))
        }
        theta_theta = pairs(2, 2) + weighted["t", "t"] - casadi.dot(others_theta, by_theta)
        theta_theta -= on_theta * casadi.dot(along, others_theta)
        theta_tau = pairs(2, 3) + weighted["t", "h"] - casadi.dot(others_theta, by_tau)
        theta_tau -= on_theta * casadi.dot(along, others_tau)
        tau_tau = pairs(3, 3) + weighted["h", "h"] - casadi.dot(others_tau, by_tau)
        tau_tau -= on_tau * casadi.dot(along, others_tau)

        turned = turn(w.frame, A.T).T
        pv = casadi.vertcat(weights[0] * now["v"][0], weights[1] * now["v"][1:])
        slope = turn(w.frame, 2.0 * pv / tau) if self.quadratic else SX.zeros(FORCES)
        half = [_forward(lower, turned[i, :].T) for i in range(WRENCH)]
        over = casadi.diag(lower)
        sums = self.sums.pack(
            m=casadi.vertcat(*[casadi.dot(half[i] * over, half[j]) for i in range(WRENCH) for j in range(i + 1)]),
            a_theta=turned @ by_theta,
            a_tau=turned @ by_tau,
            a_slope=turned @ _solved(lower, slope) if self.quadratic else SX.zeros(WRENCH),
            theta_theta=theta_theta,
            theta_tau=theta_tau,
            tau_theta=-theta_tau - casadi.dot(slope, by_theta),
            tau_tau=-tau_tau - casadi.dot(slope, by_tau),
        )
        kept = self.kept.pack(
            frame=casadi.vec(w.frame), stretch=w.stretch, eta=w.eta, det=w.det, pushes=casadi.vec(turned),
            lower=casadi.vertcat(*[lower[i, j] for i in range(FORCES) for j in range(i + 1)]), along=along,
            inside=inside, share=share, stiff=casadi.vertcat(stiff, on_theta), on_theta=others_theta,
            on_tau=others_tau, by_theta=by_theta, by_tau=by_tau, slope=slope, weight=weight,
            held=weight * now["r_s"],
        )  # fmt: skip
        e = self._known(data, kept)
        right = self._right(data, e, self._predictor(now, e), turn(w.frame, now["r_v"]))
        return kernel("eliminated", [data, point, tau], [kept, sums, right])

    def _right(self, data: Any, e: _Elimination, aim: Any, r_v: Any) -> Any:
        """What one aim adds to the right side of the equations in y, theta and tau."""
        _, weights, R, t, h = self._given(data)
        p, rows = e.parts, aim[FORCES:]
        rest = r_v + aim[:FORCES] + _combined(e.rows, self._others, [rows[i] for i in self._others])
        pressed = sum(R[i, 0] * rows[i] for i in self._bounds)
        found = _solved(e.lower, rest) + p["along"] * pressed

        def left(x: Any) -> Any:
            """Sum of x times the aims of bounds less what K takes off, again without a row's own share."""
            total: Any = SX(0.0)
            for i in self._bounds:
                others: Any = SX(0.0)
                for j in self._bounds:
                    if j != i:
                        others += p["weight"][j] * R[j, 0] * (R[j, 0] * x[i] - x[j] * R[i, 0])
                if self.quadratic:
                    others += (weights[0] - weights[1]) * x[i]
                total += rows[i] * (x[i] + p["inside"] * others)
            return total * p["share"]

        theta = left(t) + sum((t[i] * rows[i] for i in self._others), SX(0.0))
        theta -= casadi.dot(p["by_theta"], rest) + casadi.dot(p["on_theta"], p["along"]) * pressed
        tau = -left(h) - sum((h[i] * rows[i] for i in self._others), SX(0.0))
        tau += casadi.dot(p["by_tau"], rest) + casadi.dot(p["on_tau"], p["along"]) * pressed
        tau -= casadi.dot(p["slope"], found)
        return self.right.pack(y=e.pushes @ found, theta=theta, tau=tau)

    # --- steps

    def aimed(self) -> Any:
        """(data, point, kept, direction, mu) -> (aims, right sides of correction and centering, 1 / step)."""
        data, point, kept, direction = self._symbols()
        mu = SX.sym("mu")
        now, e = self.point.parts(point), self._known(data, kept)
        aim = self._predictor(now, e)
        v = self._found(data, e, aim, now, direction, 1.0)
        s, z = self._recovered(data, e, aim, now, direction, 1.0, v)
        old_z = turn(e.cone.frame, now["z"][:FORCES])
        blocked, added = jordan(e.cone, old_z, v, z[:FORCES])
        correction = casadi.vertcat(-added, -s * z[FORCES:] / now["s"])
        toward = casadi.vertcat(mu * turn(e.cone.frame, barrier(now["v"])), mu / now["s"] + e.parts["held"])
        aims = self.aims.pack(correction=correction, centering=toward)
        rights = (
            self._right(data, e, correction, SX.zeros(FORCES)),
            self._right(data, e, toward, -turn(e.cone.frame, now["r_v"])),
        )
        return kernel(
            "aimed", [data, point, kept, direction, mu], [aims, *rights, self._blocked(now, s, z, blocked)]
        )

    def tried(self) -> Any:
        """(data, point, kept, aims, direction, sigma) -> (step of v, turned; what it pushes)."""
        data, point, kept, direction = self._symbols()
        aims, sigma = SX.sym("aims", self.aims.size), SX.sym("sigma")
        now, e = self.point.parts(point), self._known(data, kept)
        v = self._found(data, e, self._corrector(now, e, aims, sigma), now, direction, 1.0 - sigma)
        return kernel("tried", [data, point, kept, aims, direction, sigma], [v, e.pushes @ v])

    def stepped(self) -> Any:
        """(data, point, kept, aims, direction, sigma, tried step of v, mend) -> (steps, 1 / longest)."""
        data, point, kept, direction = self._symbols()
        aims, sigma = SX.sym("aims", self.aims.size), SX.sym("sigma")
        tried, mend = SX.sym("tried", FORCES), SX.sym("mend", self.direction.size)
        now, e = self.point.parts(point), self._known(data, kept)
        more = self.direction.parts(mend)
        v = tried - _solved(e.lower, e.pushes.T @ more["y"])
        v -= e.parts["by_theta"] * more["theta"] + e.parts["by_tau"] * more["tau"]
        aim = self._corrector(now, e, aims, sigma)
        s, z = self._recovered(data, e, aim, now, direction + mend, 1.0 - sigma, v)
        blocked, _ = jordan(e.cone, turn(e.cone.frame, now["z"][:FORCES]), v, z[:FORCES])
        steps = self.steps.pack(
            v=back(e.cone.frame, v), s=s, z=casadi.vertcat(back(e.cone.frame, z[:FORCES]), z[FORCES:])
        )
        given = [data, point, kept, aims, direction, sigma, tried, mend]
        return kernel("stepped", given, [steps, self._blocked(now, s, z, blocked)])

    def _predictor(self, now: dict[str, Any], e: _Elimination) -> Any:
        """W^-1 times what a step to complementarity zero needs, less what the rows lack."""
        z = now["z"]
        return casadi.vertcat(turn(e.cone.frame, -z[:FORCES]), -z[FORCES:] - e.parts["held"])

    def _corrector(self, now: dict[str, Any], e: _Elimination, aims: Any, sigma: Any) -> Any:
        goal = self.aims.parts(aims)
        return self._predictor(now, e) + goal["correction"] + sigma * goal["centering"]

    def _found(self, data: Any, e: _Elimination, aim: Any, now: dict[str, Any], direction: Any, left: Any) -> Any:
        """The step of v, turned; `left` is the share of what is lacking that it removes."""
        _, _, R, _, _ = self._given(data)
        d, rows = self.direction.parts(direction), aim[FORCES:]
        rest = left * turn(e.cone.frame, now["r_v"]) + aim[:FORCES] - e.pushes.T @ d["y"]
        rest += _combined(e.rows, self._others, [rows[i] for i in self._others])
        pressed = sum(R[i, 0] * rows[i] for i in self._bounds)
        v = _solved(e.lower, rest) + e.parts["along"] * pressed
        return v - e.parts["by_theta"] * d["theta"] - e.parts["by_tau"] * d["tau"]

    def _recovered(
        self, data: Any, e: _Elimination, aim: Any, now: dict[str, Any], direction: Any, left: Any, v: Any
    ) -> tuple[Any, Any]:
        """Steps of s and z (the cone's turned) from the linear equations, which hold whatever the scaling is."""
        _, weights, _, t, h = self._given(data)
        d = self.direction.parts(direction)
        reached = e.rows @ v + t * d["theta"] + h * d["tau"]
        rows = aim[FORCES:] - e.parts["weight"] * reached
        pv = SX.zeros(FORCES)
        if self.quadratic:
            pv = weights[1] * v + _axis() * ((weights[0] - weights[1]) * casadi.dot(_axis(), v))
        cone = pv + e.pushes.T @ d["y"] - e.rows.T @ rows - left * turn(e.cone.frame, now["r_v"])
        return reached + left * now["r_s"], casadi.vertcat(cone, rows)

    def _blocked(self, now: dict[str, Any], s: Any, z: Any, cone: Any) -> Any:
        return casadi.mmax(casadi.vertcat(cone, -s / now["s"], -z[FORCES:] / now["z"][FORCES:]))

    # --- names for parts of vectors

    def _symbols(self) -> tuple[Any, Any, Any, Any]:
        sizes = {"data": self.data, "point": self.point, "kept": self.kept, "direction": self.direction}
        data, point, kept, direction = (SX.sym(name, record.size) for name, record in sizes.items())
        return data, point, kept, direction

    def _given(self, data: Any) -> tuple[Any, Any, Any, Any, Any]:
        """A, weights of P, R, t, h."""
        parts = self.data.parts(data)
        reach = SX(self._reach.sparsity(), parts["reach"])
        pushes = casadi.reshape(parts["pushes"], WRENCH, FORCES)
        return pushes, parts["weights"], reach, self._t - reach @ self._shift, parts["h"]

    def _turned(self, R: Any, frame: Any) -> Any:
        """R along the eigenvectors; bounds keep their zeros."""
        rows = [R[i, 0] * _axis().T if i in self._bounds else turn(frame, R[i, :].T).T for i in range(self._m)]
        return casadi.vertcat(*rows)

    def _known(self, data: Any, kept: Any) -> _Elimination:
        parts = self.kept.parts(kept)
        cone = ConeScaling(casadi.reshape(parts["frame"], 3, 3), parts["stretch"], parts["eta"], parts["det"])
        lower = SX(FORCES, FORCES)
        entries = iter(casadi.vertsplit(parts["lower"]))
        for i in range(FORCES):
            for j in range(i + 1):
                entry = next(entries)
                # bounds alone leave the two middle directions on their own
                if self._others or i == j or (i, j) == (FORCES - 1, 0):
                    lower[i, j] = entry
        if not self.quadratic:
            parts["slope"] = SX.zeros(FORCES)
        pushes = casadi.reshape(parts["pushes"], WRENCH, FORCES)
        return _Elimination(cone, parts, lower, pushes, self._turned(self._given(data)[2], cone.frame))


def kernel(name: str, given: list[Any], wanted: list[Any]) -> Any:
    """Return a Function of full matrices."""
    return casadi.Function(name, given, [casadi.densify(each) for each in wanted])


def _axis() -> Any:
    """The direction of f along the eigenvectors, with its zeros known."""
    q = SX(FORCES, 1)
    q[0], q[3] = HALF, HALF
    return q


def _combined(rows: Any, chosen: list[int], factors: list[Any]) -> Any:
    total = SX.zeros(FORCES)
    for i, factor in zip(chosen, factors, strict=True):
        total += rows[i, :].T * factor
    return total


def _update(lower: Any, pivots: list[Any], size: Any, direction: Any) -> None:
    """Turn factors L D L' of K into those of K + size d d' (Gill, Golub, Murray & Saunders 1974, method C1).

    Pivots are sums of positive numbers, however stiff the update; known zeros cost nothing.
    """
    known = [direction.sparsity().has_nz(i, 0) for i in range(FORCES)]
    left = [direction[i] for i in range(FORCES)]
    for j in range(FORCES):
        if not known[j]:
            continue
        share = left[j]
        pivot = pivots[j] + size * share**2
        gain = share * size / pivot
        size = size * pivots[j] / pivot
        pivots[j] = pivot
        for i in range(j + 1, FORCES):
            if lower.sparsity().has_nz(i, j):
                left[i] = left[i] - share * lower[i, j]
                known[i] = True
            if known[i]:
                lower[i, j] = lower[i, j] + gain * left[i]


def _with_pivots(lower: Any, pivots: list[Any]) -> Any:
    """L with 1 / D on its diagonal."""
    out = SX(lower)
    for i in range(FORCES):
        out[i, i] = 1.0 / pivots[i]
    return out


def _forward(lower: Any, right: Any) -> Any:
    out: list[Any] = []
    for i in range(FORCES):
        known = [k for k in range(i) if lower.sparsity().has_nz(i, k)]
        out.append(right[i] - sum(lower[i, k] * out[k] for k in known))
    return casadi.vertcat(*out)


def _solved(lower: Any, right: Any) -> Any:
    half = _forward(lower, right)
    out = [half[i] * lower[i, i] for i in range(FORCES)]
    for i in range(FORCES - 1, -1, -1):
        for k in range(i + 1, FORCES):
            if lower.sparsity().has_nz(k, i):
                out[i] = out[i] - lower[k, i] * out[k]
    return casadi.vertcat(*out)
