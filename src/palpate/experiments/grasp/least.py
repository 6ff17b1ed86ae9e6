"""The least grip that holds a load, by the simulation's truth: what a grasp is measured by."""

import math
from collections.abc import Sequence

import numpy as np
from scipy.optimize import linprog

from palpate.controllers.grip.need import least_grip_of_two
from palpate.errors import FloatArray
from palpate.friction.limit_surface import LimitSurface
from palpate.friction.p_norm import p_norm
from palpate.spatial import Vector, Wrench

CLOSE = 1e-3
"""By which share of the mean force a load may lie beyond a limit: so much too small the grip may come out."""

ROUNDS = 40
"""Never reached: each doubles about how close it comes."""

TWO = 2

TINY = 1e-6
"""[m] Stands for an e of nothing, of a finger that does not press."""


def least_grip(
    surface: LimitSurface, load: Wrench, contacts: Sequence[Vector], normals: Sequence[Vector]
) -> float:
    """Return the least force [N], mean over the fingers, with which they hold an object: see `least_forces`."""
    forces = least_forces(surface, load, contacts, normals)
    return sum(forces) / len(forces)


def least_forces(
    surface: LimitSurface, load: Wrench, contacts: Sequence[Vector], normals: Sequence[Vector]
) -> tuple[float, ...]:
    """Return the normal forces [N] of the least sum with which fingers, all of one material, hold an object.

    Of two it is `least_grip_of_two`, exactly. Of more: each finger presses with its own force along its normal,
    with a tangential force and a spin torque within the limit surface; the sum is minimised over all that balance
    the load: a cone programme, solved by cutting planes. Where e grows with the force, what is borne is no convex
    set: then it is solved for constant e, those of the forces found before, until both agree. The larger e, the
    less grip; so they do at one grip only, and each round errs by gamma times what the one before did.

    Args:
        surface: What each contact really bears.
        load: What acts on the object besides the fingers, about the origin [N, N m].
        contacts: Where the fingers touch [m].
        normals: Unit vectors into the object.

    Returns:
        One per finger; all infinite if nothing holds it.
    """
    if len(contacts) == TWO:
        return (least_grip_of_two(surface, load, contacts[0], contacts[1]),) * TWO
    wrench, at, n = np.array(load), np.array(contacts), np.array(normals)
    before = np.ones(len(contacts))
    least = _least_of_many(surface, before, wrench, at, n)
    while surface.load_exponent and np.isfinite(least).all() and _differ(least, before):
        least, before = _least_of_many(surface, least, wrench, at, n), least
    return tuple(least.tolist())


def _differ(forces: FloatArray, others: FloatArray) -> bool:
    return float(np.abs(forces - others).max()) > CLOSE * float(forces.max())


def _least_of_many(
    surface: LimitSurface, pressed: FloatArray, load: FloatArray, contacts: FloatArray, normals: FloatArray
) -> FloatArray:
    """Minimise the sum of f over (per finger f, two tangential components, a torque over e) by cutting planes.

    Each finger's z, two tangential components and a torque over e, must lie within the limit surface at f: that is
    d . z <= mu f for the gradient d of its norm at every point. Planes are added where the solution of the round
    before violates them, until none does by more than `CLOSE`. e is that of the forces `pressed` [N].
    """
    mu, power, n = surface.friction, surface.norm_exponent, len(contacts)
    lengths = [surface.spin_length_at(force) for force in pressed.tolist()]
    A = np.zeros((6, 4 * n))
    for i, (p, q) in enumerate(zip(contacts, normals, strict=True)):
        aside = np.cross(q, [0.0, 0.0, 1.0] if abs(q[2]) < 0.9 else [1.0, 0.0, 0.0])
        aside /= np.linalg.norm(aside)
        for k, direction in enumerate((q, aside, np.cross(q, aside))):
            A[:, 4 * i + k] = (*direction, *np.cross(p, direction))
        A[3:, 4 * i + 3] = lengths[i] * q
    e = max(max(lengths), TINY)
    scale = np.array([1.0, 1.0, 1.0, 1.0 / e, 1.0 / e, 1.0 / e])
    planes = [_plane(i, n, d, mu) for i in range(n) for d in (*np.eye(3), *-np.eye(3))]
    forces = np.full(n, math.inf)
    for _ in range(ROUNDS):
        found = linprog(
            np.tile([1.0, 0.0, 0.0, 0.0], n),
            A_ub=np.array(planes),
            b_ub=np.zeros(len(planes)),
            A_eq=A * scale[:, None],
            b_eq=-load * scale,
            bounds=[(0.0, None), (None, None), (None, None), (None, None)] * n,
        )
        if not found.success:
            return np.full(n, math.inf)
        x = np.asarray(found.x).reshape(n, 4)
        forces, worst = x[:, 0].copy(), 0.0
        for i, (f, z) in enumerate(zip(forces.tolist(), x[:, 1:], strict=True)):
            size, direction = _norm(z, power) if z.any() else (0.0, z)
            if size > mu * f * (1.0 + 1e-12):
                worst = max(worst, (size - mu * f) / (mu * float(forces.mean())))
                planes.append(_plane(i, n, direction, mu))
        if worst < CLOSE:
            break
    return forces


def _norm(z: FloatArray, p: float) -> tuple[float, FloatArray]:
    """|(|(z_1, z_2)|, z_3)|_p and its gradient, which times z is the norm; z is not 0."""
    force, torque = float(np.hypot(z[0], z[1])), abs(float(z[2]))
    size = p_norm(force, torque, p)
    along = (force / size) ** (p - 1.0) / force if force > 0.0 else 0.0
    about = math.copysign((torque / size) ** (p - 1.0), z[2]) if torque > 0.0 else 0.0
    return size, np.array([along * z[0], along * z[1], about])


def _plane(i: int, n: int, direction: FloatArray, mu: float) -> FloatArray:
    row = np.zeros(4 * n)
    row[4 * i] = -mu
    row[4 * i + 1 : 4 * i + 4] = direction
    return row
