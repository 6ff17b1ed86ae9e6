"""Tables of numbers in CSV text, whole or as a stream: columns by name and unit, mistakes named with their line.

The first line that is no comment names the columns; lines that begin with # are comments. The name of a column may
end with a unit, as in fx_N, "fy [N]" or mz(Nmm). Without a unit its numbers are in SI units.
"""

import csv
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from palpate.bounded_file import Bounds, read_text
from palpate.errors import FloatArray, InvalidValueError

BOUNDS = Bounds(size=1 << 25, lines=400_000, fields=1_500_000)
"""Four minutes of wrenches at 1 kHz, or a grid of 1200 x 1200 heights: as text they take 200 MB and 2 s."""

MAX_LINE_BYTES = 1 << 16
"""Longest line of a stream. A wrench takes about a hundred bytes; a file without line ends must not fill the
memory."""

_MAX_COLUMNS = 10_000
"""More columns are another kind of file, or one whose line ends are missing."""

_MAX_SHOWN = 400
"""Most characters of the names of columns that a message repeats."""

Units = Mapping[str, float]
"""Known units of a quantity, in SI units."""

Quantities = Mapping[str, Units]
"""Known units of each quantity, by its name in lower case."""

FORCE_UNITS: Units = {"N": 1.0, "mN": 1e-3, "kN": 1e3}
MOMENT_UNITS: Units = {
    "Nm": 1.0, "N.m": 1.0, "N*m": 1.0, "mNm": 1e-3, "uNm": 1e-6, "Ncm": 1e-2, "Nmm": 1e-3, "kNm": 1e3
}  # fmt: skip
LENGTH_UNITS: Units = {"m": 1.0, "mm": 1e-3}
MASS_UNITS: Units = {"kg": 1.0, "g": 1e-3}
TIME_UNITS: Units = {"s": 1.0, "ms": 1e-3}
NO_UNITS: Units = {}

_FORCES: Quantities = dict.fromkeys(("fx", "fy", "fz"), FORCE_UNITS)
WRENCH: Quantities = {**_FORCES, **dict.fromkeys(("mx", "my", "mz"), MOMENT_UNITS)}
"""Columns of a wrench."""

WRENCH_EXAMPLE = "fx_N,fy_N,fz_N,mx_Nm,my_Nm,mz_Nm"
QUATERNION: Quantities = dict.fromkeys(("qw", "qx", "qy", "qz"), NO_UNITS)
"""Columns of a unit quaternion."""

QUATERNION_TOLERANCE = 1e-3
"""Largest deviation of a quaternion's length from 1: logs with four decimals pass, a rotation vector does not."""

UNIT_PATTERN = r"(?:[\s_\[(/]+(?P<unit>.*?)[\s\])]*)?"
"""End of a column's name: nothing, or a unit after _, /, a space or a bracket."""

_UNIT = re.compile(UNIT_PATTERN)
_CONTROL = re.compile(r"[\x00-\x08\x0a-\x1f\x7f]")
"""Characters that a line of a text file cannot hold; a tab is allowed."""


class ByteSource(Protocol):
    """A binary stream that gives its bytes as they arrive."""

    def read1(self, size: int = -1, /) -> bytes:
        """Return at least one byte and at most `size`; none at the end."""
        ...


