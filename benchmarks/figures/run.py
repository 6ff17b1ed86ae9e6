"""What `python benchmarks/figures` does: measure, keep, and write the tables."""

import argparse
import os
import platform
from datetime import date

from rich.console import Console
from rich.progress import track
from rich.table import Table

from figures import pages
from figures.figure import FILE, Figure, Measured, by_name, read, write_history
from figures.measure import TOPICS
from palpate.version import __version__

DESCRIPTION = """\
Measured are contact sensing, explorations, how fast runs are simulated, and the paced control period: five minutes
on an idle computer. Topics that are left out keep what was measured last. Written are benchmarks/figures.csv, the
row of this version in benchmarks/history.csv, and every table between `<!-- figures: ... -->` marks.
"""


def machine() -> str:
    """Return what kind of machine this is, in the words of a caption."""
    return f"{os.cpu_count()} {platform.machine()} cores, {platform.system()}, CPython {platform.python_version()}"


def main() -> None:
    """Read the command line, measure, and write."""
    topics = {topic.__name__: topic for topic in TOPICS}
    parser = argparse.ArgumentParser(
        prog="python benchmarks/figures",
        description=DESCRIPTION,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("topics", nargs="*", metavar="TOPIC", help=f"{', '.join(topics)}; left out: all")
    parser.add_argument("--only-write", action="store_true", help="measure nothing, write the tables anew")
    asked = parser.parse_args()
    if unknown := set(asked.topics) - set(topics):
        parser.error(f"{', '.join(sorted(unknown))}: no such topic; there are {', '.join(topics)}")
    measured = read() if FILE.exists() else Measured("", "", "", {})
    if not asked.only_write:
        console, found = Console(width=115), list[Figure]()
        for name in track(asked.topics or topics, "measuring", console=console, transient=True):
            found += topics[name]()
            figures = measured.figures | by_name(found)
            Measured(date.today().isoformat(), machine(), __version__, figures).write()
        write_history(read())
        table = Table("figure", "got", "asked", "", title=f"{date.today().isoformat()}, {machine()}")
        for figure in found:
            table.add_row(figure.means, pages.shown(figure), figure.asked, figure.unit)
        console.print(table)
    pages.write(read())
