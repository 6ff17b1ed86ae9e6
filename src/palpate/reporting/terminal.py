"""The key metrics of a report as a table for the terminal."""

from collections.abc import Iterable

from rich.table import Table
from rich.text import Text

from palpate.reporting.data import Quantity


def quantities(title: str, outcome: str, metrics: Iterable[Quantity]) -> Table:
    """Return metrics as a table, with the title above and the outcome below.

    Texts are shown as they are: square brackets are not taken for markup.
    """
    table = quantity_table(metrics)
    table.title, table.caption = Text(title), Text(outcome)
    return table


def quantity_table(metrics: Iterable[Quantity]) -> Table:
    """Return metrics as a table."""
    table = Table(show_header=False)
    table.add_column("name")
    table.add_column("value", justify="right", style="bold")
    table.add_column("unit")
    table.add_column("note", style="dim")
    for metric in metrics:
        table.add_row(Text(metric.name), Text(metric.text), Text(metric.unit), Text(metric.note))
    return table
