"""What a study of speed against error gives: rows of figures, and the words to read them by."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

Tell = Callable[[str], None]
"""Told of what is being done."""


@dataclass(frozen=True, slots=True)
class Row:
    """One method, or one setting of one.

    Attributes:
        series: Rows of one series are joined by a line in the picture.
        method: What it is.
        cost: What it costs, SI.
        typical: Its error, median or root mean square as the study says, SI; NaN if it gave no answer.
        worst: Its largest error, likewise; NaN if nobody looked.
        note: What to know besides.
    """

    series: str
    method: str
    cost: float
    typical: float
    worst: float
    note: str = ""


@dataclass(frozen=True, slots=True)
class Study:
    """What was measured.

    Attributes:
        title: Short heading.
        about: What was done, and against which truth, in sentences.
        cost: What `Row.cost` is, in words without its unit.
        cost_unit: SI.
        error: What `Row.typical` and `Row.worst` are of.
        error_unit: SI; "" for a ratio.
        rows: In the order of the table.
    """

    title: str
    about: str
    cost: str
    cost_unit: str
    error: str
    error_unit: str
    rows: tuple[Row, ...]


class Measure(Protocol):
    """Carries out a study."""

    def __call__(self, quick: bool, seed: int, tell: Tell) -> Study:
        """Measure; told is each step."""
        ...
