"""A contact's load now and a little later, from noisy samples."""

import math

from palpate.controllers.grip.fading_memory import FadingMemory, Values
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
        self._memory = FadingMemory(smoothing, period, _far)

    def restart(self) -> None:
        """Forget all samples: the next one initialises the filter at rest."""
        self._memory.restart()

    def step(self, load: ContactLoad) -> None:
        """Take a sample of this period."""
        self._memory.step((*load.tangential_force, load.spin_torque))

    def ahead(self, time: float) -> tuple[float, float]:
        """Return length of the tangential force [N] and spin torque [N m], so long after the last sample [s]."""
        if self._memory.empty:
            return 0.0, 0.0
        x, y, z, spin = self._memory.ahead(time)
        return math.hypot(x, y, z), spin


def _far(off: Values) -> bool:
    x, y, z, spin = off
    return x * x + y * y + z * z > ODD_FORCE * ODD_FORCE or abs(spin) > ODD_TORQUE
