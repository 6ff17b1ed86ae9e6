"""Speed against error on this computer: one study per topic, all in one report with pictures.

    python benchmarks/bench.py [STUDY ...] [--quick] [--seed N] [--out FOLDER]

contact: a contact from a wrench, by palpate, plain formulas and a solver, against contacts built to be known.
mapping: a sphere from contacts on a cap. friction: ways to rub a surface. control: a force held on a surface that
moves, the faster the harder. simulation: its time step. grasp: least forces of a grasp.

Methods take turns, so that whatever else this computer does hits all of them: trust the ratios. bench.html is
written anew after each study: Ctrl-C keeps those that are finished. All of them take ten minutes, or two with
--quick.
"""

import argparse
import shlex
import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

from rich.console import Console
from rich.table import Table
from rich.text import Text

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests"))  # grasps are the tests' own
from studies.report import quantity, speed_error_report
from studies.study import Measure, Study

from palpate.reporting.page import write_report

STUDIES = ("contact", "mapping", "friction", "control", "simulation", "grasp")


def measured(names: Sequence[str], quick: bool, seed: int, out: Path, asked: str) -> list[Study]:
    """Carry out studies by name; print a table of each, and write the report anew after each."""
    console = Console()
    out.mkdir(parents=True, exist_ok=True)
    done: list[Study] = []
    for name in dict.fromkeys(names):
        measure: Measure = import_module(f"studies.{name}").measure
        with console.status(name) as status:
            done.append(measure(quick, seed, status.update))
        write_report(speed_error_report(done, asked), out / "bench.html")
        console.print(table(done[-1]))
    return done


def table(study: Study) -> Table:
    shown = Table(title=Text(study.title), caption=Text(f"error {study.error}"))
    for heading in ("method", study.cost, "error", "largest", ""):
        shown.add_column(heading, justify="left" if heading in ("method", "") else "right")
    for row in study.rows:
        shown.add_row(
            Text(row.method),
            quantity(row.cost, study.cost_unit),
            quantity(row.typical, study.error_unit),
            quantity(row.worst, study.error_unit),
            Text(row.note),
        )
    return shown


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("studies", nargs="*", metavar="STUDY", help=f"{', '.join(STUDIES)}; left out: all of them")
    parser.add_argument("--quick", action="store_true", help="fewer cases and repeats, less sure")
    parser.add_argument("--seed", type=int, default=0, help="of cases and noise: the same seed, the same errors")
    parser.add_argument("--out", type=Path, default=Path("runs/bench"), help="folder for bench.html (runs/bench)")
    asked = parser.parse_args()
    if unknown := set(asked.studies) - set(STUDIES):
        parser.error(f"{', '.join(sorted(unknown))}: no such study; there are {', '.join(STUDIES)}")
    typed = shlex.join(["python", "benchmarks/bench.py", *sys.argv[1:]])
    measured(asked.studies or STUDIES, asked.quick, asked.seed, asked.out, typed)
    print(f"Written: {asked.out / 'bench.html'}")


if __name__ == "__main__":
    main()
