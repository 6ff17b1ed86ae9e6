"""Campaigns: parts with options of their own, each of which yields listings of text; one command line for all."""

import argparse
import csv
import os
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from rich.console import Console
from rich.markup import escape
from rich.progress import track
from rich.table import Table

from harness.command import chosen, parser_of

WIDTH = 200
"""Characters of the tables."""


@dataclass(frozen=True, slots=True)
class Listing:
    """A table of text.

    Attributes:
        title: Heading of the table.
        heads: Headings of the columns.
        rows: Cells of each row.
        met: Whether every figure that was asked for is met.
        notes: Sentences below the table.
        page: File whose lines between the marks of `title` are replaced by the table, if `--write` is given.
    """

    title: str
    heads: Sequence[str]
    rows: Sequence[Sequence[object]]
    met: bool = True
    notes: Sequence[str] = ()
    page: Path | None = None

    def printed(self) -> Table:
        """Return the table for a terminal."""
        table = Table(*map(escape, self.heads), title=escape(self.title))
        for row in self.rows:
            table.add_row(*(escape(str(each)) for each in row))
        return table

    def markdown(self) -> str:
        """Return the table in Markdown."""
        lines = (self.heads, ["---"] * len(self.heads), *self.rows)
        return "\n".join(f"| {' | '.join(map(str, each))} |" for each in lines)


Item = TypeVar("Item")
Part = Callable[[argparse.Namespace], Iterable[Listing]]


def run(
    description: str | None,
    parts: Mapping[str, Part],
    add_options: Callable[[argparse.ArgumentParser], None],
    arguments: Sequence[str] | None = None,
    default: Sequence[str] = (),
) -> int:
    """Read the command line, run the parts and show their listings; return 1 if a figure is missed.

    Args:
        description: Text of `--help`.
        parts: Parts by name.
        add_options: Adds the options of the family.
        arguments: Words of the command line; those of the process if left out.
        default: Parts that run if none is named; all if empty.
    """
    parser = parser_of(description)
    parser.add_argument("parts", nargs="*", metavar="PART", help=", ".join(parts))
    parser.add_argument("--csv", type=Path, help="write all rows")
    parser.add_argument("--write", action="store_true", help="write the tables into the pages of the documents")
    add_options(parser)
    options = parser.parse_args(arguments)
    found = list[Listing]()
    console = Console(width=WIDTH)
    for name in chosen(parser, options.parts or default, parts):
        for listing in parts[name](options):
            found.append(listing)
            console.print(listing.printed())
            for note in listing.notes:
                console.print(note, highlight=False, markup=False)
            if options.write and listing.page is not None:
                replace_in_page(listing.page, listing.title, listing.markdown())
    if options.csv is not None:
        with options.csv.open("w", newline="", encoding="utf-8") as file:
            table = csv.writer(file, lineterminator="\n")
            for listing in found:
                table.writerow(("table", *listing.heads))
                table.writerows((listing.title, *row) for row in listing.rows)
    return int(not all(listing.met for listing in found))


def replace_in_page(path: Path, name: str, text: str) -> None:
    """Replace the lines between the marks of this name."""
    begins, ends = f"<!-- {name} begins -->\n", f"<!-- {name} ends -->\n"
    before, rest = path.read_text("utf-8").split(begins)
    _, after = rest.split(ends)
    path.write_text(f"{before}{begins}\n{text}\n\n{ends}{after}", "utf-8")


def tracked(items: Iterable[Item], total: int, name: str) -> Iterable[Item]:
    """Return items with a progress bar on standard error."""
    return track(items, name, total, console=Console(stderr=True), transient=True)


def load() -> str:
    """Return the load of this computer, in words."""
    return f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"


def raise_priority() -> None:
    """Run before other programs, if the user may: an emulator keeps its time like a real device."""
    with suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, 0, -20)


def start(
    description: str | None,
    parts: Mapping[str, Part],
    add_options: Callable[[argparse.ArgumentParser], None],
    default: Sequence[str] = (),
) -> None:
    """Run as a script."""
    sys.exit(run(description, parts, add_options, default=default))
