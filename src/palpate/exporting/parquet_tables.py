"""Tables as Apache Parquet, by pyarrow."""

from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any, Self

from palpate.exporting.exporter import Episode
from palpate.exporting.tables import Column, Table, TableExporter
from palpate.extras import require
from palpate.open_kinds import Settings


class ParquetExporter(TableExporter, Settings, frozen=True):
    """Every bit of every number; codes as their names."""

    SUFFIX = ".parquet"

    def write(self, episodes: Iterator[Episode], folder: Path) -> None:
        """Write one file per table."""
        require("pyarrow", "parquet", "--to parquet")
        super().write(episodes, folder)

    def opened(self, path: Path) -> "ParquetFile":
        """Return a new table."""
        return ParquetFile(path)


class ParquetFile:
    """A table that is being written.

    Attributes:
        path: File of the table, which appears with the first rows.
    """

    def __init__(self, path: Path) -> None:
        """Take the path of the file."""
        self.path = path
        self._writer: Any = None
        self._arrow: Any = import_module("pyarrow")  # it has no types

    def __enter__(self) -> Self:
        """Close the file at the end."""
        return self

    def __exit__(self, *error: object) -> None:
        if self._writer is not None:
            self._writer.close()

    def append(self, table: Table) -> None:
        """Write rows; the first rows determine the columns."""
        self.append_arrow(self._arrow.table({column.name: self._array(column) for column in table}))

    def append_arrow(self, table: Any) -> None:
        """Write the rows of a table of pyarrow."""
        if self._writer is None:
            self._writer = import_module("pyarrow.parquet").ParquetWriter(self.path, table.schema)
        self._writer.write_table(table)

    def _array(self, column: Column) -> Any:
        if column.is_text:
            return self._arrow.array(column.values.tolist(), self._arrow.string())
        return self._arrow.array(column.values)
