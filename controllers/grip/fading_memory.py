"""Filters noisy samples and their rate, and extrapolates them."""

import math
from collections.abc import Callable

from palpate.errors import positive

Values = tuple[float, ...]


class FadingMemory:
    """A fading-memory filter of first order (Morrison 1969; a critically damped alpha-beta filter).

    It follows a ramp without lag. Of white noise sd it leaves sd sqrt(5 dt / 4 T) in the value and
    sd sqrt(dt / 4 T^3) in the rate, T the smoothing time. A sample that is much farther from its prediction than
    usual is taken if the next one is, too: one period late, but a single glitch, with the rate that it seems to
    tell, would raise a grip many times over.
    """

    __slots__ = ("_far", "_odd", "_period", "_rate", "_to_rate", "_to_value", "_value")

    def __init__(self, smoothing: float, period: float, far: Callable[[Values], bool]) -> None:
        """Take how it forgets, and what is odd.

        Args:
            smoothing: Time constant of the memory [s].
            period: Of the samples [s].
            far: Whether a sample is oddly far off, by how much it is off.
        """
        self._period = positive("period", period, "s")
        keep = math.exp(-period / positive("smoothing", smoothing, "s"))
        self._to_value, self._to_rate = 1.0 - keep * keep, (1.0 - keep) ** 2 / period
        self._far = far
        self.restart()

    def restart(self) -> None:
        """Forget all samples: the next one initialises the filter at rest."""
        self._value: Values | None = None
        self._rate: Values = ()
        self._odd = False

    @property
    def empty(self) -> bool:
        """Whether there has been no sample."""
        return self._value is None

    def step(self, values: Values) -> None:
        """Take a sample of this period."""
        if self._value is None:
            self._value, self._rate = values, (0.0,) * len(values)
            return
        dt, to_value, to_rate = self._period, self._to_value, self._to_rate
        predicted = tuple([v + dt * r for v, r in zip(self._value, self._rate, strict=True)])
        off = tuple([a - b for a, b in zip(values, predicted, strict=True)])
        far = self._far(off)
        if far and not self._odd:
            self._value, self._odd = predicted, True
            return
        self._odd = far
        self._value = tuple([v + to_value * e for v, e in zip(predicted, off, strict=True)])
        self._rate = tuple([r + to_rate * e for r, e in zip(self._rate, off, strict=True)])

    def ahead(self, time: float) -> Values:
        """Return the values so long after the last sample [s]; none before the first."""
        if self._value is None:
            return ()
        return tuple([v + time * r for v, r in zip(self._value, self._rate, strict=True)])
