"""Further attempts of the interior point method where rounding stopped it.

One load in a thousand of the hardest kinds (contacts on one line or nearly parallel, wrenches that none can push)
ends short of the tolerances, or beyond them, by chance: some pair of slack and multiplier comes too near its
boundary. The same grasp in a frame that is turned is the same problem with all its rounding another, and shorter
steps keep such pairs farther away.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray

__all__ = ["ATTEMPTS", "Attempt"]


@dataclass(frozen=True, slots=True, eq=False)
class Attempt:
    """How one attempt sees a grasp.

    Attributes:
        turn: Rotation from the grasp's axes to those of the attempt, (3, 3); None leaves them as they are.
        shy: Share of the distance to the boundary of the cones that a step goes.
    """

    turn: FloatArray | None
    shy: float

    def contacts(self, contacts: FloatArray) -> FloatArray:
        """Return contacts (n, 16) as it sees them: places and axes turned."""
        if self.turn is None:
            return contacts
        seen = contacts.copy()
        seen[:, :12] = (contacts[:, :12].reshape(-1, 4, 3) @ self.turn.T).reshape(-1, 12)
        return seen

    def wrench(self, wrench: FloatArray) -> FloatArray:
        """Return a wrench (6,) as it sees it."""
        return wrench if self.turn is None else (wrench.reshape(2, 3) @ self.turn.T).ravel()

    def back(self, dual: FloatArray) -> FloatArray:
        """Return what multiplies wrenches (6,) in the grasp's own axes."""
        return dual.copy() if self.turn is None else (dual.reshape(2, 3) @ self.turn).ravel()


def _turned(x: float, y: float, z: float) -> FloatArray:
    """Rotation by so many rad about three axes in turn."""
    out = np.eye(3)
    for axis, angle in enumerate((x, y, z)):
        c, s = np.cos(angle), np.sin(angle)
        out = np.roll(np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]]), axis, (0, 1)) @ out
    return out


ATTEMPTS = (
    Attempt(None, 0.97),
    Attempt(_turned(0.4, 0.9, 1.7), 0.9),
    Attempt(_turned(2.1, 0.5, 0.8), 0.9),
    Attempt(_turned(1.2, 2.6, 0.3), 0.8),
    Attempt(_turned(0.7, 1.1, 2.9), 0.8),
    Attempt(_turned(2.7, 1.9, 1.4), 0.7),
    Attempt(_turned(0.2, 2.2, 2.4), 0.9),
    Attempt(_turned(1.6, 0.3, 1.1), 0.7),
)
"""Any turns do. The first shyness is the fastest on all grasps; of what it left of 32000 hard ones, one turn with
shorter steps solved five in six."""