@dataclass(frozen=True, slots=True)
class Columns:
    """The columns of a table.

    Attributes:
        table: Name of the table in messages.
        line: Number of the line that names the columns.
        names: Names of the columns; empty if the table has no such line.
        holds: Required content of each line, for messages.
    """

    table: str
    line: int
    names: tuple[str, ...]
    holds: str

    def find(self, quantities: Quantities) -> dict[str, tuple[int, float]]:
        """Return column and unit [SI] of each of these quantities that the table has.

        Args:
            quantities: Known units by the quantity's name in lower case; capitals in the table do not matter.

        Raises:
            InvalidValueError: If a quantity is there twice, or in an unknown unit.
        """
        found: dict[str, tuple[int, float]] = {}
        for place, column in enumerate(self.names):
            for quantity, units in quantities.items():
                unit = _unit_after(quantity, column)
                if unit is None:
                    continue
                if quantity in found:
                    raise self.wrong(f"{quantity} is there twice; keep one column for each")
                found[quantity] = place, self._factor(column, quantity, unit, units)
        return found

    def require(self, quantities: Quantities) -> tuple[list[int], FloatArray]:
        """Return columns and units [SI] of these quantities.

        Raises:
            InvalidValueError: If a quantity is missing, there twice, or in an unknown unit.
        """
        found = self.find(quantities)
        if missing := [quantity for quantity in quantities if quantity not in found]:
            raise self.lacking(*missing)
        return [found[each][0] for each in quantities], np.array([found[each][1] for each in quantities])

    def wrench(self) -> Quantities:
        """Return the quantities of a wrench by their names in this table: moments may be tx, ty, tz.

        Beside a moment called m, tx may be a translation.
        """
        if any(_unit_after(f"m{axis}", column) is not None for axis in "xyz" for column in self.names):
            return WRENCH
        torques: Quantities = dict.fromkeys(("tx", "ty", "tz"), MOMENT_UNITS)
        return {**_FORCES, **torques} if self.find(torques) else WRENCH

    def wrong(self, text: str) -> InvalidValueError:
        """Return the error that the names of the columns are wrong."""
        return InvalidValueError(f"{self.table}, line {self.line}: {text}")

    def lacking(self, *names: str, example: str = "") -> InvalidValueError:
        """Return the error that columns are missing.

        Args:
            *names: Names of the missing columns.
            example: Columns to give instead; by default those that each line must hold.
        """
        there = ", ".join(self.names[:40])[:_MAX_SHOWN]
        return self.wrong(f"no column {', '.join(names)}: there are {there}; give {example or self.holds}")

    def _factor(self, column: str, quantity: str, unit: str, units: Units) -> float:
        if len(column) == len(quantity):
            return 1.0
        spelled = unit.replace("µ", "u").replace("μ", "u").replace("·", ".").replace(" ", "").replace("_", "")
        if spelled not in units:
            given = f": unit {short(unit)} is not known" if unit else " names no unit"
            known = f"known for {quantity} are {', '.join(units)}" if units else f"{quantity} has none"
            raise self.wrong(f"column {short(column)}{given}; {known}")
        return units[spelled]

    def number(self, place: int, field: str, line: int) -> float:
        """Return a field as a number, which may be nan or inf.

        Raises:
            InvalidValueError: If the field is no number.
        """
        number = number_in(field)
        if number is None:
            raise InvalidValueError(
                f"{self.table}, line {line}: {self.label(place)} = {short(field.strip())}: must be a number; a "
                f"line holds {self.holds}"
            )
        return number

    def label(self, place: int) -> str:
        """Return the name of a column in messages."""
        return self.names[place] if self.names else f"column {place + 1}"


