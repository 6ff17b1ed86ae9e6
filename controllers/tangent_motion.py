"""How something else moves the tip along a surface while its force is regulated.

Whatever moves the arm gives a velocity in base coordinates; what of it lies along the force's direction is force
control's and is taken off. All of these begin at rest or are brought up by whoever follows them.
"""

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from palpate.errors import InvalidValueError, positive, vector
from palpate.spatial import ZERO, Vector, norm, scale


class TangentMotion(Protocol):
    """A wanted velocity over time."""

    def velocity(self, time: float) -> Vector:
        """Return the tip frame origin's velocity [m/s], base frame, so long after it was handed over [s]."""
        ...


@dataclass(frozen=True, slots=True)
class Still:
    """Nothing moves it. A `TangentMotion`."""

    def velocity(self, time: float) -> Vector:
        """See `TangentMotion`."""
        return ZERO


@dataclass(frozen=True, slots=True)
class SineMotion:
    """To and fro along a line, from one turning point: displacement amplitude (1 - cos(2 pi frequency t)).

    Attributes:
        amplitude: Half of the way from end to end [m].
        frequency: [Hz].
        direction: Base frame; its length does not matter.
    """

    amplitude: float
    frequency: float
    direction: Vector = (1.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        positive("amplitude", self.amplitude, "m")
        positive("frequency", self.frequency, "Hz")
        vector("direction", self.direction, 3, "")
        length = positive("length of direction", norm(self.direction), "")
        object.__setattr__(self, "direction", scale(1.0 / length, self.direction))

    def velocity(self, time: float) -> Vector:
        """See `TangentMotion`."""
        rate = 2.0 * math.pi * self.frequency
        return scale(self.amplitude * rate * math.sin(rate * time), self.direction)


@dataclass(frozen=True, slots=True)
class CircleMotion:
    """Round and round, seen along z, beginning along y.

    Attributes:
        radius: [m].
        frequency: Turns per second [Hz].
    """

    radius: float
    frequency: float

    def __post_init__(self) -> None:
        positive("radius", self.radius, "m")
        positive("frequency", self.frequency, "Hz")

    def velocity(self, time: float) -> Vector:
        """See `TangentMotion`."""
        rate = 2.0 * math.pi * self.frequency
        speed = self.radius * rate
        return (-speed * math.sin(rate * time), speed * math.cos(rate * time), 0.0)


@dataclass(frozen=True, slots=True)
class VelocityTable:
    """Velocities at given times, straight lines between them; the first before and the last after.

    Attributes:
        times: Rising [s].
        velocities: One per time [m/s], base frame.
    """

    times: Sequence[float]
    velocities: Sequence[Vector]

    def __post_init__(self) -> None:
        if len(self.times) != len(self.velocities) or not self.times:
            raise InvalidValueError(
                f"table of {len(self.times)} times and {len(self.velocities)} velocities: must be as many of "
                "both, and one at least"
            )
        times = vector("times", self.times, len(self.times), "s")
        if np.any(np.diff(times) <= 0.0):
            i = int(np.flatnonzero(np.diff(times) <= 0.0)[0])
            raise InvalidValueError(f"times[{i + 1}] = {times[i + 1]:g} s: must be later than {times[i]:g} s")
        rows = [vector(f"velocities[{i}]", row, 3, "m/s").tolist() for i, row in enumerate(self.velocities)]
        object.__setattr__(self, "times", tuple(times.tolist()))
        object.__setattr__(self, "velocities", tuple((x, y, z) for x, y, z in rows))

    def velocity(self, time: float) -> Vector:
        """See `TangentMotion`."""
        i = bisect_right(self.times, time)
        if i == 0:
            return self.velocities[0]
        if i == len(self.times):
            return self.velocities[-1]
        share = (time - self.times[i - 1]) / (self.times[i] - self.times[i - 1])
        (a, b, c), (p, q, r) = self.velocities[i - 1], self.velocities[i]
        return (a + share * (p - a), b + share * (q - b), c + share * (r - c))
