"""`palpate compare RUN RUN ...`: runs of the same experiment side by side, as a table and a report."""

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table
from rich.text import Text

from palpate.commands.command_result import CommandResult
from palpate.commands.compare.compared_metric import ComparedMetric
from palpate.commands.compare.runs_compared import read_runs
from palpate.commands.compare.runs_compared_report import (
    changed_options,
    compared_heads,
    compared_metrics,
    comparison_report,
)
from palpate.commands.progress import doing
from palpate.commands.say import say
from palpate.experiments.kit.output_folder import make_folder
from palpate.reporting.data import FigureKind
from palpate.reporting.page import write_report
from palpate.reporting.report import Report
from palpate.reporting.units import quantity_key

FILE_NAME = "comparison.html"
"""Of the report, in the output folder."""


def compare_runs(places: Sequence[Path], out: Path | None, figures: FigureKind | None = None) -> CommandResult:
    """Compare runs, print the metrics, and write the report.

    Args:
        places: Folders or logs of two runs or more.
        out: Folder for the report; that of the first run, if not given.
        figures: As which files its figures are written, too; None: as none.

    Returns:
        The metrics, in a list of one per run.

    Raises:
        InvalidValueError: One is no run, or they cannot be compared.
        OSError: A log cannot be read, or the report not be written.
    """
    console = Console()
    with doing(console, "reading the logs"):
        runs = read_runs(places, lambda step: say(console, step))
    folder = runs[0].log.path.parent if out is None else out
    make_folder(folder)
    with doing(console, "comparing"):
        report = comparison_report(runs, folder)
        metrics, differences = compared_metrics(runs), changed_options(runs)
    console.print(_table(report, [run.name for run in runs], metrics, differences))
    path = folder / FILE_NAME
    with doing(console, "drawing the report"):
        files = write_report(report, path, figures).files
    for each in files:
        say(console, f"Written: {each}")
    return CommandResult(
        outcome=report.outcome,
        metrics={f.key or quantity_key(f.name, f.unit): list(f.values) for f in metrics},
        facts={
            "runs": [str(run.log.path) for run in runs],
            "changed_options": {row[0]: list(row[2:]) for row in differences},
        },
        files=files,
    )


def _table(
    report: Report, names: Sequence[str], metrics: Sequence[ComparedMetric], differences: Sequence[tuple[str, ...]]
) -> Table:
    """Return the table of differing options and of metrics side by side."""
    table = Table(title=Text(report.title), caption=Text(report.outcome))
    for i, head in enumerate(compared_heads(names)[:-1]):
        table.add_column(Text(head), justify="left" if i < 2 else "right")
    blank = ("",) * (len(names) - 1)
    for name, unit, *values in differences:
        table.add_row(*(Text(each) for each in (f"option: {name}", unit, *values, *blank)))
    for metric in metrics:
        table.add_row(
            *(Text(each) for each in (metric.name, metric.scale.unit, *metric.shown, *metric.differences))
        )
    return table
