"""Set forces that show how well force is regulated: steps up and down, and sines from slow to fast."""

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field

from palpate.errors import InvalidValueError, check_positive, not_negative, positive


@dataclass(frozen=True, slots=True)
class StepForce:
    """A force, another one, the first again, and so on: a square wave. A `ForceProfile`.

    Attributes:
        first: [N].
        second: [N].
        hold: How long each of them lasts [s].
    """

    first: float
    second: float
    hold: float

    def __post_init__(self) -> None:
        positive("first force", self.first, "N")
        positive("second force", self.second, "N")
        positive("hold", self.hold, "s")
        if self.first == self.second:
            raise InvalidValueError(f"second force = {self.second:g} N: must differ from the first")

    def at(self, time: float) -> tuple[float, float]:
        """See `ForceProfile`: a step has no rate that could be fed forward."""
        return (self.second if time >= 0.0 and math.floor(time / self.hold) % 2 else self.first), 0.0

    def steps(self, duration: float) -> tuple[float, ...]:
        """Return when it steps [s], within a duration [s]; each step has its whole hold after it."""
        count = math.floor(duration / self.hold + 1e-9)
        return tuple(i * self.hold for i in range(1, count))


@dataclass(frozen=True, slots=True)
class Tones:
    """The mean force, and then one sine about it after the other, each for whole cycles. A `ForceProfile`.

    Attributes:
        mean: [N].
        amplitude: Less than the mean, so that it always pushes [N].
        frequencies: [Hz].
        begin: When the first one begins [s].
        cycles: Of each sine, at least.
        shortest: Each sine lasts so long at least [s].
        begins: When each one begins, and the last one ends [s]; follows from the others.
    """

    mean: float
    amplitude: float
    frequencies: Sequence[float]
    begin: float = 0.5
    cycles: int = 3
    shortest: float = 1.0
    begins: tuple[float, ...] = field(init=False)

    def __post_init__(self) -> None:
        positive("mean force", self.mean, "N")
        check_positive(self, amplitude="N", shortest="s", cycles="")
        not_negative("begin", self.begin, "s")
        if self.amplitude >= self.mean:
            raise InvalidValueError(
                f"amplitude = {self.amplitude:g} N: must be less than the mean of {self.mean:g} N, or the tip "
                "would have to pull"
            )
        if not self.frequencies:
            raise InvalidValueError("frequencies: there are none; give one at least [Hz]")
        begins = [self.begin]
        for frequency in self.frequencies:
            cycles = max(self.cycles, math.ceil(self.shortest * positive("frequency", frequency, "Hz")))
            begins.append(begins[-1] + cycles / frequency)
        object.__setattr__(self, "frequencies", tuple(self.frequencies))
        object.__setattr__(self, "begins", tuple(begins))

    @property
    def duration(self) -> float:
        """Until the last one ends [s]."""
        return self.begins[-1]

    def at(self, time: float) -> tuple[float, float]:
        """See `ForceProfile`."""
        i = bisect_right(self.begins, time) - 1
        if not 0 <= i < len(self.frequencies):
            return self.mean, 0.0
        rate = 2.0 * math.pi * self.frequencies[i]
        angle = rate * (time - self.begins[i])
        return self.mean + self.amplitude * math.sin(angle), self.amplitude * rate * math.cos(angle)
