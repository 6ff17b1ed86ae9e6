"""The loads that a grasp holds, by their support function: how far they reach in a direction, in closed form."""

from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray
from palpate.grasp.problem.contacts import GraspContacts

__all__ = ["BearableWrenches"]

ROUNDING = 1e-14
"""Of a contact's reach over the largest: less is none."""


@dataclass(frozen=True, slots=True, eq=False)
class BearableWrenches:
    """All loads that a grasp holds: a convex set, {load : y . load <= reach(y) for every y}.

    A load is held if G w + load = 0 with w within the limits. So reach(y) is the largest of -y . G w, and each
    contact's share of it is known: with g = (n, t1, t2, e n)' y as wrenches, f_n (-g_n + mu |(g_1, g_2, g_3)|), at
    one bound of f_n.

    Attributes:
        normals: N_i as rows, shape (n, 6) [1, m].
        tangents: t1, t2 and e n as rows, shape (n, 3, 6) [1, m].
        friction: mu, shape (n,).
        force_min: Shape (n,) [N].
        force_max: Shape (n,) [N].
    """

    normals: FloatArray
    tangents: FloatArray
    friction: FloatArray
    force_min: FloatArray
    force_max: FloatArray

    @classmethod
    def of(cls, grasp: GraspContacts) -> "BearableWrenches":
        """Return those of a grasp whose limits are cones, e that of 1 N, about the object's origin."""
        columns = grasp.grasp_map.reshape(6, len(grasp), 4).transpose(1, 2, 0)
        tangents = columns[:, 1:].copy()
        tangents[:, 2] *= grasp.spin_length[:, None]
        return cls(columns[:, 0], tangents, grasp.friction, grasp.force_min, grasp.force_max)

    def pull(self, y: FloatArray) -> FloatArray:
        """Return what each newton of normal force can do against y, shape (n,): positive if any of it helps."""
        out: FloatArray = -self.normals @ y + self.friction * np.sqrt(((self.tangents @ y) ** 2).sum(axis=1))
        return out

    def reach(self, y: FloatArray) -> float:
        """Return the largest y . load that is held; infinite where forces without a largest help."""
        pull = self.pull(y)
        # rounding must not turn a contact that does not help into one that helps without end
        nothing = np.abs(pull) <= ROUNDING * (np.abs(self.normals) @ np.abs(y) + self.friction * np.abs(y).sum())
        pull = np.where(nothing, 0.0, pull)
        force = np.where(pull > 0.0, self.force_max, self.force_min)
        return float(np.sum(np.where(pull == 0.0, 0.0, pull * np.where(pull == 0.0, 0.0, force))))
