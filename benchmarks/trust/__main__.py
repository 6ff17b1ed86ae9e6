"""Whether intervals hold the truth, or the verdict warns: for every estimator, over seeds and broken assumptions.

    python benchmarks/trust                              # everything: about an hour
    python benchmarks/trust payload map --seeds 20       # some estimators
    python benchmarks/trust payload --only "scan"        # cases whose name has this
    python benchmarks/trust --write                      # the table and the picture of docs/trust.md, too

A result is honest if its verdict is OK and every value lies within 4 printed standard deviations of the truth,
reported if its verdict is not OK or the data are refused, silently wrong otherwise. Ends with 1 if more than 1 %
of the runs of a row are silently wrong, or if a coverage lies outside of 93 to 98 % where all assumptions hold.
"""

import csv
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Iterator
from functools import partial
from pathlib import Path

if __name__ == "__main__":
    sys.path[0] = str(Path(__file__).resolve().parents[1])

from harness.campaign import Listing, start, tracked
from trust.studies import STUDIES
from trust.study import Row, Study

MEASURED = Path(__file__).parent / "measured.csv"
HEADINGS = ("estimator", "data", "assumptions", "runs", "honest", "reported", "silently wrong", "coverage at 95 %",
            "what the verdict says")  # fmt: skip


def measure(study: Study, options: Namespace) -> Iterator[Listing]:
    """Run the chosen cases of an estimator."""
    cases = [case for case in study.cases if options.only in case.name]
    rows = [study.row(case, options.seeds) for case in tracked(cases, len(cases), study.name)]
    missed = tuple(f"MISSED: {miss}" for row in rows for miss in row.misses)
    if options.write:
        keep(rows)
    yield Listing(study.name, HEADINGS, [cells(row) for row in rows], not missed, missed)


def keep(rows: list[Row]) -> None:
    """Write rows over those that were kept of the same data."""
    known: dict[tuple[str, ...], tuple[str, ...]] = {}
    if MEASURED.exists():
        with MEASURED.open(newline="") as file:
            known = {tuple(line[:2]): tuple(line) for line in list(csv.reader(file))[1:]}
    known |= {(row.study, row.case): cells(row) for row in rows}
    with MEASURED.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(HEADINGS)
        wanted = [(study.name, case.name) for study in STUDIES.values() for case in study.cases]
        writer.writerows(known[each] for each in wanted if each in known)


def cells(row: Row) -> tuple[str, ...]:
    """Return a row as text."""
    return (
        row.study,
        row.case,
        "hold" if row.holds else "broken" if row.shown else "broken, unseen",
        str(row.runs),
        *(f"{100 * share:.1f} %" for share in (row.honest, row.reported, row.silent)),
        ", ".join(f"{name} {100 * share:.1f} %" for name, share in row.coverage.items()),
        row.finding,
    )


def add_options(parser: ArgumentParser) -> None:
    """Add the number of seeds and the choice of cases."""
    parser.add_argument("--seeds", type=int, default=200, help="of every case (%(default)s)")
    parser.add_argument("--only", default="", help="part of a case's name")


if __name__ == "__main__":
    start(__doc__, {name: partial(measure, study) for name, study in STUDIES.items()}, add_options)
