"""A log as tables: CSV for everything, Parquet for what reads it."""

import csv
import io
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from palpate.atomic_file import replacing
from palpate.extras import require
from palpate.plain_text import inert_cell
from palpate.runtime.log import Level, LogReader
from palpate.runtime.log.chunk import LogRows
from palpate.runtime.log.fields import LogField, path_of, walk
from palpate.runtime.log.period_codec import PeriodCodec

Progress = Callable[[float], None]
"""Called with the fraction that is done."""

_ROWS_AT_ONCE = 10_000
"""Of a table: a few megabytes."""


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

    def write(self, pieces: Iterable[Table], path: Path) -> int:
        """Write a table that comes in one or more pieces; the file appears whole or not at all.

        Returns:
            Number of rows.

        Raises:
            OSError: It cannot be written.
        """
        ...


class CsvWriter:
    """Comma-separated, UTF-8, a header line; %.17g keeps every double but the payload of a NaN."""

    suffix = ".csv"

    def write(self, pieces: Iterable[Table], path: Path) -> int:
        """See `TableWriter`."""
        count = 0
        with replacing(path) as file:
            for index, table in enumerate(pieces):
                if index == 0:
                    file.write(_lines([column_names(table)]))
                file.write(_lines(zip(*[_texts(column.values) for column in table], strict=True)))
                count += len(table[0].values)
        return count


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

    def write(self, pieces: Iterable[Table], path: Path) -> int:
        """See `TableWriter`."""
        count, writer = 0, None
        with replacing(path) as file, ExitStack() as open_files:
            for table in pieces:
                arrow = self._arrow.table({column.name: self._array(column) for column in table})
                if writer is None:
                    writer = open_files.enter_context(self._parquet.ParquetWriter(file, arrow.schema))
                writer.write_table(arrow)
                count += len(table[0].values)
        return count

    def _array(self, column: Column) -> Any:
        if column.is_text:
            return self._arrow.array(column.values.tolist(), self._arrow.string())
        return self._arrow.array(column.values)


def period_tables(log: LogReader, progress: Progress) -> Iterator[Table]:
    """Yield the table of the periods in pieces, while the log is read."""
    count = 0
    yield empty_period_table(log.codec)  # for the header of an empty log
    held: list[LogRows] = []
    for piece in log.pieces(progress):
        held.append(piece)
        count += len(piece.sequence)
        if count >= _ROWS_AT_ONCE:
            yield _period_table(log.codec, _joined(held))
            held, count = [], 0
    if held:
        yield _period_table(log.codec, _joined(held))


def empty_period_table(codec: PeriodCodec) -> Table:
    """Return the columns of the table of the periods, without rows."""
    return _period_table(codec, LogRows(np.empty(0, np.int64), np.empty((0, codec.width))))


def column_names(table: Table) -> list[str]:
    """Return the names of its columns."""
    return [column.name for column in table]


def entry_tables(log: LogReader) -> Mapping[str, Table]:
    """Return the other tables of a log that was read, by name."""
    return {
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


def _joined(pieces: Sequence[LogRows]) -> LogRows:
    return LogRows(
        np.concatenate([piece.sequence for piece in pieces]), np.concatenate([piece.values for piece in pieces])
    )


def _period_table(codec: PeriodCodec, piece: LogRows) -> Table:
    columns = [Column("sequence", piece.sequence)]
    for group, quantity in walk(codec.groups):
        place = codec.columns[path_of(group, quantity)]
        name = path_of(group, quantity).replace(".", "_")
        columns += _columns(name, quantity, piece.values[:, place])
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
