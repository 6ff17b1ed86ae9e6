"""A grasp in numbers of about one: moments about the middle of the contacts, lengths over its size."""

import math
from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray
from palpate.grasp.contacts import GraspContacts
from palpate.grasp.dual_newton import HI, LO, MU, RESERVE, ROW, T1, T2, E, N, P

__all__ = ["ScaledGrasp"]


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
        """Return the load in units of its own size, shape (6,), and that size [N].

        Args:
            wrench: About the object's origin, shape (6,) [N, N m].
        """
        x, y, z, *moment = wrench.tolist()
        a, b, c = self.center.tolist()
        turned = (b * z - c * y, c * x - a * z, a * y - b * x)
        load = np.array([x, y, z, *((m - t) / self.length for m, t in zip(moment, turned, strict=True))])
        reserve = self.rows[:, RESERVE]
        if reserve.any():
            pressed = reserve[:, None] * self.rows[:, N : N + 3]
            load[:3] += pressed.sum(axis=0)
            load[3:] += np.cross(self.rows[:, P : P + 3], pressed).sum(axis=0)
        size = math.sqrt(float(load @ load))
        if size == 0.0:
            size = max(float(self.rows[:, [LO, RESERVE]].max()), 0.0) or 1.0
        return load / size, size

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
