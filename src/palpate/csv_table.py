"""Tables of numbers in CSV text: names of columns if there are any, every mistake named with its line."""

import csv
import re
from dataclasses import dataclass

import numpy as np

from palpate.bounded_file import Bounds
from palpate.errors import FloatArray, InvalidValueError

BOUNDS = Bounds(size=1 << 25, lines=400_000, fields=1_500_000)
"""Four minutes of wrenches at 1 kHz, or a grid of 1200 x 1200 heights: as text they take 200 MB and 2 s."""

MOST_COLUMNS = 10_000
"""Of a line: more is another file, or one whose line ends are missing."""

LONGEST_SHOWN = 400
"""Characters of the names of columns that a message repeats."""

_CONTROL = re.compile(r"[\x00-\x08\x0a-\x1f\x7f]")
"""Characters that no text file holds within a line; a tab is one that does."""


@dataclass(frozen=True, slots=True)
class NumberTable:
    """Lines of fields, which `numbers` reads.

    Attributes:
        name: What messages call it.
        columns: Their names; none if the text has no header.
        rows: Fields of each line but that of the names, without spaces around them.
        lines: Where in the text each row stands, from 1 on.
        holds: What a line must hold, for messages.
    """

    name: str
    columns: tuple[str, ...]
    rows: list[list[str]]
    lines: list[int]
    holds: str

    def numbers(self, *columns: str) -> FloatArray:
        """Return columns as numbers, shape (n, columns); all of them if none is named. They may be nan or inf.

        Raises:
            InvalidValueError: There is no such column, or a field is no number.
        """
        if missing := [column for column in columns if column not in self.columns]:
            there = ", ".join(self.columns[:40])[:LONGEST_SHOWN]
            raise InvalidValueError(f"{self.name}: no column {missing[0]}: there are {there}; give {self.holds}")
        places = [self.columns.index(column) for column in columns] or range(len(self.rows[0]))
        found = np.empty((len(self.rows), len(places)))
        for i, row in enumerate(self.rows):
            numbers = [number_in(row[place]) for place in places]
            if None in numbers:
                wrong = f"line {self.lines[i]}: {short(row[places[numbers.index(None)]])}"
                raise InvalidValueError(f"{self.name}, {wrong} is no number: must hold {self.holds}")
            found[i] = numbers
        return found


def read_csv_table(text: str, name: str, holds: str, width: int | None = None) -> NumberTable:
    """Return the table of a text: lines of fields with commas between them; # begins a comment.

    The first line has the names of the columns, unless there is a number in it.

    Args:
        text: Of it; a byte order mark is passed over.
        name: What messages call it.
        holds: What a line must hold, for messages.
        width: How many fields each line must have; if left out, as many as the first.

    Raises:
        InvalidValueError: It is no such text, or holds no line besides names; the message names the line.
    """
    BOUNDS.check(name, text)
    rows: list[list[str]] = []
    lines: list[int] = []
    for i, line in enumerate(text.removeprefix("\ufeff").split("\n"), 1):
        if not is_comment(line):
            rows.append([field.strip() for field in csv_fields(line.removesuffix("\r"), f"{name}, line {i}")])
            lines.append(i)
            width = width or len(rows[0])
            if len(rows[-1]) != width:
                raise InvalidValueError(
                    f"{name}, line {i}, {short(line)}: has {len(rows[-1])} fields: must be {width}, {holds}"
                )
    names = int(bool(rows) and all(number_in(field) is None for field in rows[0]))
    if len(rows) == names:
        raise InvalidValueError(f"{name}: no line with numbers; write {holds}, with commas between them")
    return NumberTable(name, tuple(rows[0]) if names else (), rows[names:], lines[names:], holds)


def is_comment(line: str) -> bool:
    """Return whether a line is blank or begins with #."""
    return line.lstrip().startswith("#") or not line.strip()


def number_in(field: str) -> float | None:
    """Return the number that a field is, be it nan or inf; None if it is none, or one to Python alone (1_000)."""
    try:
        number = float(field)
    except ValueError:
        return None
    return number if field.isascii() and "_" not in field else None


def csv_fields(line: str, where: str) -> list[str]:
    """Return the fields of a line as they stand.

    Args:
        line: Without its end.
        where: File and line, for messages.

    Raises:
        InvalidValueError: It is no line of CSV.
    """
    if control := _CONTROL.search(line):
        raise InvalidValueError(f"{where}: holds the control character {control.group()!r}; this is not CSV text")
    if line.count(",") >= MOST_COLUMNS:
        raise InvalidValueError(f"{where}: more than {MOST_COLUMNS} columns; are line ends missing?")
    if '"' not in line:  # much quicker
        return line.split(",")
    try:
        return next(csv.reader([line.lstrip()], strict=True, skipinitialspace=True))
    except csv.Error as error:
        raise InvalidValueError(f"{where}: {error}; a quoted field must be closed on its line") from None


def short(text: str) -> str:
    """Return a text as messages show it."""
    return repr(text if len(text) <= 40 else text[:37] + "...")
