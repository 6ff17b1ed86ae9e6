"""A report as data: request, outcome, metrics, sections, advice; figures are drawn when it is written."""

import traceback
from base64 import b64encode
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from html import escape

from rich.table import Table
from rich.text import Text

from palpate.reporting.data import Quantity
from palpate.reporting.figure import Figure
from palpate.runtime.palette import CARD

NOTHING = "Nothing has to be done."
"""Text of a report without advice."""

_MAX_SUMMARY = 8
"""Maximum number of metrics in the text of a result."""

COLUMNS = ("name", "value", "unit", "note")
"""Columns of a table of metrics."""


@dataclass(frozen=True, slots=True)
class Paragraph:
    """A text of a section."""

    text: str


@dataclass(frozen=True, slots=True)
class QuantityTable:
    """Metrics within a section; the terminal shows them, too."""

    metrics: tuple[Quantity, ...]


@dataclass(frozen=True, slots=True)
class TextTable:
    """A table of texts.

    Attributes:
        rows: Rows of texts.
        columns: Kind of each column: "name", "value", "unit" or "note".
        heads: Headings of the columns; () for none.
    """

    rows: Sequence[tuple[str, ...]]
    columns: Sequence[str] = COLUMNS
    heads: Sequence[str] = ()


@dataclass(frozen=True, slots=True)
class FigureFailure:
    """A figure that could not be drawn.

    Attributes:
        title: Title of the figure, or the heading of its section if drawing failed before there was a title.
        error: Kind and message of the exception.
        place: File and line that raised the exception, outside of other libraries if possible.
    """

    title: str
    error: str
    place: str

    def __str__(self) -> str:
        return f"figure {self.title!r} could not be drawn: {self.error} ({self.place})"

    @classmethod
    def of(cls, title: str, error: Exception) -> "FigureFailure":
        """Return the failure that an exception describes."""
        frames = traceback.extract_tb(error.__traceback__)
        own = [frame for frame in frames if "site-packages" not in frame.filename] or frames
        place = f"{own[-1].filename}, line {own[-1].lineno}" if own else "unknown place"
        return cls(title, "".join(traceback.format_exception_only(error)).strip(), place)


FigureSource = Figure | Callable[[], Figure | None] | None
"""A figure, a function that draws one, or None, which is left out."""


@dataclass(frozen=True, slots=True)
class Figures:
    """Figures side by side where there is room.

    Attributes:
        draw: Function that returns or yields the figures when the report is written. An exception in it ends the
            figures of this part; an exception in a function that it yields costs one figure alone.
    """

    draw: Callable[[], Iterable[FigureSource]]

    def drawn(self, heading: str) -> Iterator[Figure | FigureFailure]:
        """Yield each figure, or the failure in its place.

        Args:
            heading: Heading of the section, which names a figure that fails before it has a title.
        """
        try:
            for source in self.draw():
                figure = _drawn(source, heading) if callable(source) else source
                if figure is not None:
                    yield figure
        except Exception as error:  # a figure never costs a finished run
            yield FigureFailure.of(heading, error)


def _drawn(draw: Callable[[], Figure | None], heading: str) -> Figure | FigureFailure | None:
    try:
        return draw()
    except Exception as error:
        name = getattr(getattr(draw, "func", draw), "__name__", "")  # of a `partial`, or of the function itself
        words = name.strip("_").replace("_", " ")
        return FigureFailure.of(f"{heading}: {words}" if name.isidentifier() else heading, error)


Part = Paragraph | QuantityTable | TextTable | Figures


@dataclass(frozen=True, slots=True)
class Section:
    """A section; one without content is left out.

    Attributes:
        heading: Heading of the section.
        parts: Parts in order.
    """

    heading: str
    parts: tuple[Part, ...]


@dataclass(frozen=True, slots=True)
class Report:
    """The report on a run, a replay, a comparison or a sweep.

    Attributes:
        title: Heading.
        outcome: How the run ended, in a sentence or more.
        metrics: Metrics, most important first.
        sections: Sections in order.
        asked: Request in a sentence without its full stop; "" for none.
        advice: Advice to the user, a sentence or two each; () where nothing has to be done.
        settings: Name and value with unit of each setting.
        repeat: Purpose and command line of each way to repeat the run.
        footer: Frame and sign of the numbers, in a sentence or more.
        reached: Whether the run reached its goal.
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

    def drawn(self) -> Iterator[Figure | FigureFailure]:
        """Draw and yield each figure of the sections, or the failure in its place."""
        for section in self.sections:
            for part in section.parts:
                if isinstance(part, Figures):
                    yield from part.drawn(section.heading)


def quantity_table(metrics: Iterable[Quantity], title: str = "", outcome: str = "") -> Table:
    """Return metrics as a table for the terminal, with the title above and the outcome below.

    Square brackets in the texts are not markup.
    """
    table = Table(
        show_header=False, title=Text(title) if title else None, caption=Text(outcome) if outcome else None
    )
    table.add_column("name")
    table.add_column("value", justify="right", style="bold")
    table.add_column("unit")
    table.add_column("note", style="dim")
    for metric in metrics:
        table.add_row(Text(metric.name), Text(metric.text), Text(metric.unit), Text(metric.note))
    return table


def report_summary(report: Report) -> str:
    """Return title, outcome and main metrics of a report as a few lines of text."""
    shown = (f"  {k.name}: {k.text} {k.unit}".rstrip() for k in report.metrics[:_MAX_SUMMARY])
    more = len(report.metrics) - _MAX_SUMMARY
    ending = [f"  and {more} more metrics"] if more > 0 else []
    return "\n".join([report.title, report.outcome, *shown, *ending])


def report_fragment(report: Report) -> str:
    """Return title, outcome, metrics and the first figure of a report as HTML for a notebook, without styles."""
    rows = "".join(
        f"<tr><th>{escape(k.name)}</th><td>{escape(k.text)}</td><td>{escape(k.unit)}</td><td>{escape(k.note)}</td></tr>"
        for k in report.metrics
    )
    head = f"<h4>{escape(report.title)}</h4><p>{escape(report.outcome)}</p><table>{rows}</table>"
    first = next(report.drawn(), None)
    if first is None:
        return head
    if isinstance(first, FigureFailure):
        return f"{head}\n<p>{escape(str(first))}</p>"
    from palpate.reporting.paper import svg_text  # imports matplotlib, which takes a second

    source = b64encode(svg_text(first).encode("utf-8")).decode("ascii")
    # the theme of a notebook is unknown
    style = f"max-width: 45em; width: 100%; background: {CARD.light}; color-scheme: light"
    image = f'<img src="data:image/svg+xml;base64,{source}" alt="{escape(first.title)}" style="{style}">'
    return f"{head}\n{image}"
