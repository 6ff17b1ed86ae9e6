"""What a run is measured by."""

import math
from dataclasses import dataclass

FigureValue = float | int | bool | str | None
"""None where there is no such figure, or nobody knows it."""


@dataclass(frozen=True, slots=True)
class Figure:
    """One column of figures.

    Attributes:
        column: Its name in the tables, the unit at its end.
        words: What it is.
        unit: Its unit; empty for a ratio, a count, a share of runs (of true or false) or a word.
    """

    column: str
    words: str
    unit: str = ""


def number(value: float | None) -> float | None:
    """Return a number as a plain float; None where there is none, or not a finite one."""
    return None if value is None or not math.isfinite(value) else float(value)
