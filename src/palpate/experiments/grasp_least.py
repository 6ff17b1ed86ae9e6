"""The least grip that holds a load, by the simulation's truth: what a grasp is measured by."""

import math
from collections.abc import Sequence

import numpy as np
from scipy.optimize import linprog

from palpate.controllers.grip.need import least_grip_of_two
from palpate.errors import FloatArray
from palpate.friction.limit_surface import LimitSurface
from palpate.spatial import Vector, Wrench

CLOSE = 1e-3
"""By which share a load may lie beyond the limit surface: so much too small the least grip may come out."""

ROUNDS = 40
"""Never reached: each doubles about how close it comes."""


def least_grip(
    surface: LimitSurface, load: Wrench, contacts: Sequence[Vector], normals: Sequence[Vector]
) -> float:
    """Return the least force [N] with which fingers, all alike, hold an object, sharing its load as best they can.

    Of two it is `least_grip_of_two`, exactly. Of more: each finger presses with f along its normal, with a
    tangential force and a spin torque within the limit surface; f is minimised over all shares that balance the
    load: a cone programme, solved by cutting planes.

    Args:
        surface: What each contact really bears; of three fingers with p = 2 and gamma = 0.
        load: What acts on the object besides the fingers, about the origin [N, N m].
        contacts: Where the fingers touch [m].
        normals: Unit vectors into the object.
    """
    if len(contacts) == 2:
        return least_grip_of_two(surface, load, contacts[0], contacts[1])
    return _least_of_many(surface, np.array(load), np.array(contacts), np.array(normals))


def _least_of_many(surface: LimitSurface, load: FloatArray, contacts: FloatArray, normals: FloatArray) -> float:
    """Minimise f over (f, per finger two tangential components and a torque over e), cutting planes for the rest.

    A vector z lies within the ball of radius mu f if d . z <= mu f for every unit d. Planes are added where the
    solution of the round before violates them, until none does by more than `CLOSE`.
    """
    e, mu, n = surface.spin_length, surface.friction, len(contacts)
    A = np.zeros((6, 1 + 3 * n))
    for i, (p, q) in enumerate(zip(contacts, normals, strict=True)):
        aside = np.cross(q, [0.0, 0.0, 1.0] if abs(q[2]) < 0.9 else [1.0, 0.0, 0.0])
        aside /= np.linalg.norm(aside)
        up = np.cross(q, aside)
        A[:, 0] += (*q, *np.cross(p, q))
        for k, direction in enumerate((aside, up)):
            A[:, 1 + 3 * i + k] = (*direction, *np.cross(p, direction))
        A[3:, 1 + 3 * i + 2] = e * q
    scale = np.array([1.0, 1.0, 1.0, 1.0 / e, 1.0 / e, 1.0 / e])
    cost = np.zeros(1 + 3 * n)
    cost[0] = 1.0
    planes = [_plane(i, n, d, mu) for i in range(n) for d in (*np.eye(3), *-np.eye(3))]
    least = math.nan
    for _ in range(ROUNDS):
        found = linprog(
            cost,
            A_ub=np.array(planes),
            b_ub=np.zeros(len(planes)),
            A_eq=A * scale[:, None],
            b_eq=-load * scale,
            bounds=[(0.0, None)] + [(None, None)] * (3 * n),
        )
        if not found.success:
            return math.inf
        x = np.asarray(found.x)
        least, worst = float(x[0]), 0.0
        for i in range(n):
            z = x[1 + 3 * i : 4 + 3 * i]
            size = float(np.linalg.norm(z))
            if size > mu * least * (1.0 + 1e-12):
                worst = max(worst, size / (mu * least) - 1.0 if least > 0.0 else math.inf)
                planes.append(_plane(i, n, z / size, mu))
        if worst < CLOSE:
            break
    return least


def _plane(i: int, n: int, direction: FloatArray, mu: float) -> FloatArray:
    row = np.zeros(1 + 3 * n)
    row[0] = -mu
    row[1 + 3 * i : 4 + 3 * i] = direction
    return row
