"""What a run is measured by."""

import math
from collections.abc import Iterable
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


def is_share(values: Iterable[FigureValue]) -> bool:
    """Return whether a figure's values are true or false: shown is then the share of runs for which it is true."""
    known = [value for value in values if value is not None]
    return bool(known) and all(isinstance(value, bool) for value in known)
