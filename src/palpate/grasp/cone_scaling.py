"""Nesterov-Todd scaling of a second-order cone, in the coordinates in which it is diagonal.

For a point v and a multiplier z inside the cone there is one symmetric W with W z = W^-1 v. Its eigenvectors are
(1, -d) / sqrt 2, p1, p2 and (1, d) / sqrt 2 with a unit vector d and two across, and its eigenvalues eta /
stretch, eta, eta, eta stretch. Near the optimum these differ by 1e10: kept apart, they do not drown each other.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi

__all__ = ["HALF", "ConeScaling", "back", "barrier", "jordan", "scaling", "turn"]

SX = casadi.SX

HALF = 0.5**0.5

TINY = 1e-300
"""Keeps quotients of zeros finite."""


@dataclass(frozen=True, slots=True, eq=False)
class ConeScaling:
    """W of one cone.

    Attributes:
        frame: [d p1 p2], (3, 3).
        stretch: Of the eigenvalues, at least 1.
        eta: Their middle.
        det: Of the scaled point lambda = W z: lambda_0^2 - |lambda_1|^2.
    """

    frame: Any
    stretch: Any
    eta: Any
    det: Any

    @property
    def values(self) -> Any:
        """Eigenvalues of W, (4,)."""
        return casadi.vertcat(self.eta / self.stretch, self.eta, self.eta, self.eta * self.stretch)

    @property
    def curvature(self) -> Any:
        """Eigenvalues of W^-2, (4,)."""
        middle = 1.0 / self.eta**2
        return casadi.vertcat(middle * self.stretch**2, middle, middle, middle / self.stretch**2)


def scaling(v: Any, z: Any) -> ConeScaling:
    """Return the scaling of a point and a multiplier (4,) inside the cone."""
    root_v, root_z = casadi.sqrt(_det(v)), casadi.sqrt(_det(z))
    a, b = v / root_v, z / root_z
    gamma = casadi.sqrt(0.5 * (1.0 + casadi.dot(a, b)))
    w0, w1 = (a[0] + b[0]) / (2.0 * gamma), (a[1:] - b[1:]) / (2.0 * gamma)
    length = casadi.norm_2(w1)
    d = casadi.if_else(length > 0.0, w1 / length, SX([0.0, 0.0, 1.0]))
    # a frame without branches: Duff et al. 2017, "Building an orthonormal basis, revisited"
    sign = casadi.copysign(1.0, d[2])
    one = -1.0 / (sign + d[2])
    two = d[0] * d[1] * one
    p1 = casadi.vertcat(1.0 + sign * d[0] ** 2 * one, sign * two, -sign * d[0])
    p2 = casadi.vertcat(two, sign + d[1] ** 2 * one, -d[1])
    return ConeScaling(casadi.horzcat(d, p1, p2), w0 + length, casadi.sqrt(root_v / root_z), root_v * root_z)


def barrier(v: Any) -> Any:
    """Return the inverse of v in the cone's algebra, (4,): minus half the gradient of its logarithmic barrier."""
    return casadi.vertcat(v[0], -v[1:]) / _det(v)


def turn(frame: Any, v: Any) -> Any:
    """Return the coordinates of v (4,) or (4, any) along the eigenvectors."""
    rest = frame.T @ v[1:, :]
    return casadi.vertcat(HALF * (v[0, :] - rest[0, :]), rest[1, :], rest[2, :], HALF * (v[0, :] + rest[0, :]))


def back(frame: Any, v: Any) -> Any:
    """Return v (4,) from its coordinates along the eigenvectors."""
    rest = frame @ casadi.vertcat(HALF * (v[3] - v[0]), v[1], v[2])
    return casadi.vertcat(HALF * (v[0] + v[3]), rest)


def jordan(w: ConeScaling, z: Any, dv: Any, dz: Any) -> tuple[Any, Any]:
    """Return (1 / longest step that stays inside, W^-1 of what a full step adds to complementarity).

    Args:
        w: The scaling.
        z: Multiplier, along the eigenvectors, (4,).
        dv: Step of the point, along the eigenvectors.
        dz: Step of the multiplier, along the eigenvectors.
    """
    middle, dv, dz = _plain(w.values * z), _plain(dv / w.values), _plain(w.values * dz)
    size = casadi.sqrt(w.det)
    unit = middle / size
    blocked = []
    for step in (dv, dz):  # Andersen, Dahl & Vandenberghe, CVXOPT: steps to the boundary
        along = (unit[0] * step[0] - casadi.dot(unit[1:], step[1:])) / size
        across = step[1:] / size - (along + step[0] / size) / (unit[0] + 1.0) * unit[1:]
        blocked.append(casadi.norm_2(across) - along)
    product = casadi.vertcat(casadi.dot(dv, dz), dv[0] * dz[1:] + dz[0] * dv[1:])
    first = (middle[0] * product[0] - casadi.dot(middle[1:], product[1:])) / w.det
    rest = (product[1:] - first * middle[1:]) / middle[0]
    added = casadi.vertcat(HALF * (first - rest[0]), rest[1], rest[2], HALF * (first + rest[0])) / w.values
    return casadi.fmax(*blocked), added


def _det(v: Any) -> Any:
    length = casadi.norm_2(v[1:])
    return casadi.fmax((v[0] - length) * (v[0] + length), TINY)


def _plain(v: Any) -> Any:
    """From coordinates along the eigenvectors to (0, d, p1, p2)."""
    return casadi.vertcat(HALF * (v[0] + v[3]), HALF * (v[3] - v[0]), v[1], v[2])
