"""A report as data: what was asked, how it ended, metrics, sections, advice; drawn when it is written."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from palpate.reporting.data import Quantity
from palpate.reporting.figure import Figure

NOTHING = "Nothing has to be done."
"""Shown where there is no advice."""

COLUMNS = ("name", "value", "unit", "note")
"""Of a table of metrics."""


@dataclass(frozen=True, slots=True)
class Paragraph:
    """A text of a section."""

    text: str


@dataclass(frozen=True, slots=True)
class QuantityTable:
    """Key metrics within a section; the terminal shows them, too."""

    metrics: tuple[Quantity, ...]


@dataclass(frozen=True, slots=True)
class TextTable:
    """A table of texts.

    Attributes:
        rows: Of texts.
        columns: What each column holds: "name", "value", "unit" or "note".
        heads: Over the columns; none if left out.
    """

    rows: Sequence[tuple[str, ...]]
    columns: Sequence[str] = COLUMNS
    heads: Sequence[str] = ()


@dataclass(frozen=True, slots=True)
class Figures:
    """Figures side by side where there is room.

    Attributes:
        draw: States them when the report is written; those that are None are left out.
    """

    draw: Callable[[], Iterable[Figure | None]]


Part = Paragraph | QuantityTable | TextTable | Figures


@dataclass(frozen=True, slots=True)
class Section:
    """A section; one in which nothing is to be seen is left out.

    Attributes:
        heading: Of it.
        parts: In order.
    """

    heading: str
    parts: tuple[Part, ...]


@dataclass(frozen=True, slots=True)
class Report:
    """The report on a run, a replay, a comparison or a sweep.

    Attributes:
        title: Heading.
        outcome: How it ended, a sentence or more.
        metrics: Most important first.
        sections: In order.
        asked: What was asked for, a sentence without its full stop; "" for none.
        advice: What to do now, a sentence or two each; none where nothing has to be done.
        settings: Name and value with unit of each setting.
        repeat: What is repeated, and the command that does so.
        footer: Frame and sign of the numbers: a sentence or more.
        reached: Whether it came to what it was for: a run that was finished, an object that was held.
    """

    title: str
    outcome: str
    metrics: tuple[Quantity, ...]
    sections: tuple[Section, ...] = ()
    asked: str = ""
    advice: tuple[str, ...] = ()
    settings: tuple[tuple[str, str], ...] = ()
    repeat: tuple[tuple[str, str], ...] = ()
    footer: str = ""
    reached: bool = True

    @property
    def section_quantities(self) -> tuple[Quantity, ...]:
        """Quantities of the sections' tables."""
        parts = (part for section in self.sections for part in section.parts if isinstance(part, QuantityTable))
        return tuple(quantity for part in parts for quantity in part.metrics)

    @property
    def all_metrics(self) -> tuple[Quantity, ...]:
        """Metrics of the summary, then the quantities of the sections."""
        return (*self.metrics, *self.section_quantities)
