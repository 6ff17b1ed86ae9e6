"""The key figures of a report as a table for the terminal."""

from collections.abc import Iterable

from rich.table import Table
from rich.text import Text

from palpate.reporting.data import KeyFigure


def key_figures(title: str, outcome: str, figures: Iterable[KeyFigure]) -> Table:
    """Return figures as a table, with the title above and the outcome below.

    Texts are shown as they are: square brackets are not taken for markup.
    """
    table = figure_table(figures)
    table.title, table.caption = Text(title), Text(outcome)
    return table


def figure_table(figures: Iterable[KeyFigure]) -> Table:
    """Return figures as a table."""
    table = Table(show_header=False)
    table.add_column("name")
    table.add_column("value", justify="right", style="bold")
    table.add_column("unit")
    table.add_column("note", style="dim")
    for figure in figures:
        table.add_row(Text(figure.name), Text(figure.text), Text(figure.unit), Text(figure.note))
    return table
