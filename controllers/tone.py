"""The complex amplitude of a sampled signal at one frequency, from running sums over whole cycles."""

import cmath
import math

from palpate.errors import positive


class Tone:
    """Correlates signals with a cosine and a sine: O(1) per sample, no memory of samples.

    Over whole cycles a constant drops out; so does everything at other whole multiples of the frequency.

    Attributes:
        frequency: The nearest one below the wanted that has a whole number of periods to its cycle [Hz].
    """

    def __init__(self, frequency: float, period: float, signals: int) -> None:
        """Take the wanted frequency [Hz], the time between samples [s], and how many signals there are."""
        self._cycle = math.ceil(1.0 / (positive("frequency", frequency, "Hz") * positive("period", period, "s")))
        self.frequency = 1.0 / (self._cycle * period)
        self._cosines = [math.cos(2.0 * math.pi * i / self._cycle) for i in range(self._cycle)]
        self._sines = [math.sin(2.0 * math.pi * i / self._cycle) for i in range(self._cycle)]
        self._sums = [[0.0, 0.0, 0.0, 0.0] for _ in range(signals)]
        self._first: list[float] = []
        self._index = 0
        self.samples = 0

    @property
    def angular(self) -> float:
        """Frequency [rad/s]."""
        return 2.0 * math.pi * self.frequency

    @property
    def cycles(self) -> int:
        """Whole cycles so far, counted or not."""
        return self._index // self._cycle

    @property
    def cosine(self) -> float:
        """Of the present phase."""
        return self._cosines[self._index % self._cycle]

    def skip(self) -> None:
        """Let a sample pass: the start-up."""
        self._index += 1

    def add(self, *values: float) -> None:
        """Take one sample of each signal."""
        i = self._index % self._cycle
        c, s = self._cosines[i], self._sines[i]
        if not self._first:
            self._first = list(values)
        for sums, value, first in zip(self._sums, values, self._first, strict=True):
            x = value - first  # large constants would cost digits
            sums[0] += x * c
            sums[1] += x * s
            sums[2] += x
            sums[3] += x * x
        self._index += 1
        self.samples += 1

    def amplitude(self, signal: int) -> complex:
        """Return a with value = Re(a exp(i w t)) + rest, t = 0 at the first sample, counted or not."""
        c, s, _, _ = self._sums[signal]
        return complex(c, -s) * (2.0 / self.samples)

    def noise(self, signal: int) -> float:
        """Return the standard deviation of an amplitude's real and imaginary part, from what it leaves."""
        _, _, total, squares = self._sums[signal]
        n = self.samples
        rest = squares / n - (total / n) ** 2 - 0.5 * abs(self.amplitude(signal)) ** 2
        return math.sqrt(max(rest, 0.0) * 2.0 / n)


def lag_of(response: complex, angular_frequency: float) -> float:
    """Return by how much a response lags [s]."""
    return -cmath.phase(response) / angular_frequency
