"""A grasp in numbers of about one: moments about the middle of the contacts, lengths over its size."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.compiling import njit
from palpate.errors import FloatArray
from palpate.grasp.problem.contacts import GraspContacts
from palpate.grasp.solvers.dual_newton import HI, LO, MU, RESERVE, ROW, T1, T2, E, N, P

__all__ = ["ScaledGrasp", "scale_load"]

LEAST_UNIT = 1e-250
"""[N] Loads far below count as none: their squares do not exist."""


@njit(cache=True, error_model="numpy")
def scale_load(rows: Any, center: Any, length: float, wrench: Any, load: Any) -> float:
    """Fill the scaled load (6,); return its unit of force [N]: the load's size, or a preload's if that is more.

    A preload far above the load balances itself only to rounding, which the load's tolerance must not judge.

    Args:
        rows: Contacts, shape (n, ROW), forces in newtons.
        center: Point about which moments are taken, shape (3,) [m].
        length: Unit of lengths [m].
        wrench: The load about the object's origin, shape (6,) [N, N m].
        load: Array for the result.
    """
    cx, cy, cz = center[0], center[1], center[2]
    wx, wy, wz = wrench[0], wrench[1], wrench[2]
    load[0], load[1], load[2] = wx, wy, wz
    load[3] = (wrench[3] - cy * wz + cz * wy) / length
    load[4] = (wrench[4] - cz * wx + cx * wz) / length
    load[5] = (wrench[5] - cx * wy + cy * wx) / length
    pressed = 0.0
    for i in range(rows.shape[0]):
        kept = rows[i, RESERVE]
        if kept != 0.0:
            for k in range(3):
                load[k] += kept * rows[i, N + k]
            load[3] += kept * (rows[i, P + 1] * rows[i, N + 2] - rows[i, P + 2] * rows[i, N + 1])
            load[4] += kept * (rows[i, P + 2] * rows[i, N] - rows[i, P] * rows[i, N + 2])
            load[5] += kept * (rows[i, P] * rows[i, N + 1] - rows[i, P + 1] * rows[i, N])
        pressed = max(pressed, rows[i, LO], kept)
    largest = 0.0
    for k in range(6):
        largest = max(largest, abs(load[k]))
    total = 0.0
    if largest > LEAST_UNIT:
        for k in range(6):
            total += (load[k] / largest) ** 2
    size = max(largest * math.sqrt(total), pressed)
    if not size > LEAST_UNIT:
        size = 1.0
    for k in range(6):
        load[k] /= size
    return size


@dataclass(frozen=True, slots=True, eq=False)
class ScaledGrasp:
    """The rows that solvers work on; forces in them, bounds and reserves, are in newtons still.

    Attributes:
        rows: One per contact, shape (n, ROW): see `dual_newton`.
        center: Point about which moments are taken, object frame, shape (3,) [m].
        length: Unit of lengths [m]: the farthest contact's distance from there, or the largest e.
    """

    rows: FloatArray
    center: FloatArray
    length: float

    @classmethod
    def of(cls, grasp: GraspContacts, reserve: FloatArray | None = None) -> "ScaledGrasp":
        """Return a grasp's rows, e that of 1 N.

        Args:
            grasp: Any.
            reserve: Share of each friction limit that is kept back, shape (n,) [N]: |u| <= mu f_n - reserve.
        """
        center = grasp.positions.mean(axis=0)
        arms = grasp.positions - center
        length = max(float(np.sqrt((arms**2).sum(axis=1).max())), float(grasp.spin_length.max()))
        rows = np.zeros((len(grasp), ROW))
        rows[:, P : P + 3] = arms / length
        for column, start in enumerate((N, T1, T2)):
            rows[:, start : start + 3] = grasp.frames[:, :, column]
        rows[:, E] = grasp.spin_length / length
        rows[:, MU], rows[:, LO], rows[:, HI] = grasp.friction, grasp.force_min, grasp.force_max
        made = cls(rows, center, length)
        return made if reserve is None else made.keeping(grasp.friction, rows[:, E], reserve)

    def keeping(self, friction: FloatArray, spin_length: FloatArray, reserve: FloatArray) -> "ScaledGrasp":
        """Return the same contacts with another mu and e, scaled, and `reserve` [N] of each limit kept back."""
        rows, kept = self.rows.copy(), reserve / friction
        rows[:, MU], rows[:, E], rows[:, RESERVE] = friction, spin_length, kept
        rows[:, LO] = np.maximum(rows[:, LO] - kept, 0.0)
        rows[:, HI] -= kept
        return type(self)(rows, self.center, self.length)

    def load(self, wrench: FloatArray) -> tuple[FloatArray, float]:
        """Return the load in units of what matters, shape (6,), and that unit [N]: see `scale_load`.

        Args:
            wrench: About the object's origin, shape (6,) [N, N m].
        """
        load = np.empty(6)
        size = scale_load(self.rows, self.center, self.length, wrench, load)
        return load, size

    def sized(self, size: float) -> FloatArray:
        """Return the rows with forces in units of `size` [N], shape (n, ROW)."""
        rows = self.rows.copy()
        rows[:, [LO, HI, RESERVE]] /= size
        return rows

    def forces(self, scaled: FloatArray, size: float) -> FloatArray:
        """Return (f_n, f_t1, f_t2, tau) [N, N, N, N m] of scaled (f, u1, u2, u3), both (n, 4)."""
        forces = scaled * size
        forces[:, 0] += self.rows[:, RESERVE]
        forces[:, 3] *= self.rows[:, E] * self.length
        return forces

    def multiplier(self, y: FloatArray) -> FloatArray:
        """Return what multiplies a wrench about the object's origin where y (6,) multiplies a scaled one."""
        p, q, r, *turned = y.tolist()
        u, v, w = (each / self.length for each in turned)
        a, b, c = self.center.tolist()
        return np.array([p + b * w - c * v, q + c * u - a * w, r + a * v - b * u, u, v, w])

    def actuators(self, maps: FloatArray, limits: FloatArray, size: float) -> tuple[FloatArray, FloatArray]:
        """Return actuator rows for scaled (f, u1, u2, u3), shape (n, k, 4), and their limits, (n, k).

        Each row is divided by its limit, which is 1 then.
        """
        unit = np.ones((len(self.rows), 1, 4))
        unit[:, 0, 3] = self.rows[:, E] * self.length
        return maps * unit * size / limits[:, :, None], np.ones_like(limits)
