"""The least grip that holds a load, by the simulation's truth: what a grasp is measured by."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import linprog

from palpate.controllers.grip.need import least_grip_of_two
from palpate.errors import FloatArray
from palpate.friction.limit_surface import LimitSurface
from palpate.friction.p_norm import p_norm
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
    load: a cone programme, solved by cutting planes. Where e grows with f, what is borne is no convex set: then it
    is solved for a constant e, that of the grip found before, until both agree. The larger e, the less grip; so
    they do at one grip only, and each round errs by gamma times what the one before did.

    Args:
        surface: What each contact really bears.
        load: What acts on the object besides the fingers, about the origin [N, N m].
        contacts: Where the fingers touch [m].
        normals: Unit vectors into the object.
    """
    if len(contacts) == 2:
        return least_grip_of_two(surface, load, contacts[0], contacts[1])
    wrench, at, n = np.array(load), np.array(contacts), np.array(normals)
    least, before = _least_of_many(_at(surface, 1.0), wrench, at, n), 1.0
    while surface.load_exponent and 0.0 < least < math.inf and abs(least - before) > CLOSE * least:
        least, before = _least_of_many(_at(surface, least), wrench, at, n), least
    return least


def _at(surface: LimitSurface, normal_force: float) -> LimitSurface:
    """The same with e as it is at a normal force [N], whatever the load."""
    return replace(surface, spin_length=surface.spin_length_at(normal_force), load_exponent=0.0)


def _least_of_many(surface: LimitSurface, load: FloatArray, contacts: FloatArray, normals: FloatArray) -> float:
    """Minimise f over (f, per finger two tangential components and a torque over e), cutting planes for the rest.

    Each finger's z, two tangential components and a torque over e, must lie within the limit surface at f: that is
    d . z <= mu f for the gradient d of its norm at every point. Planes are added where the solution of the round
    before violates them, until none does by more than `CLOSE`. e is taken not to grow.
    """
    e, mu, power, n = surface.spin_length, surface.friction, surface.norm_exponent, len(contacts)
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
            size, direction = _norm(z, power)
            if size > mu * least * (1.0 + 1e-12):
                worst = max(worst, size / (mu * least) - 1.0 if least > 0.0 else math.inf)
                planes.append(_plane(i, n, direction, mu))
        if worst < CLOSE:
            break
    return least


def _norm(z: FloatArray, p: float) -> tuple[float, FloatArray]:
    """|(|(z_1, z_2)|, z_3)|_p and its gradient, which times z is the norm; z is not 0."""
    force, torque = float(np.hypot(z[0], z[1])), abs(float(z[2]))
    size = p_norm(force, torque, p)
    along = (force / size) ** (p - 1.0) / force if force > 0.0 else 0.0
    about = math.copysign((torque / size) ** (p - 1.0), z[2]) if torque > 0.0 else 0.0
    return size, np.array([along * z[0], along * z[1], about])


def _plane(i: int, n: int, direction: FloatArray, mu: float) -> FloatArray:
    row = np.zeros(1 + 3 * n)
    row[0] = -mu
    row[1 + 3 * i : 4 + 3 * i] = direction
    return row
