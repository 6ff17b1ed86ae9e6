"""Wrenches in CSV text: columns by name, units as declared, every mistake named with its line."""

import math
import re
from collections import Counter
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import Literal, Protocol

from palpate.csv_table import csv_fields, is_comment, number_in, short
from palpate.errors import InvalidValueError

COMPONENTS = ("fx", "fy", "fz", "mx", "my", "mz")

FORCE_UNITS = {"N": 1.0, "mN": 1e-3, "kN": 1e3}
"""Understood units of force, in N."""

MOMENT_UNITS = {"Nm": 1.0, "N.m": 1.0, "N*m": 1.0, "mNm": 1e-3, "uNm": 1e-6, "Ncm": 1e-2, "Nmm": 1e-3, "kNm": 1e3}
"""Understood units of moment, in N m."""

LONGEST_LINE = 1 << 16
"""Bytes. A wrench takes about a hundred; a file without line ends must not fill the memory."""

_COLUMN = re.compile(r"(?P<component>[fmt][xyz])(?:[\s_\[(/]+(?P<unit>.*?)[\s\])]*)?", re.IGNORECASE)
"""A component alone, or followed by _, /, a space or a bracket and then its unit; t for torque is another m."""


@dataclass(frozen=True, slots=True)
class Header:
    """The parsed header line.

    Attributes:
        width: Number of columns.
        places: Column of each of `COMPONENTS`.
        factors: Unit of each of `COMPONENTS` in N or N m.
        others: Columns to copy.
        names: Their names.
    """

    width: int
    places: tuple[int, ...]
    factors: tuple[float, ...]
    others: tuple[int, ...]
    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class WrenchRow:
    """One row.

    Attributes:
        wrench: (f, m) in N and N m; not finite only where that was allowed.
        copied: Text of the columns to copy.
    """

    wrench: tuple[float, ...]
    copied: tuple[str, ...]


class ByteSource(Protocol):
    """A binary stream that gives what has arrived, at most so many bytes, and nothing at its end."""

    def read1(self, size: int = -1, /) -> bytes:
        """Return at least one byte, or none at the end."""
        ...


