"""A contact's load now and a little later, from noisy samples."""

from functools import cache
from typing import Any

import numpy as np

from palpate.compiling import machine_code, njit
from palpate.controllers.grip.fading_memory import FadingMemory
from palpate.controllers.small_vectors import length
from palpate.friction.contact_load import ContactLoad

ODD_FORCE, ODD_TORQUE = 0.3, 2e-3
"""[N, N m] By which one sample may differ from its prediction: fifteen times the noise of one, and 300 N/s in
a period of 1 ms."""


class LoadAhead:
    """Tracks tangential force and spin torque with their rates, and looks ahead along them: a `FadingMemory`.

    The components are looked ahead with, not the length of the force: the noise of a length would not average out
    near zero.
    """

    __slots__ = ("_memory",)

    def __init__(self, smoothing: float, period: float) -> None:
        """Take the time constant of the memory [s] and the period of the samples [s]."""
        self._memory = FadingMemory(smoothing, period, ODD_FORCE, ODD_TORQUE, 4)
        _kernel()  # compiled before the first period

    def restart(self) -> None:
        """Forget all samples: the next one initialises the filter at rest."""
        self._memory.restart()

    def step(self, load: ContactLoad) -> None:
        """Take a sample of this period."""
        self._memory.step((*load.tangential_force, load.spin_torque))

    def ahead(self, time: float) -> tuple[float, float]:
        """Return length of the tangential force [N] and spin torque [N m], so long after the last sample [s]."""
        found: tuple[float, float] = _kernel()(self._memory.state, time)
        return found


@njit(cache=True)
def _ahead(state: Any, time: float) -> tuple[float, float]:
    value, rate = state[0], state[1]
    x, y, z = value[0] + time * rate[0], value[1] + time * rate[1], value[2] + time * rate[2]
    return length(x, y, z), value[3] + time * rate[3]


@cache
def _kernel() -> Any:
    return machine_code(_ahead, np.zeros((3, 4)), 0.0)