@dataclass(frozen=True, slots=True)
class CsvTable:
    """A table in memory.

    Attributes:
        columns: The columns.
        rows: Fields of each row, as they stand in the text.
        lines: Line of each row, counted from 1.
    """

    columns: Columns
    rows: Sequence[Sequence[str]]
    lines: Sequence[int]

    def numbers(self, *names: str) -> FloatArray:
        """Return columns as numbers, which may be nan or inf; shape (n, columns).

        Args:
            *names: Exact names of the columns; all columns if none is given.

        Raises:
            InvalidValueError: If a column is missing or there twice, or a field is no number.
        """
        there = self.columns.names
        if missing := [name for name in names if name not in there]:
            raise self.columns.lacking(missing[0])
        if twice := next((name for name in names if there.count(name) > 1), None):
            raise self.columns.wrong(f"{short(twice)} is there twice; keep one")
        return self._numbers([there.index(name) for name in names] or range(len(self.rows[0])))

    def finite(self, places: Sequence[int]) -> FloatArray:
        """Return columns as finite numbers, shape (n, places).

        Raises:
            InvalidValueError: If a field is no finite number.
        """
        found = self._numbers(places)
        for i, j in np.argwhere(~np.isfinite(found))[:1].tolist():
            field = self.rows[int(i)][places[int(j)]].strip()
            raise self.wrong(i, f"{self.columns.label(places[j])} = {short(field)}: must be finite")
        return found

    def in_si(self, quantities: Quantities) -> FloatArray:
        """Return quantities as finite numbers in SI units, shape (n, quantities).

        Raises:
            InvalidValueError: If a quantity is missing, there twice or in an unknown unit, or a field is no finite
                number.
        """
        places, factors = self.columns.require(quantities)
        return np.asarray(self.finite(places) * factors)

    def rotations(self) -> FloatArray:
        """Return the rotation matrices of the quaternions qw, qx, qy, qz, shape (n, 3, 3).

        Raises:
            InvalidValueError: If a column is missing, or a quaternion has not length 1.
        """
        from scipy.spatial.transform import Rotation  # imported here: not every table has rotations

        quaternions = self.in_si(QUATERNION)
        largest = np.abs(quaternions).max(axis=1)
        for i in np.flatnonzero(largest > 1.0 + QUATERNION_TOLERANCE)[:1].tolist():
            raise self.wrong(
                i, f"qw,qx,qy,qz: an entry of {largest[i]:.4g} is larger than 1, so this is no rotation"
            )
        length = np.linalg.norm(quaternions, axis=1)
        for i in np.flatnonzero(np.abs(length - 1.0) > QUATERNION_TOLERANCE)[:1].tolist():
            raise self.wrong(
                i, f"qw,qx,qy,qz has length {length[i]:.4g}: must be 1 (limit {QUATERNION_TOLERANCE:g})"
            )
        return np.asarray(Rotation.from_quat(quaternions[:, [1, 2, 3, 0]]).as_matrix())

    def wrong(self, row: int, text: str) -> InvalidValueError:
        """Return the error that a row is wrong."""
        return InvalidValueError(f"{self.columns.table}, line {self.lines[row]}: {text}")

    def _numbers(self, places: Sequence[int]) -> FloatArray:
        found = np.empty((len(self.rows), len(places)))
        for i, row in enumerate(self.rows):
            found[i] = [self.columns.number(place, row[place], self.lines[i]) for place in places]
        return found


class _LineParser:
    """Splits lines into fields; the first line that is no comment may name the columns."""

    def __init__(self, table: str, holds: str, *, named: bool, width: int | None = None) -> None:
        self._table, self._holds, self._named, self._width = table, holds, named, width
        self.columns: Columns | None = None

    def fields(self, number: int, line: str) -> list[str] | None:
        """Return the fields of a row; None for a comment and for the names of the columns."""
        line = line.removesuffix("\r")
        if not line.strip() or line.lstrip().startswith("#"):
            return None
        where = f"{self._table}, line {number}"
        fields = _csv_fields(line, where)
        self._width = self._width or len(fields)
        if len(fields) != self._width:
            raise InvalidValueError(
                f"{where}, {short(line)}: has {len(fields)} fields: must be {self._width}, {self._holds}"
            )
        if self.columns is not None:
            return fields
        are_numbers = [number_in(field) is not None for field in fields]
        if self._named and all(are_numbers):
            raise InvalidValueError(f"{where}: numbers where the header should be; put {self._holds} before them")
        if self._named and len(fields) == 1 and (separator := next((c for c in ";\t" if c in line), None)):
            raise InvalidValueError(f"{where}: columns must be separated by commas, not {separator!r}")
        header = self._named or not any(are_numbers)
        names = tuple(field.strip() for field in fields) if header else ()
        self.columns = Columns(self._table, number, names, self._holds)
        return None if header else fields


def read_csv_table(text: str, name: str, holds: str, *, width: int | None = None, named: bool = False) -> CsvTable:
    """Return the table of a text.

    Args:
        text: CSV text; a byte order mark is passed over.
        name: Name of the table in messages.
        holds: Required content of each line, for messages.
        width: Required number of fields of each line; if left out, that of the first line.
        named: Whether the first line must name the columns; otherwise it does so if it holds no number.

    Raises:
        InvalidValueError: If the text is no CSV, or has no row; the message names the line.
    """
    BOUNDS.check(name, text)
    parser = _LineParser(name, holds, named=named, width=width)
    rows: list[list[str]] = []
    lines: list[int] = []
    for number, line in enumerate(text.removeprefix("\ufeff").split("\n"), 1):
        fields = parser.fields(number, line)
        if fields is not None:
            rows.append(fields)
            lines.append(number)
    if parser.columns is None or not rows:
        raise InvalidValueError(f"{name}: no line with numbers; write {holds}, with commas between them")
    return CsvTable(parser.columns, rows, lines)


