"""Tables as CSV."""

import csv
import io
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from palpate.exporting.tables import Table, TableExporter
from palpate.open_kinds import Settings
from palpate.plain_text import inert_cell


class CsvExporter(TableExporter, Settings, frozen=True):
    """Comma-separated, UTF-8, a header line; %.17g keeps every double but the payload of a NaN."""

    SUFFIX = ".csv"

    @contextmanager
    def opened(self, path: Path) -> Iterator["_CsvFile"]:
        """Give a new table."""
        with path.open("wb") as file:
            yield _CsvFile(file)


class _CsvFile:
    def __init__(self, file: BinaryIO) -> None:
        self._file, self._empty = file, True

    def append(self, table: Table) -> None:
        if self._empty:
            self._file.write(_lines([[column.name for column in table]]))
            self._empty = False
        self._file.write(_lines(zip(*[_cells(column.values) for column in table], strict=True)))


def _cells(values: npt.NDArray[Any]) -> list[Any]:
    if values.dtype == np.float64:
        return [f"{x:.17g}" for x in values.tolist()]
    if values.dtype == object:
        return [inert_cell(text) for text in values.tolist()]
    cells: list[Any] = (values.astype(int) if values.dtype == np.bool_ else values).tolist()
    return cells


def _lines(rows: Iterable[Sequence[object]]) -> bytes:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue().encode()
