"""One contact's variables eliminated, so that only y, theta and tau are left.

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

from palpate.grasp.cone_scaling import SQUARES, ConeScaling, reciprocal, scaling, turn
from palpate.grasp.contact_problem import ContactProblem, kernel
from palpate.grasp.pivots import forward, solved, update, with_pivots
from palpate.grasp.record import RecordLayout
from palpate.grasp.statement import FORCES, WRENCH

__all__ = ["Eliminated", "Elimination", "along_f", "combined"]

SX = casadi.SX

PROXIMAL = 1e-8
"""Curvature, with linear objectives, below which steps are shortened: the solution is the same, rounding less."""


@dataclass(frozen=True, slots=True, eq=False)
class Eliminated:
    """Parts of a contact after elimination, by name; all along the eigenvectors of its scaling.

    Attributes:
        cone: The scaling.
        parts: What `Elimination.kept` names.
        lower: Factors of K.
        pushes: A, (6, 4).
        rows: R, (m, 4).
    """

    cone: ConeScaling
    parts: dict[str, Any]
    lower: Any
    pushes: Any
    rows: Any


class Elimination:
    """Functions that eliminate one contact.

    Attributes:
        kept: What `eliminated` finds out.
        sums: What all contacts add to the equations in y, theta and tau.
        right: The same for one right side.
    """

    def __init__(self, problem: ContactProblem) -> None:
        """Take a contact."""
        self._problem, m = problem, problem.rows
        self.kept = RecordLayout(
            frame=9, three=3, inverse=3, det=1, pushes=WRENCH * FORCES, lower=10, along=FORCES, inside=1, share=1,
            stiff=2, on_theta=FORCES, on_tau=FORCES, by_theta=FORCES, by_tau=FORCES, slope=FORCES, weight=m,
            held=m, row_theta=m, row_tau=m,
        )  # fmt: skip
        self.sums = RecordLayout(
            m=21, a_theta=WRENCH, a_tau=WRENCH, a_slope=WRENCH, theta_theta=1, theta_tau=1, tau_theta=1, tau_tau=1
        )
        self.right = RecordLayout(y=WRENCH, theta=1, tau=1)

    def eliminated(self) -> Any:
        """(data, point, tau) -> (kept, sums, right side of the predictor)."""
        data, point, tau = (
            SX.sym("data", self._problem.data.size),
            SX.sym("point", self._problem.point.size),
            SX.sym("tau"),
        )
        A, weights, R, t, h = self._problem.given(data)
        now = self._problem.point.parts(point)
        s, z = now["s"], now["z"]
        w = scaling(now["v"], z[:FORCES])
        weight = z[FORCES:] / s
        q = along_f()

        across = weights[1] if self._problem.quadratic else PROXIMAL
        lower, pivots = SX.eye(FORCES), casadi.vertsplit(w.curvature + across * SQUARES)
        rows = self._turned(R, w.frame)
        for i in self._problem.others:
            update(lower, pivots, weight[i], rows[i, :].T)
        # bounds of f, and what f costs beyond u, as (weight, R, t, h)
        bounds = [(weight[i], R[i, 0], t[i], h[i]) for i in self._problem.bounds]
        if self._problem.quadratic:
            bounds.append((weights[0] - weights[1], SX(1.0), SX(0.0), SX(0.0)))
        stiff = sum(a * r**2 for a, r, _, _ in bounds)
        on_theta, on_tau = sum(a * r * b for a, r, b, _ in bounds), sum(a * r * b for a, r, _, b in bounds)
        rest = solved(with_pivots(lower, pivots), q)
        inside = casadi.dot(q, rest)
        share = reciprocal(1.0 + stiff * inside)
        along = rest * share
        update(lower, pivots, stiff, q)
        lower = with_pivots(lower, pivots)

        def pairs(first: int, second: int) -> Any:
            """Sum of weight x y less what K takes off, by Lagrange's identity: a sum of what is left."""
            total = sum(row[0] * row[first] * row[second] for row in bounds)
            for i, a in enumerate(bounds):
                for b in bounds[:i]:
                    one, two = a[1] * b[first] - b[1] * a[first], a[1] * b[second] - b[1] * a[second]
                    total = total + inside * a[0] * b[0] * one * two
            return total * share

        def own(which: int) -> Any:
            """What theta or tau moves each bound by with f held by all of them, again by that identity."""
            out = SX(self._problem.rows, 1)
            for i, a in zip(self._problem.bounds, bounds, strict=False):
                others = sum(b[0] * b[1] * (b[1] * a[which] - b[which] * a[1]) for b in bounds if b is not a)
                out[i] = share * (a[which] + inside * others)
            return out

        others_theta = combined(rows, self._problem.others, [weight[i] * t[i] for i in self._problem.others])
        others_tau = combined(rows, self._problem.others, [weight[i] * h[i] for i in self._problem.others])
        by_theta = along * on_theta + solved(lower, others_theta)
        by_tau = along * on_tau + solved(lower, others_tau)
        weighted = {
            (a, b): sum((weight[i] * x[i] * y[i] for i in self._problem.others), SX(0.0))
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
        slope = turn(w.frame, 2.0 * pv / tau) if self._problem.quadratic else SX.zeros(FORCES)
        half = [forward(lower, turned[i, :].T) for i in range(WRENCH)]
        over = casadi.diag(lower)
        sums = self.sums.pack(
            m=casadi.vertcat(*[casadi.dot(half[i] * over, half[j]) for i in range(WRENCH) for j in range(i + 1)]),
            a_theta=turned @ by_theta,
            a_tau=turned @ by_tau,
            a_slope=turned @ solved(lower, slope) if self._problem.quadratic else SX.zeros(WRENCH),
            theta_theta=theta_theta,
            theta_tau=theta_tau,
            tau_theta=-theta_tau - casadi.dot(slope, by_theta),
            tau_tau=-tau_tau - casadi.dot(slope, by_tau),
        )
        kept = self.kept.pack(
            frame=casadi.vec(w.frame), three=w.three, inverse=w.inverse, det=w.det, pushes=casadi.vec(turned),
            lower=casadi.vertcat(*[lower[i, j] for i in range(FORCES) for j in range(i + 1)]), along=along,
            inside=inside, share=share, stiff=casadi.vertcat(stiff, on_theta), on_theta=others_theta,
            on_tau=others_tau, by_theta=by_theta, by_tau=by_tau, slope=slope, weight=weight,
            held=weight * now["r_s"], row_theta=own(2), row_tau=own(3),
        )  # fmt: skip
        e = self.known(data, kept)
        right = self.right_side(data, e, self.predictor(now, e), turn(w.frame, now["r_v"]))
        return kernel("eliminated", [data, point, tau], [kept, sums, right])

    def right_side(self, data: Any, e: Eliminated, aim: Any, r_v: Any) -> Any:
        """What one aim adds to the right side of the equations in y, theta and tau."""
        _, weights, R, t, h = self._problem.given(data)
        p, rows = e.parts, aim[FORCES:]
        rest = r_v + aim[:FORCES] + combined(e.rows, self._problem.others, [rows[i] for i in self._problem.others])
        pressed = sum(R[i, 0] * rows[i] for i in self._problem.bounds)
        found = solved(e.lower, rest) + p["along"] * pressed

        def left(x: Any) -> Any:
            """Sum of x times the aims of bounds less what K takes off, again without a row's own share."""
            total: Any = SX(0.0)
            for i in self._problem.bounds:
                others: Any = SX(0.0)
                for j in self._problem.bounds:
                    if j != i:
                        others += p["weight"][j] * R[j, 0] * (R[j, 0] * x[i] - x[j] * R[i, 0])
                if self._problem.quadratic:
                    others += (weights[0] - weights[1]) * x[i]
                total += rows[i] * (x[i] + p["inside"] * others)
            return total * p["share"]

        theta = left(t) + sum((t[i] * rows[i] for i in self._problem.others), SX(0.0))
        theta -= casadi.dot(p["by_theta"], rest) + casadi.dot(p["on_theta"], p["along"]) * pressed
        tau = -left(h) - sum((h[i] * rows[i] for i in self._problem.others), SX(0.0))
        tau += casadi.dot(p["by_tau"], rest) + casadi.dot(p["on_tau"], p["along"]) * pressed
        tau -= casadi.dot(p["slope"], found)
        return self.right.pack(y=e.pushes @ found, theta=theta, tau=tau)

    def predictor(self, now: dict[str, Any], e: Eliminated) -> Any:
        """W^-1 times what a step to complementarity zero needs, less what the rows lack."""
        z = now["z"]
        return casadi.vertcat(turn(e.cone.frame, -z[:FORCES]), -z[FORCES:] - e.parts["held"])

    def _turned(self, R: Any, frame: Any) -> Any:
        """R along the eigenvectors; bounds keep their zeros."""
        rows = [
            R[i, 0] * along_f().T if i in self._problem.bounds else turn(frame, R[i, :].T).T
            for i in range(self._problem.rows)
        ]
        return casadi.vertcat(*rows)

    def known(self, data: Any, kept: Any) -> Eliminated:
        """Return by name what `eliminated` kept."""
        parts = self.kept.parts(kept)
        cone = ConeScaling(casadi.reshape(parts["frame"], 3, 3), parts["three"], parts["inverse"], parts["det"])
        lower = SX(FORCES, FORCES)
        entries = iter(casadi.vertsplit(parts["lower"]))
        for i in range(FORCES):
            for j in range(i + 1):
                entry = next(entries)
                # bounds alone leave the two middle directions on their own
                if self._problem.others or i == j or (i, j) == (FORCES - 1, 0):
                    lower[i, j] = entry
        if not self._problem.quadratic:
            parts["slope"] = SX.zeros(FORCES)
        pushes = casadi.reshape(parts["pushes"], WRENCH, FORCES)
        return Eliminated(cone, parts, lower, pushes, self._turned(self._problem.given(data)[2], cone.frame))


def along_f() -> Any:
    """The coordinates of what acts on f alone, with its zeros known."""
    q = SX(FORCES, 1)
    q[0], q[3] = 1.0, 1.0
    return q


def combined(rows: Any, chosen: list[int], factors: list[Any]) -> Any:
    """Return the sum of chosen rows times their factors, (4,)."""
    total = SX.zeros(FORCES)
    for i, factor in zip(chosen, factors, strict=True):
        total += rows[i, :].T * factor
    return total
