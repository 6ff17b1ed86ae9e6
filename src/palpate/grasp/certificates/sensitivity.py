"""Sensitivity of effort and grip to mu and e of each contact, from the optimality conditions.

Effort J = sum f^2 + eps |u|^2 changes as its Lagrangian does: dJ/dmu_i = -lambda_i f_i, with lambda_i what
multiplies |u_i| <= mu_i f_i, and dJ/de_i = y . d(G w)/de_i. Grip, the sum of f_n, is not what was minimised: y
changes, too, by H dy = d(A x)/dtheta, H the dual's Hessian, and f with it.
"""

from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray, InvalidValueError, vector
from palpate.grasp.problem.cone_check import check_cones
from palpate.grasp.problem.contacts import GraspContacts
from palpate.grasp.problem.scaled import ScaledGrasp
from palpate.grasp.solvers.dual_newton import HI, LO, MU, T1, T2, E, N, P, evaluate
from palpate.grasp.solvers.least_effort import LeastEffort, Outcome

__all__ = ["GripSensitivity", "grip_sensitivity"]


@dataclass(frozen=True, slots=True, eq=False)
class GripSensitivity:
    """How least effort and its grip change with each mu and e.

    One-sided where a contact just begins to slide or to press.

    Attributes:
        effort_by_friction: dJ/dmu, shape (n,) [N^2]; never positive.
        effort_by_spin_length: dJ/de, shape (n,) [N^2/m]; never positive.
        grip_by_friction: d(sum f_n)/dmu, shape (n,) [N].
        grip_by_spin_length: d(sum f_n)/de, shape (n,) [N/m].
    """

    effort_by_friction: FloatArray
    effort_by_spin_length: FloatArray
    grip_by_friction: FloatArray
    grip_by_spin_length: FloatArray


def grip_sensitivity(grasp: GraspContacts, load: FloatArray, effort_weight: float = 0.01) -> GripSensitivity:
    """Return what mu and e of each contact are worth under a load.

    Args:
        grasp: Whose limits are cones, without actuator limits.
        load: What else acts on the object, about its origin, shape (6,) [N, N m].
        effort_weight: eps.

    Raises:
        InvalidValueError: A load that is not held, or a grasp beyond cones.
    """
    check_cones(grasp, "sensitivities are")
    wrench, scaled = np.array(vector("load", load, 6, "N, N m")), ScaledGrasp.of(grasp)
    solver = LeastEffort(scaled, effort_weight)
    if solver.solve(wrench, np.zeros((len(grasp), 4)))[0] != Outcome.SOLVED:
        raise InvalidValueError(f"load = {wrench.tolist()} is not held by this grasp: nothing to differentiate")
    pull, size = scaled.load(wrench)
    rows, y = scaled.sized(size), solver.y
    forces, gradient, lower = np.zeros((len(rows), 4)), np.zeros(7), np.zeros((6, 6))
    evaluate(rows, pull, effort_weight, 0.0, pull, y, forces, gradient, lower)
    hessian = np.tril(lower) + np.tril(lower, -1).T
    each = [_contact(row, x, y, effort_weight) for row, x in zip(rows, forces, strict=True)]
    # where friction and normal forces both stand still y may move freely: the shortest change
    follow = np.linalg.pinv(hessian, rcond=1e-12, hermitian=True) @ np.sum(
        [part.grip_by_y for part in each], axis=0
    )
    grip = np.array([part.force + part.wrench @ follow for part in each])
    effort = np.array([part.effort for part in each])
    length = scaled.length
    return GripSensitivity(
        size**2 * effort[:, 0], size**2 * effort[:, 1] / length, size * grip[:, 0], size * grip[:, 1] / length
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Contact:
    """Derivatives of one contact's response to y, scaled; of mu and e, in this order.

    Attributes:
        effort: Of the Lagrangian, shape (2,).
        force: Of f at the same y, shape (2,).
        wrench: Of A x at the same y, shape (2, 6).
        grip_by_y: df/dy, shape (6,).
    """

    effort: FloatArray
    force: FloatArray
    wrench: FloatArray
    grip_by_y: FloatArray


def _contact(row: FloatArray, x: FloatArray, y: FloatArray, eps: float) -> _Contact:
    mu, e, f, u = row[MU], row[E], x[0], x[1:]
    place, normal = row[P : P + 3], row[N : N + 3]
    axes = [row[start : start + 3] for start in (N, T1, T2)]
    columns = np.zeros((6, 4))
    for k, axis in enumerate(axes):
        columns[:3, k], columns[3:, k] = axis, np.cross(place, axis)
    columns[3:, 3] = e * normal
    g = columns[:, 1:].T @ y
    r, s = float(np.linalg.norm(g)), float(np.linalg.norm(u))
    held = not row[LO] < f < row[HI]
    sliding = mu * f < 0.5 * r / eps
    turn = np.array([0.0, 0.0, g[2] / e])  # dg/de
    force, friction = np.zeros(2), np.zeros((2, 3))
    effort = np.array([0.0, float(u[2] * g[2] / e)])
    grip_by_y = np.zeros(6) if held else -0.5 * columns[:, 0]
    if sliding and r > 0.0:
        stiff, r_e = 1.0 + eps * mu * mu, float(g @ turn) / r
        if not held:
            force[:] = (0.5 * r - 2.0 * eps * mu * f) / stiff, 0.5 * mu * r_e / stiff
            grip_by_y = 0.5 * (mu * columns[:, 1:] @ g / r - columns[:, 0]) / stiff
        size = mu * force + [f, 0.0]  # ds
        friction[0] = -size[0] * g / r
        friction[1] = -size[1] * g / r - s * (turn / r - g * r_e / r**2)
        effort[0] = -(r - 2.0 * eps * s) * f
    elif not sliding:
        friction[1] = -0.5 * turn / eps
    wrench = np.outer(force, columns[:, 0]) + friction @ columns[:, 1:].T
    wrench[1, 3:] += u[2] * normal
    return _Contact(effort, force, wrench, grip_by_y)
