"""The load of a held object now and a little later, from noisy samples."""

import math

import numpy as np

from palpate.errors import FloatArray, positive

ODD_FORCE, ODD_TORQUE = 0.5, 2e-2
"""[N, N m] By which one sample may be off what was foretold for it: as `LoadAhead` has it for one finger, and
its force at the lever of a hand."""


class WrenchAhead:
    """Tracks a wrench with its rate, and looks ahead along it.

    The filter of `LoadAhead`, for all six numbers at once: a ramp is followed without lag, and a single odd sample
    is not.
    """

    __slots__ = ("_odd", "_period", "_rate", "_to_rate", "_to_value", "_value")

    def __init__(self, smoothing: float, period: float) -> None:
        """Take the time constant of the memory [s] and the period of the samples [s]."""
        self._period = positive("period", period, "s")
        keep = math.exp(-period / positive("smoothing", smoothing, "s"))
        self._to_value, self._to_rate = 1.0 - keep * keep, (1.0 - keep) ** 2 / period
        self.restart()

    def restart(self) -> None:
        """Forget all samples: the next one is taken for what has been there for ever."""
        self._value: FloatArray | None = None
        self._rate = np.zeros(6)
        self._odd = False

    def step(self, wrench: FloatArray) -> None:
        """Take a sample of this period, shape (6,) [N, N m]."""
        if self._value is None:
            self._value = wrench.copy()
            return
        foretold = self._value + self._period * self._rate
        off = wrench - foretold
        far = bool(off[:3] @ off[:3] > ODD_FORCE**2 or off[3:] @ off[3:] > ODD_TORQUE**2)
        if far and not self._odd:
            self._value, self._odd = foretold, True
            return
        self._odd = far
        self._value = foretold + self._to_value * off
        self._rate = self._rate + self._to_rate * off

    def ahead(self, time: float) -> FloatArray:
        """Return it so long after the last sample [s], shape (6,) [N, N m]; nothing before the first."""
        return np.zeros(6) if self._value is None else self._value + time * self._rate
