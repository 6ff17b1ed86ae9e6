"""Keeping what really happened in a simulation beside what was sensed."""

from array import array
from dataclasses import dataclass
from typing import Self

import numpy as np

from palpate.errors import FloatArray
from palpate.runtime import Command, Observation, Sample
from palpate.sim import MujocoBackend


@dataclass(frozen=True, slots=True, eq=False)
class TruthRecord:
    """The simulation's own contact, one row per period, base frame; forces act on the tip.

    Attributes:
        touching: Shape (n,).
        position: Shape (n, 3) [m].
        force: Shape (n, 3) [N].
        torque: About `position`, shape (n, 3) [N m].
    """

    touching: np.ndarray[tuple[int], np.dtype[np.bool_]]
    position: FloatArray
    force: FloatArray
    torque: FloatArray

    def __len__(self) -> int:
        """Number of periods."""
        return len(self.touching)

    def continued(self, count: int) -> Self:
        """Return it for `count` periods, with nothing known of those that are missing: NaN, not touching."""
        missing = count - len(self)
        if missing <= 0:
            return self
        unknown = np.full((missing, 3), np.nan)
        return type(self)(
            np.append(self.touching, np.zeros(missing, np.bool_)),
            *(np.vstack([each, unknown]) for each in (self.position, self.force, self.torque)),
        )


class TruthRecorder:
    """An observer that asks the simulation for the truth at every sample."""

    def __init__(self, backend: MujocoBackend) -> None:
        """Watch a back end."""
        self._backend = backend
        self._rows = array("d")

    def __call__(self, sample: Sample, now: Observation, command: Command) -> None:
        """Append the truth that belongs to this sample."""
        truth = self._backend.truth()
        self._rows.extend((truth.touching, *truth.position, *truth.force, *truth.torque))

    def record(self) -> TruthRecord:
        """Return all that was appended so far."""
        rows = np.array(self._rows).reshape(-1, 10)
        return TruthRecord(rows[:, 0].astype(bool), rows[:, 1:4], rows[:, 4:7], rows[:, 7:10])
