"""Grasps and loads drawn from their uncertainty, to count how often given normal forces hold."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from palpate.grasp.problem.contacts import GraspContacts
from palpate.grasp.problem.scaled import ScaledGrasp
from palpate.grasp.solvers.dual_newton import HI, LO, MU, E, N, P
from palpate.grasp.solvers.least_effort import LeastEffort, Outcome
from support.grasp_families import Reference


class Draws:
    """Grasps and loads as they may really be."""

    def __init__(self, grasp, uncertainty, wrench, rng, count):
        def drawn(covariance):
            return rng.multivariate_normal(np.zeros(len(covariance)), covariance, count, method="eigh")

        n = len(grasp)
        self.friction = grasp.friction + drawn(uncertainty.friction)
        self.spin_length = grasp.spin_length + drawn(uncertainty.spin_length)
        self.positions = grasp.positions + np.stack([drawn(uncertainty.position[i]) for i in range(n)], axis=1)
        tilt = np.stack([drawn(uncertainty.normal[i]) for i in range(n)], axis=1)
        # n x (a t1 + b t2) = a t2 - b t1
        turns = tilt[..., :1] * grasp.frames[:, :, 2] - tilt[..., 1:] * grasp.frames[:, :, 1]
        turned = Rotation.from_rotvec(turns.reshape(-1, 3)).as_matrix().reshape(count, n, 3, 3)
        self.frames = turned @ grasp.frames
        self.loads = wrench + drawn(uncertainty.load)
        self._grasp = grasp

    def failures(self, normal_forces):
        """Return the number of draws whose load no friction within its limits balances."""
        pressing = normal_forces > 1e-6 * normal_forces.max()
        base = ScaledGrasp.of(self._grasp)
        base = replace(base, rows=base.rows[pressing])
        solver, forces = LeastEffort(base, 0.01), np.zeros((int(pressing.sum()), 4))
        failed = 0
        for k in range(len(self.loads)):
            rows = base.rows.copy()
            rows[:, P : P + 3] = (self.positions[k, pressing] - base.center) / base.length
            for column in range(3):
                rows[:, N + 3 * column : N + 3 * column + 3] = self.frames[k, pressing, :, column]
            rows[:, E], rows[:, MU] = self.spin_length[k, pressing] / base.length, self.friction[k, pressing]
            rows[:, LO] = rows[:, HI] = normal_forces[pressing]
            if not (rows[:, [E, MU]] > 0.0).all():
                failed += 1
                continue
            solver.update(replace(base, rows=rows))
            solver.y[:] = 0.0
            outcome, _ = solver.solve(self.loads[k], forces)
            undecided = outcome == Outcome.UNDECIDED
            failed += not self.held(k, normal_forces) if undecided else outcome == Outcome.INFEASIBLE
        return failed

    def held(self, k, normal_forces):
        """Return whether normal forces hold draw `k`, by another solver."""
        drawn = GraspContacts(
            self.positions[k],
            self.frames[k],
            self.friction[k],
            self.spin_length[k],
            force_min=normal_forces,
            force_max=normal_forces,
        )
        return np.isfinite(Reference(drawn).least_effort(self.loads[k]))
