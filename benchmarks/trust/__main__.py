"""Whether intervals hold the truth, or the verdict warns: for every estimator, over seeds and broken assumptions.

    python benchmarks/trust                              # everything: about an hour
    python benchmarks/trust payload maps --seeds 20      # some estimators
    python benchmarks/trust payload --only "scan"        # cases whose name has this
    python benchmarks/trust --write                      # the table and the picture of docs/trust.md, too

A result is honest if its verdict is OK and every value lies within 4 printed standard deviations of the truth,
reported if its verdict is not OK or the data are refused, silently wrong otherwise. Ends with 1 if more than 1 %
of the runs of a row are silently wrong, or if a coverage lies outside of 93 to 98 % where all assumptions hold.
"""

import argparse
import csv
import sys
from pathlib import Path

if __name__ == "__main__":
    sys.path[0] = str(Path(__file__).resolve().parents[1])

from rich.console import Console
from rich.progress import Progress
from rich.table import Table
from trust.studies import STUDIES
from trust.study import Row

MEASURED = Path(__file__).parent / "measured.csv"
HEADINGS = ("estimator", "data", "assumptions", "runs", "honest", "reported", "silently wrong", "coverage at 95 %",
            "what the verdict says")  # fmt: skip


def main() -> int:
    """Measure and print; return 1 if a figure is missed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("studies", nargs="*", choices=[[], *STUDIES], metavar="STUDY", help=", ".join(STUDIES))
    parser.add_argument("--seeds", type=int, default=200, help="of every case (default 200)")
    parser.add_argument("--only", default="", help="part of a case's name")
    parser.add_argument(
        "--write", action="store_true", help=f"keep the rows in {MEASURED.name}, which docs/trust.md shows"
    )
    asked = parser.parse_args()
    chosen = [
        (study, case)
        for name in asked.studies or STUDIES
        for study in [STUDIES[name]]
        for case in study.cases
        if asked.only in case.name
    ]
    rows = []
    with Progress() as progress:
        for study, case in progress.track(chosen, description="cases"):
            rows.append(study.row(case, asked.seeds))
            for miss in rows[-1].misses:
                progress.console.print(f"MISSED: {miss}", style="red")
    table = Table(*HEADINGS)
    for row in rows:
        table.add_row(*cells(row))
    Console(width=160).print(table)
    if asked.write:
        keep(rows)
    return int(any(miss for row in rows for miss in row.misses))


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


if __name__ == "__main__":
    sys.exit(main())
