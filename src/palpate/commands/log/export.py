"""A log as tables: CSV for everything, Parquet for what reads it."""

import csv
import io
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from palpate.atomic_file import replacing
from palpate.extras import require
from palpate.plain_text import inert_cell
from palpate.runtime.log import Level, Log
from palpate.runtime.log.fields import LogField, path_of, walk

Progress = Callable[[float], None]
"""Called with the fraction that is done."""

_ROWS_AT_ONCE = 2000


@dataclass(frozen=True, slots=True, eq=False)
class Column:
    """A column of a table.

    Attributes:
        name: With its unit, as in arm_position_x_m.
        values: Numbers, or names as text, shape (n,).
    """

    name: str
    values: npt.NDArray[Any]

    @property
    def is_text(self) -> bool:
        """Whether it holds names."""
        return self.values.dtype == object


Table = tuple[Column, ...]


class TableWriter(Protocol):
    """Writes tables in one format."""

    suffix: str

    def write(self, table: Table, path: Path, progress: Progress) -> None:
        """Write a table; the file appears whole or not at all.

        Raises:
            OSError: It cannot be written.
        """
        ...


class CsvWriter:
    """Comma-separated, UTF-8, a header line; %.17g keeps every double but the payload of a NaN."""

    suffix = ".csv"

    def write(self, table: Table, path: Path, progress: Progress) -> None:
        """See `TableWriter`."""
        count = len(table[0].values)
        with replacing(path) as file:
            file.write(_lines([[column.name for column in table]]))
            for start in range(0, count, _ROWS_AT_ONCE):
                columns = [_texts(column.values[start : start + _ROWS_AT_ONCE]) for column in table]
                file.write(_lines(zip(*columns, strict=True)))
                progress(min(1.0, (start + _ROWS_AT_ONCE) / count))


class ParquetWriter:
    """Apache Parquet, by pyarrow."""

    suffix = ".parquet"

    def __init__(self) -> None:
        """Load pyarrow.

        Raises:
            MissingLibraryError: It is not installed.
        """
        require("pyarrow", "parquet", "--format parquet")
        self._arrow: Any = import_module("pyarrow")  # it has no types
        self._parquet: Any = import_module("pyarrow.parquet")

    def write(self, table: Table, path: Path, progress: Progress) -> None:
        """See `TableWriter`."""
        columns = {
            column.name: self._arrow.array(column.values.tolist() if column.is_text else column.values)
            for column in table
        }
        with replacing(path) as file:
            self._parquet.write_table(self._arrow.table(columns), file)
        progress(1.0)


def tables_of(log: Log) -> Mapping[str, Table]:
    """Return the tables of a log by name."""
    return {
        "period": _period_table(log),
        "event": (
            _column("time_s", [event.time for event in log.events]),
            _names("level", [Level(event.level).name for event in log.events]),
            _names("source", [event.source for event in log.events]),
            _names("text", [event.text for event in log.events]),
        ),
        "parameter": (
            _column("time_s", [change.time for change in log.changes]),
            _names("name", [change.name for change in log.changes]),
            _column("value", [change.value for change in log.changes]),
        ),
    }


def _period_table(log: Log) -> Table:
    columns = [Column("sequence", log.sequence)]
    for group, quantity in walk(log.codec.groups):
        place = log.codec.columns[path_of(group, quantity)]
        name = path_of(group, quantity).replace(".", "_")
        columns += _columns(name, quantity, log.rows[:, place])
    return tuple(columns)


def _columns(name: str, quantity: LogField, values: npt.NDArray[np.float64]) -> Iterator[Column]:
    if quantity.codes:
        yield Column(name, np.array(quantity.codes, object)[values[:, 0].astype(int)])
        return
    dtype = "?" if quantity.ros_type == "bool" else quantity.dtype
    for i, (component, unit) in enumerate(zip(quantity.components, quantity.units, strict=True)):
        parts = [name, component, unit.replace(" ", "")]
        yield Column("_".join(part for part in parts if part), values[:, i].astype(dtype))


def _column(name: str, values: list[float]) -> Column:
    return Column(name, np.array(values, np.float64))


def _names(name: str, values: list[str]) -> Column:
    column = np.empty(len(values), object)
    column[:] = values
    return Column(name, column)


def _texts(values: npt.NDArray[Any]) -> list[Any]:
    if values.dtype == np.float64:
        return [f"{x:.17g}" for x in values.tolist()]
    if values.dtype == np.bool_:
        values = values.astype(int)
    whatever: list[Any] = values.tolist()
    if values.dtype == object:
        return [inert_cell(text) for text in whatever]
    return whatever


def _lines(rows: Any) -> bytes:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue().encode()
