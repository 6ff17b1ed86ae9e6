"""Command line of every benchmark: parts, effort, seed, and where the results go."""

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from rich.console import Console

from harness.page import save_picture
from harness.study import Effort, Measure, Study
from harness.tables import checks_table, study_table, write_csv

WIDTH = 165
"""Characters of the tables."""


def parser_of(description: str | None) -> argparse.ArgumentParser:
    """Return a parser that prints the description as it stands."""
    return argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)


def add_parts(parser: argparse.ArgumentParser, parts: Mapping[str, object]) -> None:
    """Add the choice of parts, the effort and the seed."""
    names = ", ".join(parts)
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"{names}; without any: all of them")
    parser.add_argument("--quick", action="store_true", help="fewer inputs and rounds, less certain")
    parser.add_argument(
        "--seed", type=int, default=0, help="seed of cases and noise: the same seed, the same errors"
    )


def chosen(parser: argparse.ArgumentParser, names: Sequence[str], parts: Mapping[str, Any]) -> list[str]:
    """Return the chosen parts; an unknown name ends the program with a message."""
    if unknown := set(names) - set(parts):
        parser.error(f"{', '.join(sorted(unknown))}: no such part; there are {', '.join(parts)}")
    return list(dict.fromkeys(names)) or list(parts)


def measured(
    names: Sequence[str], parts: Mapping[str, Measure], effort: Effort, keep: Callable[[list[Study]], None]
) -> list[Study]:
    """Measure and show parts by name; `keep` is called with the finished studies after each."""
    console, done = Console(width=WIDTH), list[Study]()
    for name in names:
        with Console(stderr=True).status(name) as status:
            done.append(parts[name](Effort(effort.quick, effort.seed, status.update)))
        keep(done)
        show(done[-1], console)
    return done


def show(study: Study, console: Console) -> None:
    """Print the tables of a study."""
    if study.rows:
        console.print(study_table(study))
    for table in study.tables:
        console.print(table)
    if study.about:
        console.print(study.about, highlight=False)
    if study.checks:
        console.print(checks_table(study.checks))


def all_kept(studies: Sequence[Study]) -> bool:
    """Return whether every figure that was asked for is met."""
    return all(check.kept is not False for study in studies for check in study.checks)


def run(
    description: str | None,
    parts: Mapping[str, Measure],
    arguments: Sequence[str] | None = None,
    *,
    picture: Callable[[Path], None] | None = None,
) -> int:
    """Read the command line, measure, show and write; return 1 if a figure that was asked for is missed.

    `picture` draws a picture of its own instead of speed against error.
    """
    parser = parser_of(description)
    add_parts(parser, parts)
    parser.add_argument("--picture", type=Path, help="draw the picture (PNG, PDF or SVG)")
    parser.add_argument("--csv", type=Path, help="write all rows, in SI units")
    given = parser.parse_args(arguments)
    names = chosen(parser, given.parts, parts)
    studies = measured(names, parts, Effort(given.quick, given.seed), lambda _: None)
    if given.csv:
        write_csv(studies, given.csv)
    if given.picture:
        given.picture.parent.mkdir(parents=True, exist_ok=True)
        (picture or partial(save_picture, studies))(given.picture)
        print(f"Figure: {given.picture}")
    return 0 if all_kept(studies) else 1


def start(description: str | None, parts: Mapping[str, Measure]) -> None:
    """Run as a script."""
    sys.exit(run(description, parts))
