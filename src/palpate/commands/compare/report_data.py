"""What a report on several runs side by side is made from: numbers and arrays, no drawing."""

import math
from dataclasses import dataclass

from palpate.errors import FloatArray, InvalidValueError
from palpate.reporting.data import KeyFigure


@dataclass(frozen=True, slots=True)
class ComparedFigure:
    """One figure of every run.

    Attributes:
        name: What it is.
        unit: Its unit, "" for a ratio, a count or words.
        values: A number or words of each run; NaN where a run has none.
        note: What it tells, and what is good.
    """

    name: str
    unit: str
    values: tuple[float | str, ...]
    note: str = ""

    @property
    def shown(self) -> tuple[str, ...]:
        """The values as shown."""
        return tuple(KeyFigure(self.name, value, self.unit).text for value in self.values)

    @property
    def differences(self) -> tuple[str, ...]:
        """Every later run's value less the first one's, as shown; "" of words, and where one is not known."""
        return tuple(_less(value, self.values[0]) for value in self.values[1:])


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """One line of one run.

    Attributes:
        run: Whose, from 0.
        x: Shape (n,).
        y: Shape (n,), may hold NaN.
        asked: Whether it is what was asked for, drawn dashed.
    """

    run: int
    x: FloatArray
    y: FloatArray
    asked: bool = False

    def __post_init__(self) -> None:
        if self.x.shape != self.y.shape:
            raise InvalidValueError(f"y has shape {self.y.shape}: must be {self.x.shape}, as x")


@dataclass(frozen=True, slots=True, eq=False)
class Overlay:
    """A picture in which runs lie over one another.

    Attributes:
        title: Heading.
        caption: What one sees and what is good.
        x: Label of the axis, with unit.
        y: Likewise.
        curves: In order of the runs.
    """

    title: str
    caption: str
    x: str
    y: str
    curves: tuple[Curve, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Spreads:
    """A picture of how errors of each run are spread.

    Attributes:
        title: Heading.
        caption: What one sees and what is good.
        x: Label of the axis, with unit.
        values: Of each run, each of any length; empty where a run has none.
    """

    title: str
    caption: str
    x: str
    values: tuple[FloatArray, ...]


@dataclass(frozen=True, slots=True, eq=False)
class ComparisonReport:
    """All that a report on several runs shows.

    Attributes:
        title: Heading.
        asked: What was to be compared.
        outcome: What came out, a sentence or two.
        names: Of the runs, each another one.
        differences: What was asked differently: name, unit, and what was asked of each run.
        figures: Side by side, most important first.
        overlays: Over one another.
        spreads: Likewise.
        advice: What to do now.
        repeat: What is repeated, and the command that does so.
        settings: What was asked alike, name and value with unit.
    """

    title: str
    asked: str
    outcome: str
    names: tuple[str, ...]
    differences: tuple[tuple[str, ...], ...]
    figures: tuple[ComparedFigure, ...]
    overlays: tuple[Overlay, ...]
    spreads: tuple[Spreads, ...]
    advice: tuple[str, ...] = ()
    repeat: tuple[tuple[str, str], ...] = ()
    settings: tuple[tuple[str, str], ...] = ()

    def __post_init__(self) -> None:
        if len(self.names) < 2:
            raise InvalidValueError(f"there are {len(self.names)} runs: must be 2 or more to be compared")
        for figure in self.figures:
            if len(figure.values) != len(self.names):
                raise InvalidValueError(
                    f"{figure.name} has {len(figure.values)} values: must be {len(self.names)}, one per run"
                )


def _less(value: float | str, first: float | str) -> str:
    if isinstance(value, str) or isinstance(first, str) or not math.isfinite(value - first):
        return ""
    return "0" if value == first else f"{value - first:+.3g}"
