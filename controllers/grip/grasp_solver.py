"""Normal forces that hold the load of a grasp, as a shared grip plans them."""

from dataclasses import replace
from typing import Protocol

import numpy as np
from scipy.special import ndtri

from palpate.errors import FloatArray, not_negative
from palpate.grasp.optimizer import GraspForceOptimizer
from palpate.grasp.problem.contacts import GraspContacts
from palpate.grasp.problem.result import SolveStatus
from palpate.grasp.robust.least_effort import RobustLeastEffort
from palpate.grasp.robust.uncertainty import GraspUncertainty
from palpate.grasp.solvers.least_effort import Outcome

MIN_LEFT = 0.05
"""Of mu and e: an error of three standard deviations must not make them nothing."""


ANY_LOAD = np.array([0.0, 0.0, -1.0, 0.002, 0.0, 0.0])
"""[N, N m]"""


class GraspSolver(Protocol):
    """Finds normal forces that hold a load."""

    def forces(self, grasp: GraspContacts, load: FloatArray) -> FloatArray | None:
        """Return what each contact is to bear, shape (n, 4) [N, N, N, N m]; None without a usable solution.

        Args:
            grasp: Contacts, hand frame.
            load: What pulls at the object, about the hand frame's origin, shape (6,) [N, N m].
        """
        ...


class MinimumGrip:
    """The least forces on the assumed limit surfaces, by `GraspForceOptimizer`. A `GraspSolver`."""

    def __init__(self, fingers: int) -> None:
        """Take how many fingers there are; compiles, so that no period has to."""
        self._optimizer = GraspForceOptimizer(_any_grasp(fingers))
        self._optimizer.solve(ANY_LOAD)

    def forces(self, grasp: GraspContacts, load: FloatArray) -> FloatArray | None:
        """See `GraspSolver`. What cannot be held is held with the least violation."""
        self._optimizer.update(grasp)
        found = self._optimizer.solve(load)
        return found.forces if found.status in (SolveStatus.SOLVED, SolveStatus.INFEASIBLE) else None


class RobustGrip:
    """Forces that hold with a chosen probability where mu and e are known with their errors. A `GraspSolver`.

    To hold means: under these normal forces, which are all that a grip commands, some friction within the true
    limits balances the load (`RobustForces.probability_redistributing`).

    Where no grip is that probable, or none was found in time: the least forces by a mu and an e that are as small
    as they are with that probability, each by itself.
    """

    def __init__(self, fingers: int, friction: float, spin_length: float, probability: float = 0.99) -> None:
        """Take what is not known; contacts err alike, as they are of the same two materials. Compiles.

        Args:
            fingers: How many there are.
            friction: Standard deviation of mu over mu.
            spin_length: Of e over e.
            probability: Of holding, from 0.5 to 1.
        """
        self._friction = not_negative("friction", friction, "")
        self._spin_length = not_negative("spin_length", spin_length, "")
        self._probability = probability
        self._worst = MinimumGrip(fingers)
        self._robust: RobustLeastEffort | None = None
        self._planned: GraspContacts | None = None
        self.forces(_any_grasp(fingers), ANY_LOAD)
        self._robust = None
        deviations = float(ndtri(probability))
        self._left = tuple(max(1.0 - deviations * each, MIN_LEFT) for each in (friction, spin_length))

    def forces(self, grasp: GraspContacts, load: FloatArray) -> FloatArray | None:
        """See `GraspSolver`."""
        if self._robust is None:
            self._robust = RobustLeastEffort(grasp, self._uncertainty(grasp), self._probability)
        elif self._planned is not None and np.array_equal(grasp.friction, self._planned.friction):
            self._robust.update(grasp)
        else:  # another belief, as uncertain as the first
            self._robust.update(grasp, self._uncertainty(grasp))
        self._planned = grasp
        found = self._robust.solve(load)
        if found.outcome == Outcome.SOLVED:
            return found.forces
        mu, e = self._left
        return self._worst.forces(
            replace(grasp, friction=mu * grasp.friction, spin_length=e * grasp.spin_length), load
        )

    def _uncertainty(self, grasp: GraspContacts) -> GraspUncertainty:
        of_mu, of_e = self._friction * grasp.friction, self._spin_length * grasp.spin_length
        return GraspUncertainty(np.outer(of_mu, of_mu), np.outer(of_e, of_e))


def _any_grasp(fingers: int) -> GraspContacts:
    """A hand around a cylinder, with which the code is compiled."""
    angles = 2.0 * np.pi / fingers * np.arange(fingers)
    frames = np.zeros((fingers, 3, 3))
    frames[:, 0, 0], frames[:, 1, 0] = -np.cos(angles), -np.sin(angles)
    frames[:, 2, 1] = 1.0
    frames[:, 0, 2], frames[:, 1, 2] = -np.sin(angles), np.cos(angles)
    return GraspContacts(-0.03 * frames[:, :, 0], frames, friction=0.5, spin_length=0.004, force_max=20.0)
