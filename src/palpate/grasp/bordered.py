"""The equations in what all contacts share: multipliers y of equilibrium, theta and tau.

    M y - g theta - p tau = r_y
    g'y + c0 theta + c1 tau = r_theta
    l'y + c2 theta + c3 tau = r_tau

M is what contacts yield per multiplier, positive semidefinite. Where only theta can balance a wrench (the load,
when its largest multiple is sought), M vanishes along g as the method converges, and eliminating y first would
leave rounding. So y is rotated until g lies along its first axis, and that entry and theta are eliminated
together: their 2 x 2 block [[m, -|g|], [|g|, c0]] has the determinant m c0 + |g|^2, and all else stays positive
definite.
"""

from __future__ import annotations

from typing import Any

import casadi

from palpate.grasp.record import RecordLayout

__all__ = ["Bordered", "symmetric"]

SX = casadi.SX

ROUNDING = 1e-16
"""Added to the diagonal, over its largest entry: keeps y finite where contacts hardly push. Chosen on hard
instances; three times as much slows down grasps with small e, a third lets rounding in."""

IDLE = 1e-13
"""Added likewise along wrenches that no contact can push at all: there y may be anything, and rounding alone would
move it by 1e10. At 1e-8 what small e pushes suffers."""

RANK_TOLERANCE = 1e-14
"""Least square of what contacts push, over the largest, that is none of those: just above rounding."""

TINY = 1e-300
"""Keeps quotients of zeros finite."""


SIZE = 6
"""Equations of equilibrium."""


class Bordered:
    """Solves these equations, symbolically.

    Attributes:
        matrix: Names of the matrix's entries: m (21,), the lower triangle by rows, g, p, l (6,) and c (4,).
        factor: Names of what `factored` returns.
    """

    def __init__(self, has_theta: bool) -> None:
        """Say whether there is a theta."""
        self._has_theta = has_theta
        self.matrix = RecordLayout(m=21, g=SIZE, p=SIZE, l=SIZE, c=4, moves=1)
        rest = SIZE - 1
        parts = {"axis": SIZE, "beta": 1, "first": 1, "across": rest, "over": 1} if has_theta else {}
        self._free = rest if has_theta else SIZE
        self.factor = RecordLayout(
            **parts, lower=self._free * (self._free + 1) // 2, y_tau=SIZE, theta_tau=1, over_tau=1
        )

    def unreached(self, reach: Any) -> Any:
        """Return the lower triangle (21,) of delta (delta I + A A')^-1: the projection on the null space of A'.

        Args:
            reach: Lower triangle of A A' by rows, (21,).
        """
        square = symmetric(reach, SIZE)
        least = RANK_TOLERANCE * casadi.trace(square) + TINY
        lower = _cholesky(square + least * SX.eye(SIZE), SX.zeros(SIZE))
        columns = [least * _cholesky_solved(lower, SX.eye(SIZE)[:, i]) for i in range(SIZE)]
        return casadi.vertcat(*[columns[j][i] for i in range(SIZE) for j in range(i + 1)])

    def factored(self, matrix: Any, idle: Any) -> Any:
        """Return the factors of a matrix; `idle` (21,) is what `unreached` returned."""
        a = self.matrix.parts(matrix)
        m = symmetric(a["m"], SIZE)
        m = m + (IDLE * casadi.mmax(casadi.diag(m))) * symmetric(idle, SIZE)
        known: dict[str, Any] = {}
        if self._has_theta:
            length = casadi.norm_2(a["g"])
            first = SX.zeros(SIZE)
            first[0] = 1.0
            axis = casadi.if_else(length > 0.0, a["g"] / casadi.fmax(length, TINY), first)
            sign = casadi.copysign(1.0, axis[0])
            # Householder's reflection I - 2 a a' takes g to -sign |g| along the first axis
            axis = (axis + sign * first) / casadi.sqrt(2.0 + 2.0 * casadi.fabs(axis[0]))
            beta = -sign * length
            half = m @ axis - axis * casadi.dot(axis, m @ axis)
            m = m - 2.0 * (axis @ half.T + half @ axis.T)
            over = 1.0 / (m[0, 0] * a["c"][0] + beta**2 + TINY)
            across = m[1:, 0]
            known = {"axis": axis, "beta": beta, "first": m[0, 0], "across": across, "over": over}
            sizes = casadi.diag(m)[1:]
            m = m[1:, 1:] - (a["c"][0] * over) * (across @ across.T)
        else:
            sizes = casadi.diag(m)
        lower = _cholesky(m, sizes)
        packed = casadi.vertcat(*[lower[i, j] for i in range(self._free) for j in range(i + 1)])
        y, theta = self._without_tau(known | {"lower": packed}, a, a["p"], -a["c"][1])
        pivot = a["c"][3] + casadi.dot(a["l"], y) + a["c"][2] * theta
        over_tau = casadi.if_else(a["moves"], 1.0 / pivot, 0.0)
        return self.factor.pack(**known, lower=packed, y_tau=y, theta_tau=theta, over_tau=over_tau)

    def solved(self, matrix: Any, factor: Any, r_y: Any, r_theta: Any, r_tau: Any) -> tuple[Any, Any, Any]:
        """Return (y, theta, tau)."""
        a, f = self.matrix.parts(matrix), self.factor.parts(factor)
        y, theta = self._without_tau(f, a, r_y, r_theta)
        tau = f["over_tau"] * (r_tau - casadi.dot(a["l"], y) - a["c"][2] * theta)
        return y + f["y_tau"] * tau, theta + f["theta_tau"] * tau, tau

    def refined(self, matrix: Any, factor: Any, r_y: Any, r_theta: Any, r_tau: Any) -> tuple[Any, Any, Any]:
        """Return (y, theta, tau), corrected once by what they leave: large parts of them cancel."""
        a = self.matrix.parts(matrix)
        c = a["c"]
        y, theta, tau = self.solved(matrix, factor, r_y, r_theta, r_tau)
        more = self.solved(
            matrix,
            factor,
            r_y - symmetric(a["m"], SIZE) @ y + a["g"] * theta + a["p"] * tau,
            r_theta - casadi.dot(a["g"], y) - c[0] * theta - c[1] * tau,
            r_tau - casadi.dot(a["l"], y) - c[2] * theta - c[3] * tau,
        )
        return y + more[0], theta + more[1], tau + more[2]

    def _without_tau(self, f: dict[str, Any], a: dict[str, Any], r_y: Any, r_theta: Any) -> tuple[Any, Any]:
        lower = _unpacked(f["lower"], self._free)
        if not self._has_theta:
            return _cholesky_solved(lower, r_y), SX(0.0)
        axis, beta, first, across, over = (f[name] for name in ("axis", "beta", "first", "across", "over"))
        turned = r_y - 2.0 * axis * casadi.dot(axis, r_y)
        c0 = a["c"][0]
        rest = _cholesky_solved(lower, turned[1:] - across * (over * (c0 * turned[0] + beta * r_theta)))
        left = turned[0] - casadi.dot(across, rest)
        along = over * (c0 * left + beta * r_theta)
        theta = over * (first * r_theta - beta * left)
        y = casadi.vertcat(along, rest)
        return y - 2.0 * axis * casadi.dot(axis, y), theta


