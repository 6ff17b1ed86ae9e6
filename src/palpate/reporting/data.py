"""Metrics and time series of reports: numbers and arrays, no drawing."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from palpate.errors import FloatArray, InvalidValueError


@dataclass(frozen=True, slots=True)
class Quantity:
    """One line of a report's summary.

    Attributes:
        name: What it is.
        value: A number, or words.
        unit: Its unit, "" for a ratio, a count or words.
        note: What to compare it with, or "".
        digits: Significant digits shown of a number that is not whole.
    """

    name: str
    value: float | str
    unit: str = ""
    note: str = ""
    digits: int = 4

    @property
    def text(self) -> str:
        """The value as shown; a dash where there is none."""
        if isinstance(self.value, str):
            return self.value
        if math.isnan(self.value):
            return "-"
        if math.isfinite(self.value) and self.value == round(self.value) and abs(self.value) < 1e6:
            return f"{self.value:.0f}"
        if 10.0**self.digits <= abs(self.value) < 1e6:
            return f"{self.value:.0f}"
        return f"{self.value:#.{self.digits}g}".rstrip(".")


@dataclass(frozen=True, slots=True, eq=False)
class TimeSeries:
    """What happened over time, one entry per control period.

    Attributes:
        time: Increasing, shape (k,) [s].
        phase: Name of the controller's phase, length k; any sequence of strings is taken.
        measured_force: Normal force that touch found, shape (k,) [N]; NaN without contact.
        set_force: Normal force asked for, shape (k,) [N].
        spin_torque: Spin torque that touch found, shape (k,) [N m]; NaN without contact.
        speed: Speed of the fingertip, shape (k,) [m/s].
        true_force: Normal force of the simulation, shape (k,) [N], if known.
        true_spin_torque: Spin torque of the simulation, shape (k,) [N m], if known.

    Raises:
        InvalidValueError: Lengths differ.
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
        names = ("phase", "measured_force", "set_force", "spin_torque", "speed", "true_force", "true_spin_torque")
        for name in names:
            values = getattr(self, name)
            if values is not None and len(values) != count:
                raise InvalidValueError(f"{name} has {len(values)} entries: must be {count}, one per time")
        object.__setattr__(self, "phase", tuple(str(name) for name in self.phase))
