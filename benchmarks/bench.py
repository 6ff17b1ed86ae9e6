"""Speed against error on this computer: one part per topic, all in one report with pictures.

    python benchmarks/bench.py [PART ...] [--quick] [--seed N] [--out FOLDER]

Each part is that of the topic's own benchmark: contact (contact.py), mapping (surface_maps.py sphere), friction
(friction.py ways), control (control.py moving), simulation (simulation step) and grasp (grasp.py).

Methods take turns, so that other load on this computer hits all of them: trust the ratios. bench.html is rewritten
after each part: Ctrl-C keeps those that are finished. All of them take ten minutes, or two with --quick.
"""

import shlex
import sys
from collections.abc import Sequence
from pathlib import Path

import contact
import control
import surface_maps
from grasp_forces import study as grasp_study
from harness.command import add_parts, chosen, measured, parser_of
from harness.page import speed_error_report
from harness.study import Effort, Measure, Study
from simulation.study import step_study

import friction
from palpate.reporting.page import write_report

PARTS: dict[str, Measure] = {
    "contact": contact.measure,
    "mapping": surface_maps.sphere_study,
    "friction": friction.ways,
    "control": control.moving,
    "simulation": step_study,
    "grasp": grasp_study.few,
}


def report(names: Sequence[str], effort: Effort, out: Path, command: str) -> list[Study]:
    """Measure parts by name; write the report anew after each."""
    out.mkdir(parents=True, exist_ok=True)
    return measured(
        names,
        PARTS,
        effort,
        lambda done: write_report(speed_error_report(done, command), out / "bench.html"),
    )


def main() -> None:
    """Read the command line and measure."""
    parser = parser_of(__doc__)
    add_parts(parser, PARTS)
    parser.add_argument("--out", type=Path, default=Path("runs/bench"), help="folder for bench.html (runs/bench)")
    given = parser.parse_args()
    command = shlex.join(["python", "benchmarks/bench.py", *sys.argv[1:]])
    report(chosen(parser, given.parts, PARTS), Effort(given.quick, given.seed), given.out, command)
    print(f"Written: {given.out / 'bench.html'}")


if __name__ == "__main__":
    main()
