"""The load of a held object now and a little later, from noisy samples."""

from palpate.controllers.grip.fading_memory import FadingMemory
from palpate.errors import FloatArray
from palpate.spatial import Wrench

ODD_FORCE, ODD_TORQUE = 0.5, 2e-2
"""[N, N m] By which one sample may differ from its prediction: as `LoadAhead` has it for one finger, and
its force at the lever of a hand."""


class WrenchAhead:
    """Tracks a wrench with its rate, and looks ahead along it: a `FadingMemory`."""

    __slots__ = ("_memory",)

    def __init__(self, smoothing: float, period: float) -> None:
        """Take the time constant of the memory [s] and the period of the samples [s]."""
        self._memory = FadingMemory(smoothing, period, ODD_FORCE, ODD_TORQUE, 6)

    def restart(self) -> None:
        """Forget all samples: the next one initialises the filter at rest."""
        self._memory.restart()

    def step(self, wrench: Wrench) -> None:
        """Take a sample of this period [N, N m]."""
        self._memory.step(tuple(wrench))

    def ahead(self, time: float) -> FloatArray:
        """Return it so long after the last sample [s], shape (6,) [N, N m]; zeros before the first."""
        return self._memory.ahead(time)
