"""Rows and time series of reports: numbers, their words and arrays, without drawing."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Literal

from palpate.errors import FloatArray, InvalidValueError

FigureKind = Literal["pdf", "svg", "png"]
"""Suffix of a figure's file."""

_MAX_DECIMALS = 6


@dataclass(frozen=True, slots=True)
class Quantity:
    """One row of a report's table.

    Attributes:
        name: Name of the quantity.
        value: A number, or words.
        unit: Unit of the value; "" for a ratio, a count or words.
        note: Number or remark to compare the value with; "" for none.
        digits: Significant digits of a number that is not whole.
    """

    name: str
    value: float | str
    unit: str = ""
    note: str = ""
    digits: int = 4

    @property
    def text(self) -> str:
        """The value as shown; a dash for NaN."""
        value = self.value
        if isinstance(value, str):
            return value
        if math.isnan(value):
            return "-"
        if abs(value) < 1e6 and (value == round(value) or abs(value) >= 10.0**self.digits):
            return f"{value:.0f}"
        return f"{value:#.{self.digits}g}".rstrip(".")


def value_words(value: float, lower: float, upper: float) -> str:
    """Return the value to two digits of the half width of its interval; to four digits without an interval.

    Noise around zero then reads 0.0001, not 9.461e-05.
    """
    return f"{value:.{_decimals(value, lower, upper)}f}"


def interval_words(value: float, lower: float, upper: float) -> str:
    """Return the interval with as many decimals as the value has in `value_words`."""
    digits = _decimals(value, lower, upper)
    end = f"to {upper:.{digits}f}" if math.isfinite(upper) else "upwards"
    return f"95 %: {lower:.{digits}f} {end}"


def _decimals(value: float, lower: float, upper: float) -> int:
    half, decimals = 0.5 * (upper - lower), 1
    if math.isfinite(half) and half > 0.0:
        decimals = 1 - math.floor(math.log10(half))
    elif value != 0.0:
        decimals = 3 - math.floor(math.log10(abs(value)))
    return min(max(decimals, 0), _MAX_DECIMALS)


@dataclass(frozen=True, slots=True, eq=False)
class TimeSeries:
    """Forces, torques and speed of a run, one entry per control period.

    Attributes:
        time: Increasing, shape (k,) [s].
        phase: Name of the controller's phase, length k; any sequence of strings is taken.
        measured_force: Normal force estimated by contact sensing, shape (k,) [N]; NaN without contact.
        set_force: Set normal force, shape (k,) [N].
        spin_torque: Spin torque estimated by contact sensing, shape (k,) [N m]; NaN without contact.
        speed: Speed of the fingertip, shape (k,) [m/s].
        true_force: Normal force of the simulation, shape (k,) [N]; None on a robot.
        true_spin_torque: Spin torque of the simulation, shape (k,) [N m]; None on a robot.

    Raises:
        InvalidValueError: If lengths differ.
    """

    time: FloatArray
    phase: Sequence[str]
    measured_force: FloatArray
    set_force: FloatArray
    spin_torque: FloatArray
    speed: FloatArray
    true_force: FloatArray | None = None
    true_spin_torque: FloatArray | None = None

    def __post_init__(self) -> None:
        count = len(self.time)
        for each in fields(self):
            values = getattr(self, each.name)
            if values is not None and len(values) != count:
                raise InvalidValueError(f"{each.name} has {len(values)} entries: must be {count}, one per time")
        object.__setattr__(self, "phase", tuple(str(name) for name in self.phase))