def symmetric(packed: Any, size: int) -> Any:
    """Return the matrix of a lower triangle by rows."""
    m = _unpacked(packed, size)
    for i in range(size):
        for j in range(i):
            m[j, i] = m[i, j]
    return m


def _unpacked(packed: Any, size: int) -> Any:
    lower = SX(size, size)
    entries = iter(casadi.vertsplit(packed))
    for i in range(size):
        for j in range(i + 1):
            lower[i, j] = next(entries)
    return lower


def _cholesky(m: Any, sizes: Any) -> Any:
    """L, with 1 / pivot on its diagonal; pivots stay above the rounding of entries of these sizes."""
    lower, least = SX(*m.shape), ROUNDING * casadi.mmax(sizes) + TINY
    for j in range(m.shape[0]):
        pivot = m[j, j] + least - sum(lower[j, k] ** 2 for k in range(j))
        inverse = 1.0 / casadi.sqrt(casadi.fmax(pivot, least))
        lower[j, j] = inverse
        for i in range(j + 1, m.shape[0]):
            lower[i, j] = (m[i, j] - sum(lower[i, k] * lower[j, k] for k in range(j))) * inverse
    return lower


def _cholesky_solved(lower: Any, right: Any) -> Any:
    size = lower.shape[0]
    out = [right[i] for i in range(size)]
    for i in range(size):
        out[i] = (out[i] - sum(lower[i, k] * out[k] for k in range(i))) * lower[i, i]
    for i in range(size - 1, -1, -1):
        out[i] = (out[i] - sum(lower[k, i] * out[k] for k in range(i + 1, size))) * lower[i, i]
    return casadi.vertcat(*out)