class WrenchReader:
    """Reads a stream of CSV text in blocks: as much as has arrived, so that a live source is served at once."""

    def __init__(
        self,
        source: ByteSource,
        name: str,
        not_finite: Literal["refuse", "mark"] = "refuse",
        taken: Collection[str] = (),
    ) -> None:
        """Take a stream.

        Args:
            source: Where the bytes come from.
            name: What messages call it.
            not_finite: Whether rows with nan or inf are a mistake or pass.
            taken: Names that no column to copy may have, since the output uses them.
        """
        self._taken = frozenset(taken)
        self._source = source
        self._name = name
        self._not_finite_passes = not_finite == "mark"
        self._lines = 0
        self._header: Header | None = None

    def blocks(self) -> Iterator[tuple[Header, list[WrenchRow]]]:
        """Yield the header with no rows once it is known, then rows in blocks.

        Raises:
            InvalidValueError: The text is not what it should be; the message names the line.
        """
        for lines in self._line_blocks():
            rows = []
            for line in lines:
                self._lines += 1
                text = self._text(line)
                if is_comment(text):
                    continue
                if self._header is None:
                    self._header = self._read_header(text)
                    yield self._header, []
                else:
                    rows.append(self._read_row(self._header, text))
            if self._header is not None and rows:
                yield self._header, rows
        if self._header is None:
            raise InvalidValueError(f"{self._name} is empty: it must begin with a header line, {_EXAMPLE}")

    def _line_blocks(self) -> Iterator[list[bytes]]:
        rest = b""
        while chunk := self._source.read1(LONGEST_LINE):
            *lines, rest = (rest + chunk).split(b"\n")
            if lines:
                yield lines
            if len(rest) > LONGEST_LINE:
                self._lines += 1
                raise self._wrong(f"longer than {LONGEST_LINE} bytes; this is not CSV text")
        if rest:
            yield [rest]

    def _text(self, line: bytes) -> str:
        if self._lines == 1:
            if line.startswith((b"\xff\xfe", b"\xfe\xff")):
                raise self._wrong("UTF-16 text; save it as UTF-8")
            line = line.removeprefix(b"\xef\xbb\xbf")
        try:
            text = line.removesuffix(b"\r").decode("utf-8")
        except UnicodeDecodeError:
            raise self._wrong("not UTF-8 text") from None
        if len(line) > LONGEST_LINE:
            raise self._wrong(f"longer than {LONGEST_LINE} bytes; this is not CSV text")
        return text

    def _read_header(self, text: str) -> Header:
        columns = [field.strip() for field in csv_fields(text, self._where)]
        if all(number_in(column) is not None for column in columns):
            raise self._wrong(f"numbers where the header should be; put {_EXAMPLE} before them")
        if len(columns) == 1 and (separator := next((c for c in ";\t" if c in text), None)):
            raise self._wrong(f"columns must be separated by commas, not {separator!r}")
        matches = [_COLUMN.fullmatch(column) for column in columns]
        # next to moments, tx may be a translation
        own = "fm" if any(match and match["component"][0] in "mM" for match in matches) else "ft"
        found: dict[str, tuple[int, float]] = {}
        others: list[int] = []
        for i, (column, match) in enumerate(zip(columns, matches, strict=True)):
            if match is None or match["component"][0].lower() not in own:
                # loggers like to end each line with a comma: a column without a name is dropped
                others += [i] if column else []
                continue
            component = match["component"].lower().replace("t", "m")
            if component in found:
                raise self._wrong(f"{component} is there twice; keep one column for each component")
            found[component] = (i, self._factor(column, component, match["unit"]))
        if missing := [component for component in COMPONENTS if component not in found]:
            raise self._wrong(f"no column {', '.join(missing)}; the header must hold {_EXAMPLE}")
        names = tuple(columns[i] for i in others)
        if twice := next((name for name, count in Counter(names).items() if count > 1), None):
            raise self._wrong(f"two columns are called {short(twice)}; rename one")
        if clash := next((name for name in names if name in self._taken), None):
            raise self._wrong(f"column {short(clash)} has the name of an output column; rename it")
        places, factors = zip(*(found[component] for component in COMPONENTS), strict=True)
        return Header(len(columns), places, factors, tuple(others), names)

    def _factor(self, column: str, component: str, unit: str | None) -> float:
        units = FORCE_UNITS if component[0] == "f" else MOMENT_UNITS
        if not unit:
            if len(column) == len(component):
                return 1.0
            raise self._wrong(f"column {short(column)} names no unit; known are {', '.join(units)}")
        spelled = unit.replace("µ", "u").replace("μ", "u").replace("·", ".").replace(" ", "").replace("_", "")
        if spelled not in units:
            raise self._wrong(
                f"column {short(column)}: unit {short(unit)} is not known; known for {component} are "
                f"{', '.join(units)}"
            )
        return units[spelled]

    def _read_row(self, header: Header, text: str) -> WrenchRow:
        fields = csv_fields(text, self._where)
        if len(fields) != header.width:
            raise self._wrong(f"{len(fields)} fields, but the header has {header.width} columns")
        wrench = []
        for component, place, factor in zip(COMPONENTS, header.places, header.factors, strict=True):
            field = fields[place].strip()
            number = number_in(field)
            if number is None:
                raise self._wrong(f"{component} = {short(field)}: must be a number")
            value = number * factor
            if not (self._not_finite_passes or math.isfinite(value)):
                raise self._wrong(
                    f"{component} = {short(field)}: must be finite; --not-finite mark lets such rows be INVALID"
                )
            wrench.append(value)
        return WrenchRow(tuple(wrench), tuple(fields[i] for i in header.others))

    def _wrong(self, what: str) -> InvalidValueError:
        return InvalidValueError(f"{self._where}: {what}")

    @property
    def _where(self) -> str:
        return f"{self._name}, line {self._lines}"


_EXAMPLE = "for example fx_N,fy_N,fz_N,mx_Nm,my_Nm,mz_Nm"
