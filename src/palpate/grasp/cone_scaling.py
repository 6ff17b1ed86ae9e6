"""Nesterov-Todd scaling of a second-order cone, in the coordinates in which it is diagonal.

For a point v and a multiplier z inside the cone there is one symmetric W with W z = W^-1 v. Its eigenvectors are
the columns of E = [(1, -d), p1, p2, (1, d)] with a unit vector d and two across, its eigenvalues eta / stretch,
eta, eta and eta stretch. Near the optimum these differ by 1e10: kept apart, they do not drown each other. Steps of
v are E times their coordinates; what acts on v (z, rows, pushes) has the coordinates E' z, so that products stay
what they are. Two columns have the length sqrt 2: made one, its rounding would limit the method.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi

__all__ = ["SQUARES", "ConeScaling", "back", "back_acting", "barrier", "jordan", "reciprocal", "scaling", "turn"]

SX = casadi.SX

SQUARES = casadi.DM([2.0, 1.0, 1.0, 2.0])
"""Diagonal of E'E."""

OVER_SQUARES = casadi.DM([0.5, 1.0, 1.0, 0.5])

TINY = 1e-300
"""Keeps quotients of zeros finite."""


@dataclass(frozen=True, slots=True, eq=False)
class ConeScaling:
    """W of one cone.

    Attributes:
        frame: [d p1 p2], (3, 3).
        three: Eigenvalues of W: the least, that of both across, the largest, (3,).
        inverse: Of these, (3,).
        det: Of the scaled point lambda = W z: lambda_0^2 - |lambda_1|^2.
    """

    frame: Any
    three: Any
    inverse: Any
    det: Any

    @property
    def values(self) -> Any:
        """Eigenvalues of W, (4,)."""
        return _four(self.three)

    @property
    def inverses(self) -> Any:
        """Eigenvalues of W^-1, (4,)."""
        return _four(self.inverse)

    @property
    def curvature(self) -> Any:
        """Diagonal of E' W^-2 E, (4,)."""
        return SQUARES * _four(self.inverse**2)


def reciprocal(x: Any) -> Any:
    """Return 1 / x of something positive, to multiply by.

    Without the absolute value CasADi would turn every product with it into a quotient, ten times as slow.
    """
    return casadi.fabs(1.0 / x)


def scaling(v: Any, z: Any) -> ConeScaling:
    """Return the scaling of a point and a multiplier (4,) inside the cone."""
    root_v, root_z = casadi.sqrt(_det(v)), casadi.sqrt(_det(z))
    over_v, over_z = reciprocal(root_v), reciprocal(root_z)
    a, b = v * over_v, z * over_z
    gamma = casadi.sqrt(0.5 * (1.0 + casadi.dot(a, b)))
    half = 0.5 * reciprocal(gamma)
    w0, w1 = half * (a[0] + b[0]), half * (a[1:] - b[1:])
    length = casadi.norm_2(w1)
    d = w1 * reciprocal(casadi.fmax(length, TINY))
    d[2] += length <= 0.0  # any direction will do
    # a frame without branches: Duff et al. 2017, "Building an orthonormal basis, revisited"
    sign = casadi.copysign(1.0, d[2])
    one = -sign * reciprocal(1.0 + casadi.fabs(d[2]))
    two = d[0] * d[1] * one
    p1 = casadi.vertcat(1.0 + sign * d[0] ** 2 * one, sign * two, -sign * d[0])
    p2 = casadi.vertcat(two, sign + d[1] ** 2 * one, -d[1])
    stretch, eta = w0 + length, casadi.sqrt(root_v * over_z)
    shrunk, over_eta = reciprocal(stretch), reciprocal(eta)
    return ConeScaling(
        casadi.horzcat(d, p1, p2),
        casadi.vertcat(eta * shrunk, eta, eta * stretch),
        casadi.vertcat(over_eta * stretch, over_eta, over_eta * shrunk),
        root_v * root_z,
    )


def barrier(v: Any) -> Any:
    """Return the inverse of v in the cone's algebra, (4,): minus half the gradient of its logarithmic barrier."""
    return casadi.vertcat(v[0], -v[1:]) * reciprocal(_det(v))


def turn(frame: Any, z: Any) -> Any:
    """Return E' z, the coordinates of what acts on v, (4,) or (4, any)."""
    rest = frame.T @ z[1:, :]
    return casadi.vertcat(z[0, :] - rest[0, :], rest[1, :], rest[2, :], z[0, :] + rest[0, :])


def back(frame: Any, v: Any) -> Any:
    """Return E v, the point (4,) of coordinates v."""
    return casadi.vertcat(v[0] + v[3], frame @ casadi.vertcat(v[3] - v[0], v[1], v[2]))


def back_acting(frame: Any, z: Any) -> Any:
    """Return what has the coordinates E' z, (4,)."""
    return back(frame, z * OVER_SQUARES)


def jordan(w: ConeScaling, z: Any, dv: Any, dz: Any) -> tuple[Any, Any]:
    """Return (1 / longest step that stays inside, W^-1 of what a full step adds to complementarity).

    Args:
        w: The scaling.
        z: Coordinates of the multiplier, (4,).
        dv: Those of the point's step.
        dz: Those of the multiplier's step.
    """
    middle, dz = _plain(w.values * z * OVER_SQUARES), _plain(w.values * dz * OVER_SQUARES)
    dv = _plain(dv * w.inverses)
    size = casadi.sqrt(w.det)
    over = reciprocal(size)
    unit = middle * over
    tilt = reciprocal(unit[0] + 1.0)
    blocked = []
    for step in (dv, dz):  # Andersen, Dahl & Vandenberghe, CVXOPT: steps to the boundary
        along = (unit[0] * step[0] - casadi.dot(unit[1:], step[1:])) * over
        across = step[1:] * over - ((along + step[0] * over) * tilt) * unit[1:]
        blocked.append(casadi.norm_2(across) - along)
    product = casadi.vertcat(casadi.dot(dv, dz), dv[0] * dz[1:] + dz[0] * dv[1:])
    first = (middle[0] * product[0] - casadi.dot(middle[1:], product[1:])) * over**2
    rest = (product[1:] - first * middle[1:]) * reciprocal(middle[0])
    added = casadi.vertcat(first - rest[0], rest[1], rest[2], first + rest[0]) * w.inverses
    return casadi.fmax(*blocked), added


def _det(v: Any) -> Any:
    length = casadi.norm_2(v[1:])
    return casadi.fmax((v[0] - length) * (v[0] + length), TINY)


def _four(three: Any) -> Any:
    """The middle one twice."""
    return casadi.vertcat(three[0], three[1], three[1], three[2])


def _plain(v: Any) -> Any:
    """From coordinates to (0, d, p1, p2)."""
    return casadi.vertcat(v[0] + v[3], v[3] - v[0], v[1], v[2])
