"""Cones inside limit surfaces that are none: what is convex and yet never promises too much."""

import numpy as np

from palpate.errors import FloatArray
from palpate.grasp.problem.contacts import GraspContacts

__all__ = ["inscribed"]

FLOOR = 1e-3
"""Least share of friction force or torque for which a cone keeps room: without room it would never get any."""


def inscribed(grasp: GraspContacts, forces: FloatArray) -> GraspContacts:
    """Return a grasp of second-order cones that touch the limit surfaces at the loads of `forces`.

    e is held at that of each normal force now. For p below 2 the ellipse sum x_i^2 / eta_i <= (mu f)^2,
    eta_i = (x_i / |x|_p)^(2 - p), lies within |x|_p <= mu f and touches it at x, since |x|_p^2 is the least of
    sum x_i^2 / eta_i over all eta with |eta|_(p / (2 - p)) = 1 (Hoelder).

    Args:
        grasp: Any.
        forces: (f_n, f_t1, f_t2, tau_n), shape (n, 4); friction forces and torques may be zero.
    """
    normal, p = np.maximum(forces[:, 0], 0.0), grasp.norm_exponent
    with np.errstate(divide="ignore"):
        length = grasp.spin_length * np.where(grasp.load_exponent > 0.0, normal**grasp.load_exponent, 1.0)
    used = np.column_stack(
        [np.hypot(forces[:, 1], forces[:, 2]), np.abs(forces[:, 3]) / np.maximum(length, MIN_SPIN_LENGTH)]
    )
    largest = used.max(axis=1, keepdims=True)
    used = np.maximum(np.where(largest > 0.0, used / np.where(largest > 0.0, largest, 1.0), 1.0), FLOOR)
    shares = used / ((used ** p[:, None]).sum(axis=1) ** (1.0 / p))[:, None]
    eta = shares ** (2.0 - p)[:, None]
    return GraspContacts(
        grasp.positions,
        grasp.frames,
        grasp.friction * np.sqrt(eta[:, 0]),
        np.maximum(length * np.sqrt(eta[:, 1] / eta[:, 0]), MIN_SPIN_LENGTH),
        grasp.force_min,
        grasp.force_max,
        grasp.actuator_map,
        grasp.actuator_limit,
    )


MIN_SPIN_LENGTH = 1e-9
"""Stands for an e of zero [m]: of a contact that does not press."""
