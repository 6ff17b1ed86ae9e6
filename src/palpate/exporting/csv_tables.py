"""CSV, for everything."""

import csv
import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from palpate.exporting.table_exporter import TableExporter
from palpate.exporting.tables import Table
from palpate.open_kinds import Settings
from palpate.plain_text import inert_cell


class CsvExporter(TableExporter, Settings, frozen=True):
    """Comma-separated, UTF-8, a header line; %.17g keeps every double but the payload of a NaN."""

    SUFFIX = ".csv"

    @contextmanager
    def opened(self, path: Path) -> Iterator["CsvFile"]:
        """See `TableExporter`."""
        with path.open("wb") as file:
            yield CsvFile(file)


class CsvFile:
    """A table that is being written."""

    def __init__(self, file: BinaryIO) -> None:
        """Take the file."""
        self._file, self._empty = file, True

    def append(self, table: Table) -> None:
        """See `TableFile`."""
        if self._empty:
            self._file.write(_lines([[column.name for column in table]]))
            self._empty = False
        self._file.write(_lines(zip(*[_cells(column.values) for column in table], strict=True)))


def _cells(values: npt.NDArray[Any]) -> list[Any]:
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
