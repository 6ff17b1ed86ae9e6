"""The steps of one contact: a predictor, then a corrector that aims at the middle between its limits.

Both are put together from what `elimination` keeps and the steps of y, theta and tau that all contacts share.
"""

from __future__ import annotations

from typing import Any

import casadi

from palpate.grasp.cone_scaling import SQUARES, back, back_acting, barrier, jordan, turn
from palpate.grasp.contact_problem import ContactProblem, kernel
from palpate.grasp.elimination import Eliminated, Elimination, along_f, combined
from palpate.grasp.pivots import solved
from palpate.grasp.record import RecordLayout
from palpate.grasp.statement import FORCES, ContactStatement

__all__ = ["ContactStep"]

SX = casadi.SX


class ContactStep:
    """Functions that step one contact.

    Attributes:
        problem: The contact.
        elimination: What eliminates it.
        aims: What the corrector aims at.
    """

    def __init__(self, one: ContactStatement) -> None:
        """Derive all from the statement."""
        self.problem = ContactProblem(one)
        self.elimination = Elimination(self.problem)
        m = self.problem.rows
        self.aims = RecordLayout(correction=FORCES + m, centering=FORCES + m)

    def aimed(self) -> Any:
        """(data, point, kept, direction, mu) -> (aims, right sides of correction and centering, 1 / step)."""
        data, point, kept, direction = self._symbols()
        mu = SX.sym("mu")
        now, e = self.problem.point.parts(point), self.elimination.known(data, kept)
        aim = self.elimination.predictor(now, e)
        v, f = self._found(data, e, aim, now, direction, 1.0)
        s, z = self._recovered(data, e, aim, now, direction, 1.0, v, f)
        old_z = turn(e.cone.frame, now["z"][:FORCES])
        blocked, added = jordan(e.cone, old_z, v, z[:FORCES])
        correction = casadi.vertcat(-added, -s * z[FORCES:] / now["s"])
        toward = casadi.vertcat(mu * turn(e.cone.frame, barrier(now["v"])), mu / now["s"] + e.parts["held"])
        aims = self.aims.pack(correction=correction, centering=toward)
        rights = (
            self.elimination.right_side(data, e, correction, SX.zeros(FORCES)),
            self.elimination.right_side(data, e, toward, -turn(e.cone.frame, now["r_v"])),
        )
        return kernel(
            "aimed", [data, point, kept, direction, mu], [aims, *rights, self._blocked(now, s, z, blocked)]
        )

    def tried(self) -> Any:
        """(data, point, kept, aims, direction, sigma) -> (step of v, turned, and of f; what it pushes)."""
        data, point, kept, direction = self._symbols()
        aims, sigma = SX.sym("aims", self.aims.size), SX.sym("sigma")
        now, e = self.problem.point.parts(point), self.elimination.known(data, kept)
        v, f = self._found(data, e, self._corrector(now, e, aims, sigma), now, direction, 1.0 - sigma)
        given = [data, point, kept, aims, direction, sigma]
        return kernel("tried", given, [casadi.vertcat(v, f), e.pushes @ v])

    def stepped(self) -> Any:
        """(data, point, kept, aims, direction, sigma, tried step of v, mend) -> (steps, 1 / longest)."""
        data, point, kept, direction = self._symbols()
        aims, sigma = SX.sym("aims", self.aims.size), SX.sym("sigma")
        tried, mend = SX.sym("tried", FORCES + 1), SX.sym("mend", self.problem.direction.size)
        now, e = self.problem.point.parts(point), self.elimination.known(data, kept)
        more = self.problem.direction.parts(mend)
        away = e.pushes.T @ more["y"]
        v = tried[:FORCES] - solved(e.lower, away)
        v -= e.parts["by_theta"] * more["theta"] + e.parts["by_tau"] * more["tau"]
        f = tried[FORCES] - self._free(e, away, more)
        aim = self._corrector(now, e, aims, sigma)
        s, z = self._recovered(data, e, aim, now, direction + mend, 1.0 - sigma, v, f)
        blocked, _ = jordan(e.cone, turn(e.cone.frame, now["z"][:FORCES]), v, z[:FORCES])
        steps = self.problem.steps.pack(
            v=back(e.cone.frame, v), s=s, z=casadi.vertcat(back_acting(e.cone.frame, z[:FORCES]), z[FORCES:])
        )
        given = [data, point, kept, aims, direction, sigma, tried, mend]
        return kernel("stepped", given, [steps, self._blocked(now, s, z, blocked)])

    def _corrector(self, now: dict[str, Any], e: Eliminated, aims: Any, sigma: Any) -> Any:
        goal = self.aims.parts(aims)
        return self.elimination.predictor(now, e) + goal["correction"] + sigma * goal["centering"]

    def _found(
        self, data: Any, e: Eliminated, aim: Any, now: dict[str, Any], direction: Any, left: Any
    ) -> tuple[Any, Any]:
        """The step of v, turned, and what of f's part of it is not theta's and tau's share of bounds.

        `left` is the share of what is lacking that the step removes.
        """
        _, _, R, _, _ = self.problem.given(data)
        d, rows = self.problem.direction.parts(direction), aim[FORCES:]
        rest = left * turn(e.cone.frame, now["r_v"]) + aim[:FORCES] - e.pushes.T @ d["y"]
        rest += combined(e.rows, self.problem.others, [rows[i] for i in self.problem.others])
        pressed = sum(R[i, 0] * rows[i] for i in self.problem.bounds)
        v = solved(e.lower, rest) + e.parts["along"] * pressed
        v -= e.parts["by_theta"] * d["theta"] + e.parts["by_tau"] * d["tau"]
        return v, e.parts["inside"] * e.parts["share"] * pressed - self._free(e, -rest, d)

    def _free(self, e: Eliminated, away: Any, d: dict[str, Any]) -> Any:
        """What bounds leave of minus the step of f that all else would make."""
        p = e.parts
        if self.problem.others:
            away = away + p["on_theta"] * d["theta"] + p["on_tau"] * d["tau"]
        return casadi.dot(p["along"], away)

    def _recovered(
        self,
        data: Any,
        e: Eliminated,
        aim: Any,
        now: dict[str, Any],
        direction: Any,
        left: Any,
        v: Any,
        f: Any,
    ) -> tuple[Any, Any]:
        """Steps of s and z (the cone's turned) from the linear equations, which hold whatever the scaling is.

        Where a bound holds f its slack moves a millionth as far as v and theta do, and is weighed 1e12 times: it
        is not their difference, then, but put together from what is left of both.
        """
        _, weights, R, t, h = self.problem.given(data)
        d, p = self.problem.direction.parts(direction), e.parts
        moves = []
        for i in range(self.problem.rows):
            if i in self.problem.bounds:
                moves.append(R[i, 0] * f + p["row_theta"][i] * d["theta"] + p["row_tau"][i] * d["tau"])
            else:
                moves.append(e.rows[i, :] @ v + t[i] * d["theta"] + h[i] * d["tau"])
        reached = casadi.vertcat(*moves)
        rows = aim[FORCES:] - p["weight"] * reached
        pv = SX.zeros(FORCES)
        if self.problem.quadratic:
            pv = weights[1] * (SQUARES * v) + along_f() * ((weights[0] - weights[1]) * casadi.dot(along_f(), v))
        cone = pv + e.pushes.T @ d["y"] - e.rows.T @ rows - left * turn(e.cone.frame, now["r_v"])
        return reached + left * now["r_s"], casadi.vertcat(cone, rows)

    def _blocked(self, now: dict[str, Any], s: Any, z: Any, cone: Any) -> Any:
        return casadi.mmax(casadi.vertcat(cone, -s / now["s"], -z[FORCES:] / now["z"][FORCES:]))

    def _symbols(self) -> tuple[Any, Any, Any, Any]:
        sizes = {
            "data": self.problem.data,
            "point": self.problem.point,
            "kept": self.elimination.kept,
            "direction": self.problem.direction,
        }
        data, point, kept, direction = (SX.sym(name, record.size) for name, record in sizes.items())
        return data, point, kept, direction
