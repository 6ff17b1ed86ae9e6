"""How large a disturbance a grasp beyond cones holds: by halving, between forces found and cones around it."""

from dataclasses import replace

import numpy as np

from palpate.errors import FloatArray
from palpate.grasp.optimizer import GraspForceOptimizer
from palpate.grasp.problem.contacts import GraspContacts
from palpate.grasp.problem.result import SolveStatus

__all__ = ["cones_around", "largest_by_halving"]

ACCURACY = 1e-4
"""Of the factor found, relative: each halving takes tens of milliseconds."""

STEPS = 60
"""Doublings and halvings, at most."""


def cones_around(grasp: GraspContacts) -> GraspContacts | None:
    """Return cones that hold whatever a grasp holds, actuators left aside; None where e grows without end.

    e is that of the largest force, and |(f_t, tau / e)|_p is no less than its 2-norm for p below 2.
    """
    grows = grasp.load_exponent > 0.0
    if not np.isfinite(grasp.force_max[grows]).all():
        return None
    length = grasp.spin_length * np.where(grows, grasp.force_max, 1.0) ** grasp.load_exponent
    cones, nothing = np.full(len(grasp), 2.0), np.zeros(len(grasp))
    return replace(
        grasp,
        spin_length=length,
        load_exponent=nothing,
        norm_exponent=cones,
        actuator_map=None,
        actuator_limit=None,
    )


def largest_by_halving(
    grasp: GraspContacts, load: FloatArray, direction: FloatArray, first: float, bound: float, endless: float
) -> tuple[float, FloatArray]:
    """Return the factor of a disturbance up to which forces were found, and these, shape (n, 4) [N, N, N, N m].

    What a limit that is no cone holds need not be convex: a factor that fails ends the search, whether or not a
    larger one would be held again.

    Args:
        grasp: Any.
        load: What acts on the object anyway, shape (6,) [N, N m].
        direction: The disturbance, shape (6,) [N, N m].
        first: Factor to try first if there is no bound.
        bound: No larger factor is held.
        endless: Factors from here on count as infinite.
    """
    optimizer, forces = GraspForceOptimizer(grasp), np.zeros((len(grasp), 4))
    low, high, factor = 0.0, bound, 0.0
    for _ in range(STEPS):
        result = optimizer.solve(load + factor * direction)
        if result.status is SolveStatus.SOLVED:
            low, forces = factor, result.forces
        elif factor == 0.0:
            break
        else:
            high = factor
        if low >= endless:
            return np.inf, forces
        if np.isfinite(high) and high - low <= ACCURACY * high:
            break
        factor = 0.5 * (low + high) if np.isfinite(high) else max(2.0 * low, first)
    return low, forces
