"""A sweep as tables: runs.csv, and runs.parquet where pyarrow is installed."""

import csv
import io
from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path

from palpate.atomic_file import replacing
from palpate.commands.sweep.plan import SweepPlan
from palpate.commands.sweep.record import RunRecord
from palpate.commands.typed_values import plain, shown_value
from palpate.experiments.kit.metric import MetricValue
from palpate.plain_text import inert_cell

FRONT = ("run",)
"""Columns before the options that were varied,"""

MIDDLE = ("seed", "status", "message", "duration_s", "host")
"""and behind them, before the metrics."""

VERSIONS = ("palpate", "python", "numpy", "scipy", "numba", "mujoco")
"""Whose versions stand in the last columns."""


def columns_of(plan: SweepPlan) -> tuple[str, ...]:
    """Return the names of all columns."""
    varied = (each.name for each in plan.varied)
    versions = (f"{name}_version" for name in VERSIONS)
    return (*FRONT, *varied, *MIDDLE, *(metric.key for metric in plan.experiment.metrics), *versions)


def rows_of(plan: SweepPlan, records: Sequence[RunRecord]) -> list[dict[str, MetricValue]]:
    """Return one row per record, by column."""
    rows = []
    for record in records:
        values = plan.runs[record.run].combination.values
        row: dict[str, MetricValue] = {"run": record.run}
        row |= {each.name: plain(value) for each, value in zip(plan.varied, values, strict=True)}
        row |= {
            "seed": record.seed,
            "status": record.status.value,
            "message": record.message,
            "duration_s": record.duration,
            "host": record.host,
        }
        row |= {metric.key: record.metrics.get(metric.key) for metric in plan.experiment.metrics}
        row |= {f"{name}_version": record.versions.get(name) for name in VERSIONS}
        rows.append(row)
    return rows


def write_csv(rows: Sequence[Mapping[str, MetricValue]], columns: Sequence[str], path: Path) -> None:
    """Write rows as CSV with a heading; what is not known is empty, floats read back to the same bits.

    Raises:
        OSError: The file cannot be written.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([_cell(row[name]) for name in columns] for row in rows)
    with replacing(path) as file:
        file.write(text.getvalue().encode("utf-8"))


def write_parquet(rows: Sequence[Mapping[str, MetricValue]], columns: Sequence[str], path: Path) -> bool:
    """Write rows as Parquet, if pyarrow is installed; return whether it is.

    Raises:
        OSError: The file cannot be written.
    """
    try:
        arrow, parquet = import_module("pyarrow"), import_module("pyarrow.parquet")
    except ImportError:
        return False
    table = arrow.table({name: arrow.array(_alike([row[name] for row in rows])) for name in columns})
    with replacing(path) as file:
        parquet.write_table(table, file)
    return True


def _cell(value: MetricValue) -> str:
    if value is None:
        return ""
    return (
        str(value).lower()
        if isinstance(value, bool)
        else repr(value)
        if isinstance(value, float)
        else inert_cell(str(value))
    )


def _alike(values: list[MetricValue]) -> list[MetricValue]:
    """Values of one type, as a column needs them: whole numbers among others are such, words make all words."""
    kinds = {type(value) for value in values if value is not None}
    if kinds <= {int, float} and float in kinds:
        return [None if value is None else float(value) for value in values]
    if len(kinds) > 1:
        return [None if value is None else shown_value(value) for value in values]
    return values
