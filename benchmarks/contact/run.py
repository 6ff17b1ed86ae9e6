"""What `python benchmarks/contact` does: measure, print the table, draw the picture."""

import argparse
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from contact.categories import CATEGORIES, Category, Errors, errors, known_cases
from contact.methods import METHODS, Method
from contact.picture import draw, save
from contact.speed import Speeds, measure
from contact.table import WIDTH, explanation, speed_error_table

DESCRIPTION = """\
Speed of contact sensing against its error: many methods, many kinds of hard contact, one table, one picture.
Errors are measured against a reference in 180 digits, times against a plain copy of the answer. About one minute;
--quick takes a tenth of the cases and a third of the batch.
"""
PICTURE = Path(__file__).resolve().parents[2] / "runs" / "contact_speed_error.png"


@dataclass(frozen=True, slots=True)
class Effort:
    """How much is measured.

    Attributes:
        contacts: In the batch.
        rounds: Of timing.
        cases: Per category of hardness.
    """

    contacts: int
    rounds: int
    cases: int


FULL = Effort(contacts=1_000_000, rounds=15, cases=600)
QUICK = Effort(contacts=300_000, rounds=15, cases=60)
"""The batch must stay so large that its answer, 36 MB, is fresh memory at every call: the C library keeps blocks
of up to 32 MB for the next one."""

Findings = dict[str, dict[str, Errors]]
"""Errors by method name, then by category name."""


def main() -> None:
    """Read the command line, measure and show."""
    parser = argparse.ArgumentParser(
        prog="python benchmarks/contact",
        description=DESCRIPTION,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--quick", action="store_true", help="fewer contacts and cases")
    parser.add_argument("--picture", type=Path, default=PICTURE, help="where to write it (default: %(default)s)")
    arguments = parser.parse_args()
    effort = QUICK if arguments.quick else FULL
    found, speeds = measure_all(METHODS, CATEGORIES, effort)
    console = Console(width=WIDTH)
    console.print(speed_error_table(METHODS, found, speeds, CATEGORIES))
    console.print(explanation(CATEGORIES, effort.contacts, effort.rounds, effort.cases), highlight=False)
    heading = (
        f"Contact sensing: time against error. {effort.cases} contacts in each category, "
        f"batch of {effort.contacts:.0e}, one thread"
    )
    save(draw(METHODS, found, speeds, CATEGORIES, heading), arguments.picture)
    console.print(f"Picture: {arguments.picture}", highlight=False, soft_wrap=True)


def measure_all(
    methods: tuple[Method, ...], categories: tuple[Category, ...], effort: Effort
) -> tuple[Findings, Speeds]:
    """Measure errors and times of all methods, with a progress bar."""
    found: Findings = {method.name: {} for method in methods}
    with Progress(transient=True) as progress:
        errors_task = progress.add_task("errors", total=len(categories) * (len(methods) + 1))
        speed_task = progress.add_task("times", total=effort.rounds)
        for category in categories:
            known = list(known_cases(category, effort.cases))
            progress.advance(errors_task)
            for method in methods:
                found[method.name][category.name] = errors(method, known)
                progress.advance(errors_task)
        speeds = measure(methods, effort.contacts, effort.rounds, lambda: progress.advance(speed_task))
    return found, speeds
