"""Grasp forces under limits that couple contacts, in numbers of about one: what `conic` solves.

Unknowns are v_i = (f, u1, u2, u3) of each contact over the load, u3 = tau / c, then theta where the objective has
one: see `statement`.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from palpate.errors import FloatArray
from palpate.grasp.problem.convex_forms import Quadratic
from palpate.grasp.problem.limits import CoupledLimits
from palpate.grasp.problem.objective_spec import Objective
from palpate.grasp.problem.scaled import ScaledGrasp
from palpate.grasp.solvers.conic import ConicProgramme
from palpate.grasp.solvers.dual_newton import HI, LO, MU, E, N

__all__ = ["CoupledProgramme"]


class CoupledProgramme:
    """The problem of one grasp, for one load after another.

    Attributes:
        contacts: n.
        units: What turns v into (f_n, f_t1, f_t2, tau_n), over the load, shape (4 n,): ones and c [m].
        size: Of the last load [N].
        unit: What the objective was divided by.
        first: Where rows of coupled limits begin.
        weights: By which equations and rows of coupled limits were multiplied, in newtons of the last load.
    """

    def __init__(
        self,
        scaled: ScaledGrasp,
        objective: Objective | Quadratic,
        effort_weight: float,
        limits: CoupledLimits,
    ) -> None:
        """Put together all that does not depend on the load."""
        n = self.contacts = len(scaled.rows)
        self._objective, self._scaled = objective, scaled
        theta = isinstance(objective, Objective) and objective is not Objective.MIN_EFFORT
        size = 4 * n + theta
        rows = scaled.rows
        self.units = np.ones(4 * n)
        self.units[3::4] = rows[:, E] * scaled.length

        axes = rows[:, N : N + 9].reshape(n, 3, 3)
        wrench = np.zeros((6, n, 4))
        wrench[:3, :, :3] = axes.transpose(2, 0, 1)
        wrench[3:, :, :3] = np.cross(rows[:, None, :3], axes).transpose(2, 0, 1)
        wrench[3:, :, 3] = (axes[:, 0] * rows[:, [E]]).T
        sizes_a = _largest(limits.A * self.units)
        self._A = np.zeros((6 + len(limits.b), size))
        self._A[:6, : 4 * n] = wrench.reshape(6, -1)
        self._A[6:, : 4 * n] = limits.A * self.units / sizes_a[:, None]
        self._b = np.concatenate([np.zeros(6), limits.b / sizes_a])

        normal = np.zeros((n, size))
        normal[np.arange(n), 4 * np.arange(n)] = 1.0
        bounded = rows[:, HI] < np.inf
        peak = normal.copy()
        peak[:, -1] = -1.0
        peaks = peak if objective is Objective.MIN_PEAK else np.zeros((0, size))
        cones = np.zeros((n, 4, size))
        for i in range(n):
            cones[i, :, 4 * i : 4 * i + 4] = -np.diag([rows[i, MU], 1.0, 1.0, 1.0])
        if objective is Objective.MAX_MARGIN:
            cones[:, 0, -1] = 1.0
        coupled = np.zeros((len(limits.h), size))
        coupled[:, : 4 * n] = limits.G * self.units
        starts = np.cumsum([0, *limits.sizes])
        block = np.repeat(np.arange(len(limits.sizes)), limits.sizes)
        each = _largest(coupled)
        sizes_g = np.array([each[a:b].max() for a, b in pairwise(starts.tolist())])[block]
        self._G = np.concatenate(
            [-normal, normal[bounded], peaks, cones.reshape(4 * n, size), coupled / sizes_g[:, None]]
        )
        many = n + int(bounded.sum()) + len(peaks)
        self.first = many + 4 * n
        self._h = np.concatenate(
            [-rows[:, LO], rows[bounded, HI], np.zeros(len(peaks) + 4 * n), limits.h / sizes_g]
        )
        self.blocks = np.concatenate(
            [np.arange(many), many + 4 * np.arange(n), self.first + starts.astype(np.int64)]
        ).astype(np.int64)
        self._row_block = np.repeat(np.arange(len(self.blocks) - 1), np.diff(self.blocks))
        self._row_sizes = sizes_a, sizes_g

        self._P, self._q = np.zeros((size, size)), np.zeros(size)
        if isinstance(objective, Quadratic):
            self._P[:, :] = self.units[:, None] * objective.P * self.units
            self._q[:] = objective.q * self.units
        elif objective is Objective.MIN_EFFORT:
            np.fill_diagonal(self._P, np.tile([2.0, *3 * [2.0 * effort_weight]], n))
        else:
            self._q[-1] = 1.0 if objective is Objective.MIN_PEAK else -1.0
        self._largest = float(np.abs(self._P).max()), float(np.abs(self._q).max())

    @property
    def rows(self) -> tuple[int, ...]:
        """How many equations there are, and where blocks of limits begin: alike, solutions are near each other."""
        return len(self._b), *self.blocks.tolist()

    def of(self, load: FloatArray, size: float) -> ConicProgramme:
        """Return the problem for a load.

        Args:
            load: Scaled, shape (6,).
            size: Its unit [N].
        """
        A, b, h = self._A, self._b / size, self._h / size
        factor = self._objective is Objective.LOAD_FACTOR
        length = float(np.linalg.norm(load)) or 1.0
        if factor:
            A = A.copy()
            A[:6, -1] = load / length
        else:
            b[:6] = -load
        # far limits are rows of about 1 with hardly a slope, not large numbers
        far = np.maximum(1.0, np.maximum.reduceat(np.abs(h), self.blocks[:-1]))[self._row_block]
        over = np.maximum(1.0, np.abs(b[6:]))
        if over.size:
            A = A.copy()
            A[6:] /= over[:, None]
            b[6:] /= over
        P, q = self._P, self._q
        self.size, self.unit = size, 1.0 / length if factor else size
        if self._objective is Objective.MIN_EFFORT:
            self.unit = size * size
        elif isinstance(self._objective, Quadratic):
            square, line = size * size * self._largest[0], size * self._largest[1]
            self.unit = max(square, line) or 1.0
            P, q = P * (size * size / self.unit), q * (size / self.unit)
        sizes_a, sizes_g = self._row_sizes
        self.weights = 1.0 / (sizes_a * over * size), 1.0 / (sizes_g * far[self.first :] * size)
        return ConicProgramme(P, q, A, b, self._G / far[:, None], h / far, self.blocks)

    def theta(self, v: FloatArray) -> float:
        """Return the margin [N], the peak [N] or the load factor."""
        return float(v[-1]) * self.unit

    def forces(self, v: FloatArray) -> FloatArray:
        """Return (f_n, f_t1, f_t2, tau_n) of all contacts, shape (4 n,) [N, N, N, N m]."""
        return np.asarray(v[: 4 * self.contacts] * (self.units * self.size))


def _largest(rows: FloatArray) -> FloatArray:
    """Return the largest entry of each row; 1 where all are 0."""
    most = np.abs(rows).max(axis=1, initial=0.0)
    return np.where(most > 0.0, most, 1.0)
