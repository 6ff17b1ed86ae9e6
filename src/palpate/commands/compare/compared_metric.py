"""A metric of several runs, side by side."""

import math
from dataclasses import dataclass

from palpate.reporting.data import Quantity
from palpate.reporting.units import Scale, scale_of


@dataclass(frozen=True, slots=True)
class ComparedMetric:
    """One metric of every run.

    Attributes:
        name: What it is.
        unit: Its SI unit, "" for a ratio, a count or words.
        values: A number or words of each run; NaN where a run has none.
        note: What it means, and what is good.
        key: Its name in tables and JSON; made of name and unit if left out.
    """

    name: str
    unit: str
    values: tuple[float | str, ...]
    note: str = ""
    key: str = ""

    @property
    def scale(self) -> Scale:
        """In which unit it is shown."""
        known = [abs(value) for value in self.values if not isinstance(value, str) and math.isfinite(value)]
        return scale_of(self.unit, max(known, default=0.0))

    @property
    def shown(self) -> tuple[str, ...]:
        """The values as shown."""
        return tuple(Quantity(self.name, value).text for value in self._scaled)

    @property
    def differences(self) -> tuple[str, ...]:
        """Every later run's value less the first one's, as shown; "" of words, and where one is not known."""
        first, *others = self._scaled
        return tuple(_less(value, first) for value in others)

    @property
    def _scaled(self) -> list[float | str]:
        factor = self.scale.factor
        return [value if isinstance(value, str) else factor * value for value in self.values]


def _less(value: float | str, first: float | str) -> str:
    if isinstance(value, str) or isinstance(first, str) or not math.isfinite(value - first):
        return ""
    digits = ".0f" if abs(value - first) >= 1000.0 else ".3g"
    return "0" if value == first else f"{value - first:+{digits}}"
