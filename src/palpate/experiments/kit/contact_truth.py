"""What really happened at a single fingertip, from the truth that a run's log keeps."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from palpate.errors import FloatArray
from palpate.runtime.truth import TruthTable
from palpate.sim.contact_truth import FORCE, HELD_POSITION, OBJECT_POSITION, POSITION, TORQUE, TOUCHING


@dataclass(frozen=True, slots=True, eq=False)
class ContactTruth:
    """The simulation's own contact, one row per period, base frame; forces act on the tip.

    On a robot nobody knows it: not touching, and NaN.

    Attributes:
        touching: Shape (n,).
        position: Shape (n, 3) [m].
        force: Shape (n, 3) [N].
        torque: About `position`, shape (n, 3) [N m].
        object_position: Of the object's frame, shape (n, 3) [m].
        held_position: Of what fingers hold, seen from them, shape (n, 3) [m]: of the end of a tool; of the object
            where that is held.
        known: Whether anybody knows it.
    """

    touching: np.ndarray[tuple[int], np.dtype[np.bool_]]
    position: FloatArray
    force: FloatArray
    torque: FloatArray
    object_position: FloatArray
    held_position: FloatArray
    known: bool = True

    def __len__(self) -> int:
        """Number of periods."""
        return len(self.touching)

    @classmethod
    def of(cls, truth: TruthTable, count: int) -> Self:
        """Return the contact of a truth; of `count` periods of which nobody knows anything, on a robot."""
        if not truth.known:
            unknown = np.full((count, 3), np.nan)
            return cls(np.zeros(count, np.bool_), unknown, unknown, unknown, unknown, unknown, known=False)
        touching = truth.column(TOUCHING)[:, 0] > 0.0
        position, force, torque, moved = (
            truth.column(*each) for each in (POSITION, FORCE, TORQUE, OBJECT_POSITION)
        )
        held = truth.column(*HELD_POSITION) if set(HELD_POSITION) <= set(truth.columns) else moved
        return cls(touching, position, force, torque, moved, held)
