"""How something else moves the tip along a surface while its force is regulated.

Whatever moves the arm gives a velocity in base coordinates; what of it lies along the force's direction is force
control's and is taken off. All of these begin at rest or are brought up by whoever follows them.
"""

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from palpate.errors import InvalidValueError, check_positive, positive, vector
from palpate.spatial import ZERO, Vector, norm, scale


class TangentMotion(Protocol):
    """A wanted velocity over time."""

    def velocity(self, time: float) -> Vector:
        """Return the tip frame origin's velocity [m/s], base frame, so long after it was handed over [s]."""
        ...


@dataclass(frozen=True, slots=True)
class Still:
    """No motion along the surface. A `TangentMotion`."""

    def velocity(self, time: float) -> Vector:
        """See `TangentMotion`."""
        return ZERO


@dataclass(frozen=True, slots=True)
class SineMotion:
    """To and fro along a line, from one turning point: displacement amplitude (1 - cos(2 pi frequency t)).

    Attributes:
        amplitude: Half of the distance from end to end [m].
        frequency: [Hz].
        direction: Base frame; its length does not matter.
    """

    amplitude: float
    frequency: float
    direction: Vector = (1.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        check_positive(self, amplitude="m", frequency="Hz")
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
        check_positive(self, radius="m", frequency="Hz")

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

    times: tuple[float, ...]
    velocities: tuple[Vector, ...]

    def __post_init__(self) -> None:
        if len(self.times) != len(self.velocities) or not self.times:
            raise InvalidValueError(
                f"table of {len(self.times)} times and {len(self.velocities)} velocities: must be as many of "
                "both, and one at least"
            )
        times = _rising(self.times)
        rows = [vector(f"velocities[{i}]", row, 3, "m/s").tolist() for i, row in enumerate(self.velocities)]
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "velocities", tuple((x, y, z) for x, y, z in rows))

    @property
    def fastest(self) -> float:
        """Largest speed [m/s]."""
        return max(map(norm, self.velocities))

    @property
    def farthest(self) -> float:
        """How far along x or y it leads from where it begins [m]."""
        moved = (
            np.diff(self.times)[:, None] * 0.5 * (np.array(self.velocities)[1:] + np.array(self.velocities)[:-1])
        )
        return float(np.abs(np.cumsum(moved, axis=0)[:, :2]).max(initial=0.0))

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


@dataclass(frozen=True, slots=True)
class PathTable:
    """Along positions at given times, as they were recorded: smooth between them, at rest before and after.

    Between two positions the path is a cubic, whose velocity joins those of its neighbours: the slopes on either
    side, the nearer one counting more, 0 at both ends.

    Attributes:
        times: Rising [s]; the first one is when the motion begins, whatever its number.
        positions: One per time [m], base frame; only their differences matter.
        slopes: Velocity at each of them [m/s]; follows from the others.
    """

    times: tuple[float, ...]
    positions: tuple[Vector, ...]
    slopes: tuple[Vector, ...] = field(init=False)

    def __post_init__(self) -> None:
        if len(self.times) != len(self.positions) or len(self.times) < 2:
            raise InvalidValueError(
                f"path of {len(self.times)} times and {len(self.positions)} positions: must be as many of both, "
                "and two at least"
            )
        times = _rising(self.times)
        rows = [vector(f"positions[{i}]", row, 3, "m").tolist() for i, row in enumerate(self.positions)]
        slopes = np.zeros((len(rows), 3))
        if len(rows) > 2:
            slopes[1:-1] = np.gradient(np.array(rows), np.array(times), axis=0)[1:-1]
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "positions", tuple((x, y, z) for x, y, z in rows))
        object.__setattr__(self, "slopes", tuple((x, y, z) for x, y, z in slopes.tolist()))

    @property
    def fastest(self) -> float:
        """Largest speed [m/s], of ten samples between neighbours."""
        begin, spans = self.times[0], zip(self.times, self.times[1:], strict=False)
        return max(norm(self.velocity(a - begin + 0.1 * i * (b - a))) for a, b in spans for i in range(10))

    @property
    def farthest(self) -> float:
        """How far along x or y it leads from where it begins [m]."""
        return float(np.abs(np.array(self.positions) - self.positions[0])[:, :2].max())

    def velocity(self, time: float) -> Vector:
        """See `TangentMotion`."""
        time += self.times[0]
        i = bisect_right(self.times, time)
        if i in (0, len(self.times)):
            return ZERO
        span = self.times[i] - self.times[i - 1]
        u = (time - self.times[i - 1]) / span
        # derivatives of Hermite's cubics
        chord, begin, end = 6.0 * u * (1.0 - u) / span, (1.0 - u) * (1.0 - 3.0 * u), u * (3.0 * u - 2.0)
        (a, b, c), (p, q, r) = self.positions[i - 1], self.positions[i]
        (d, e, f), (s, t, w) = self.slopes[i - 1], self.slopes[i]
        return (
            chord * (p - a) + begin * d + end * s,
            chord * (q - b) + begin * e + end * t,
            chord * (r - c) + begin * f + end * w,
        )


def _rising(given: Sequence[float]) -> tuple[float, ...]:
    """Times that rise [s], checked."""
    times = vector("times", given, len(given), "s")
    if np.any(np.diff(times) <= 0.0):
        i = int(np.flatnonzero(np.diff(times) <= 0.0)[0])
        raise InvalidValueError(f"times[{i + 1}] = {times[i + 1]:g} s: must be later than {times[i]:g} s")
    return tuple(times.tolist())