def read_csv_text(path: Path) -> str:
    """Return the text of a CSV file.

    Raises:
        InvalidValueError: If the file cannot be read, or is too large or no text.
    """
    try:
        return read_text(path, BOUNDS, "save it as UTF-8")
    except OSError as error:
        raise InvalidValueError(f"cannot read {path}: {error.strerror}") from None


def stream_csv(source: ByteSource, name: str, holds: str) -> Iterator[tuple[Columns, list[tuple[int, list[str]]]]]:
    """Yield rows in blocks, as many as have arrived; the first block has no rows.

    Args:
        source: Stream of CSV text with named columns.
        name: Name of the stream in messages.
        holds: Required content of each line, for messages.

    Yields:
        The columns, and line number and fields of each row.

    Raises:
        InvalidValueError: If the text is no CSV; the message names the line.
    """
    parser = _LineParser(name, holds, named=True)
    for lines in _line_blocks(source):
        rows = []
        for number, line in lines:
            begins = parser.columns is None
            fields = parser.fields(number, _decoded(line, name, number))
            if fields is not None:
                rows.append((number, fields))
            elif begins and parser.columns is not None:
                yield parser.columns, []
        if parser.columns is not None and rows:
            yield parser.columns, rows
    if parser.columns is None:
        raise InvalidValueError(f"{name} is empty: it must begin with a header line, {holds}")


def _line_blocks(source: ByteSource) -> Iterator[list[tuple[int, bytes]]]:
    """Yield numbers and bytes of the lines that have arrived."""
    rest, first = b"", 1
    while chunk := source.read1(MAX_LINE_BYTES):
        *lines, rest = (rest + chunk).split(b"\n")
        if len(rest) > MAX_LINE_BYTES:
            lines.append(rest)  # refused as too long
        yield list(enumerate(lines, first))
        first += len(lines)
    if rest:
        yield [(first, rest)]


def _decoded(line: bytes, name: str, number: int) -> str:
    if len(line) > MAX_LINE_BYTES:
        raise InvalidValueError(f"{name}, line {number}: longer than {MAX_LINE_BYTES} bytes; this is not CSV text")
    if number == 1 and line.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise InvalidValueError(f"{name}, line 1: UTF-16 text; save it as UTF-8")
    try:
        return line.decode("utf-8-sig" if number == 1 else "utf-8")
    except UnicodeDecodeError:
        raise InvalidValueError(f"{name}, line {number}: not UTF-8 text") from None


def _csv_fields(line: str, where: str) -> list[str]:
    if control := _CONTROL.search(line):
        raise InvalidValueError(f"{where}: holds the control character {control.group()!r}; this is not CSV text")
    if line.count(",") >= _MAX_COLUMNS:
        raise InvalidValueError(f"{where}: more than {_MAX_COLUMNS} columns; are line ends missing?")
    if '"' not in line:  # much quicker
        return line.split(",")
    try:
        return next(csv.reader([line.lstrip()], strict=True, skipinitialspace=True))
    except csv.Error as error:
        raise InvalidValueError(f"{where}: {error}; a quoted field must be closed on its line") from None


def _unit_after(quantity: str, column: str) -> str | None:
    """Return the unit in a column's name, "" without one; None if the column holds another quantity."""
    if column[: len(quantity)].lower() != quantity:
        return None
    match = _UNIT.fullmatch(column[len(quantity) :])
    return None if match is None else match["unit"] or ""


def number_in(field: str) -> float | None:
    """Return the number in a field, nan and inf included; None for other text, and for forms of Python (1_000)."""
    try:
        number = float(field)
    except ValueError:
        return None
    return number if field.strip().isascii() and "_" not in field else None


def short(text: str) -> str:
    """Return a text as messages show it."""
    return repr(text if len(text) <= 40 else text[:37] + "...")
