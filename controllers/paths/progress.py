"""Whether a tip that is commanded to slide makes progress."""

from functools import cache
from typing import Any

import numpy as np

from palpate.compiling import machine_code, njit
from palpate.controllers.small_vectors import length
from palpate.spatial import ZERO, Vector

WATCHED = 0.5
"""Stretches of this length are looked at [s]: ten times what a servo takes to start and to turn round."""

MIN_PART = 0.1
"""Least share of the commanded distance that a moving tip covers; a blocked one covers none of it."""

KNOWN, LAST, DIRECTION, SPEED, COMMANDED, COVERED, COUNT, STALLED, DISTANCE = 0, 1, 4, 7, 8, 9, 10, 11, 12
"""Where in its state what is kept: whether a place of the tip is known, this, and what was commanded from there
on."""


class Progress:
    """Adds up the distance of the tip in the commanded direction, in which noise of its position cancels.

    Attributes:
        state: Of `advance` and `command`.
    """

    def __init__(self, period: float) -> None:
        """Take the control period [s]."""
        self._period = period
        self.state = np.zeros(13)

    @property
    def distance(self) -> float:
        """Covered so far [m]."""
        return float(self.state[DISTANCE])

    @property
    def stalled(self) -> bool:
        """Whether the tip made no progress in the last stretch."""
        return bool(self.state[STALLED])

    def rest(self) -> None:
        """The tip was moved otherwise: look at a new stretch."""
        self.state[:DISTANCE] = 0.0

    def step(self, tip: Vector) -> None:
        """Take where the tip is [m]."""
        _kernels()[0](self.state, self._period, tip)

    def command(self, velocity: Vector) -> None:
        """Take the velocity along the surface commanded for the next period [m/s]."""
        _kernels()[1](self.state, velocity)


@njit(cache=True)
def advance(state: Any, period: float, tip: Vector) -> None:
    """See `Progress.step`."""
    covered = 0.0
    for i in range(3):
        covered += (tip[i] - state[LAST + i]) * state[DIRECTION + i]
        state[LAST + i] = tip[i]
    if state[KNOWN] == 0.0:
        state[KNOWN] = 1.0
        return
    state[DISTANCE] += covered
    state[COVERED] += covered
    state[COMMANDED] += state[SPEED] * period
    state[COUNT] += 1.0
    if state[COUNT] == max(1.0, np.rint(WATCHED / period)):
        state[STALLED] = 1.0 if state[COVERED] < MIN_PART * state[COMMANDED] else 0.0
        state[COMMANDED] = state[COVERED] = state[COUNT] = 0.0


@njit(cache=True)
def command(state: Any, velocity: Vector) -> None:
    """See `Progress.command`."""
    speed = length(velocity[0], velocity[1], velocity[2])
    state[SPEED] = speed
    for i in range(3):
        state[DIRECTION + i] = 1.0 / speed * velocity[i] if speed > 0.0 else 0.0


@cache
def _kernels() -> tuple[Any, Any]:
    state = np.zeros(13)
    return machine_code(advance, state, 0.0, ZERO), machine_code(command, state, ZERO)
