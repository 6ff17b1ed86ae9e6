"""Keeping what really happened in a simulation beside what was sensed."""

import math
from array import array
from dataclasses import dataclass
from typing import Self

import numpy as np

from palpate.errors import FloatArray
from palpate.robots.known_truth import Simulated
from palpate.runtime import Backend, Command, Observation, Sample


@dataclass(frozen=True, slots=True, eq=False)
class TruthRecord:
    """The simulation's own contact, one row per period, base frame; forces act on the tip.

    On a robot nobody knows it: not touching, and NaN.

    Attributes:
        touching: Shape (n,).
        position: Shape (n, 3) [m].
        force: Shape (n, 3) [N].
        torque: About `position`, shape (n, 3) [N m].
        known: Whether anybody knows it.
    """

    touching: np.ndarray[tuple[int], np.dtype[np.bool_]]
    position: FloatArray
    force: FloatArray
    torque: FloatArray
    known: bool = True

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
            np.vstack([self.position, unknown]),
            np.vstack([self.force, unknown]),
            np.vstack([self.torque, unknown]),
            self.known,
        )


UNKNOWN = (0.0, *(math.nan,) * 9)
"""A row of which nobody knows anything."""


class TruthRecorder:
    """An observer that asks the simulation for the truth at every sample."""

    def __init__(self, backend: Backend) -> None:
        """Watch a back end."""
        self._simulated = backend if isinstance(backend, Simulated) else None
        self._rows = array("d")

    def __call__(self, sample: Sample, now: Observation, command: Command) -> None:
        """Append the truth that belongs to this sample."""
        if self._simulated is None:
            self._rows.extend(UNKNOWN)
            return
        truth = self._simulated.truth()
        self._rows.extend((truth.touching, *truth.position, *truth.force, *truth.torque))

    def record(self) -> TruthRecord:
        """Return all that was appended so far."""
        rows = np.array(self._rows).reshape(-1, 10)
        known = self._simulated is not None
        return TruthRecord(rows[:, 0].astype(bool), rows[:, 1:4], rows[:, 4:7], rows[:, 7:10], known)
