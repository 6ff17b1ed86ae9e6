"""Set forces over time, with their rates, which are fed forward."""

import math
from dataclasses import dataclass
from typing import Protocol

from palpate.errors import InvalidValueError, check_positive, not_negative, positive


class ForceProfile(Protocol):
    """A wanted normal force over time, at least 0."""

    def at(self, time: float) -> tuple[float, float]:
        """Return force [N] and its rate [N/s] at a time since force control took over [s]."""
        ...


@dataclass(frozen=True, slots=True)
class ConstantForce:
    """Always the same.

    Attributes:
        force: [N].
    """

    force: float

    def __post_init__(self) -> None:
        positive("force", self.force, "N")

    def at(self, time: float) -> tuple[float, float]:
        """See `ForceProfile`."""
        return self.force, 0.0


@dataclass(frozen=True, slots=True)
class RampForce:
    """From one force to another at a constant rate, and then the other.

    Attributes:
        first: [N].
        last: [N].
        rate: Magnitude of the rate of change [N/s].
        begin: When it leaves the first [s].
    """

    first: float
    last: float
    rate: float
    begin: float = 0.0

    def __post_init__(self) -> None:
        positive("first force", self.first, "N")
        positive("last force", self.last, "N")
        positive("rate", self.rate, "N/s")
        not_negative("begin", self.begin, "s")

    def at(self, time: float) -> tuple[float, float]:
        """See `ForceProfile`."""
        change, since = self.last - self.first, time - self.begin
        if since <= 0.0 or change == 0.0:
            return (self.first if since <= 0.0 else self.last), 0.0
        if since * self.rate >= abs(change):
            return self.last, 0.0
        rate = math.copysign(self.rate, change)
        return self.first + rate * since, rate


@dataclass(frozen=True, slots=True)
class SineForce:
    """mean + amplitude sin(2 pi frequency t).

    Attributes:
        mean: [N].
        amplitude: Less than the mean, so that it always pushes [N].
        frequency: [Hz].
    """

    mean: float
    amplitude: float
    frequency: float

    def __post_init__(self) -> None:
        positive("mean force", self.mean, "N")
        check_positive(self, amplitude="N", frequency="Hz")
        if self.amplitude >= self.mean:
            raise InvalidValueError(
                f"amplitude = {self.amplitude:g} N: must be less than the mean of {self.mean:g} N, or the tip "
                "would have to pull"
            )

    def at(self, time: float) -> tuple[float, float]:
        """See `ForceProfile`."""
        rate = 2.0 * math.pi * self.frequency
        return (
            self.mean + self.amplitude * math.sin(rate * time),
            self.amplitude * rate * math.cos(rate * time),
        )
