"""Residual of equilibrium and margins of the contacts, compiled, for every solution."""

import math
from typing import Any

from palpate.compiling import njit
from palpate.grasp.solvers.dual_newton import MU, E

__all__ = ["balance"]


@njit(cache=True, error_model="numpy")
def balance(
    rows: Any, center: Any, length: float, held: Any, eps: float, forces: Any, residual: Any, margins: Any
) -> float:
    """Fill residual (6,) [N, N m] and margins (n,) [N]; return the effort [N^2].

    Args:
        rows: Contacts, scaled, shape (n, ROW): see `dual_newton`.
        center: Point about which they take moments, shape (3,) [m].
        length: Unit of their lengths [m].
        held: What the forces are to balance, about the object's origin, shape (6,) [N, N m].
        eps: Weight of friction in the effort.
        forces: (f_n, f_t1, f_t2, tau) of each contact, shape (n, 4) [N, N, N, N m].
        residual: Moments about the object's origin.
        margins: mu f_n less what friction bears.
    """
    effort = 0.0
    cx, cy, cz = center[0], center[1], center[2]
    rx, ry, rz, mx, my, mz = held[0], held[1], held[2], held[3], held[4], held[5]
    for i in range(rows.shape[0]):
        c = rows[i]
        f, t1, t2, spin = forces[i, 0], forces[i, 1], forces[i, 2], forces[i, 3]
        twist = spin / (c[E] * length)
        used = t1 * t1 + t2 * t2 + twist * twist
        effort += f * f + eps * used
        margins[i] = c[MU] * f - math.sqrt(used)
        px, py, pz = c[0] * length + cx, c[1] * length + cy, c[2] * length + cz
        fx = f * c[3] + t1 * c[6] + t2 * c[9]
        fy = f * c[4] + t1 * c[7] + t2 * c[10]
        fz = f * c[5] + t1 * c[8] + t2 * c[11]
        rx += fx
        ry += fy
        rz += fz
        mx += py * fz - pz * fy + spin * c[3]
        my += pz * fx - px * fz + spin * c[4]
        mz += px * fy - py * fx + spin * c[5]
    residual[0], residual[1], residual[2] = rx, ry, rz
    residual[3], residual[4], residual[5] = mx, my, mz
    return effort
