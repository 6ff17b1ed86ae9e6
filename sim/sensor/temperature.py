"""Thermal drift of a force/torque sensor's zero.

A strain-gauge bridge shows a load when it warms up, by its electronics, by the robot that it is bolted to or by
what it touches. Compensated bridges show less of it, none shows nothing.
"""

import math
from dataclasses import dataclass

from palpate.errors import InvalidValueError, positive
from palpate.sensing.ft.arrays import AXES
from palpate.spatial import Wrench


@dataclass(frozen=True, slots=True)
class WarmUp:
    """Switched on at time 0, a device ends `rise` warmer than it began: rise (1 - exp(-t / time_constant)).

    Attributes:
        rise: [K].
        time_constant: [s]; after three of them, 95 % is over.
    """

    rise: float
    time_constant: float

    def __post_init__(self) -> None:
        if not math.isfinite(self.rise):
            raise InvalidValueError(f"rise = {self.rise!r} K: must be finite")
        positive("time_constant", self.time_constant, "s")


@dataclass(frozen=True, slots=True)
class TemperatureProfile:
    """A given course of temperature, straight between its points, level before the first and after the last.

    Attributes:
        time: Of the points, rising [s].
        rise: Above the temperature at which the bias was found [K].
    """

    time: tuple[float, ...]
    rise: tuple[float, ...]

    def __post_init__(self) -> None:
        if len(self.time) != len(self.rise) or not self.time:
            raise InvalidValueError(
                f"temperature profile: {len(self.time)} times, {len(self.rise)} rises: must be as many, 1 or more"
            )
        if not all(math.isfinite(x) for x in (*self.time, *self.rise)):
            raise InvalidValueError("temperature profile: every time [s] and rise [K] must be finite")
        for before, after in zip(self.time, self.time[1:], strict=False):
            if not before < after:
                raise InvalidValueError(f"temperature profile: {after:g} s after {before:g} s: times must rise")


@dataclass(frozen=True, slots=True)
class ThermalDrift:
    """The zero moves in proportion to the temperature.

    Attributes:
        per_kelvin: Of each axis [N/K, N m/K], with its sign.
        temperature: How warm it is when.
    """

    per_kelvin: Wrench
    temperature: WarmUp | TemperatureProfile

    def __post_init__(self) -> None:
        if len(self.per_kelvin) != len(AXES) or not all(math.isfinite(x) for x in self.per_kelvin):
            raise InvalidValueError(f"per_kelvin = {self.per_kelvin!r}: must be 6 finite numbers [N/K, N m/K]")
