"""What `python benchmarks/grasp.py` does: measure, print the table, draw the picture."""

import argparse
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from grasp_forces.asked import PARTS, Times, effort_figures, hard_figures, other_figures
from grasp_forces.hard import Score, scores
from grasp_forces.judges import EffortJudge, ThetaJudge
from grasp_forces.methods import METHODS, SIZES, Method, of_objective
from grasp_forces.picture import draw, save
from grasp_forces.silence import only_console
from grasp_forces.tables import EXPLANATION, WIDTH, figures_table, speed_error_table
from grasp_forces.timing import Effort, measure
from palpate.grasp import Objective
from support.grasp_families import instances

DESCRIPTION = """\
Speed of grasp-force solvers against their error: palpate's own and what else is installed.

min_effort with 2 to 1000 contacts, cold and warm along loads that move 0.1 to 1 % a period; hard families
(slippery, sticky, antipodal, parallel, coincident, in line, large e) under loads of known factors; max_margin,
min_peak and load_factor against clarabel. Errors are against 18 digits (min_effort) or clarabel at 1e-11.
Solvers that are not installed are named; none but clarabel, which tests need, is a dependency.
A few minutes; --quick takes a tenth. Exit status 1: a figure asked for was not reached.
"""
PICTURE = Path(__file__).resolve().parents[2] / "runs" / "grasp_speed_error.png"
FULL = Effort(grasps=4, periods=500, seconds=0.1, per_family=14)
QUICK = Effort(grasps=1, periods=100, seconds=0.03, per_family=1)
HARD_SEED = 80_000
"""One that nothing was tuned on."""


def main() -> None:
    """Read the command line, measure and show; exit with 1 if a figure was missed."""
    parser = argparse.ArgumentParser(
        prog="python benchmarks/grasp.py",
        description=DESCRIPTION,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--quick", action="store_true", help="a tenth of everything")
    parser.add_argument("--picture", type=Path, default=PICTURE, help="where to write it (default: %(default)s)")
    arguments = parser.parse_args()
    effort = QUICK if arguments.quick else FULL
    methods = [method for method in METHODS if method.installed]
    missing = [method.package for method in METHODS if not method.installed]
    with only_console(WIDTH) as console:
        times, found, others = measure_all(methods, SIZES, effort, console)
        console.print(speed_error_table(methods, times, found, others))
        console.print(EXPLANATION, highlight=False)
        if missing:
            named = ", ".join(str(each) for each in missing)
            console.print(f"Left out, not installed (pip install ...): {named}", highlight=False)
        figures = effort_figures(times) + hard_figures(found) + other_figures(others)
        console.print(figures_table(figures))
        save(draw(times, "Least effort: time against error, one thread"), arguments.picture)
        console.print(f"Picture: {arguments.picture}", highlight=False, soft_wrap=True)
    if not all(each.kept for each in figures):
        sys.exit(1)


def measure_all(
    methods: Sequence[Method], sizes: Sequence[int], effort: Effort, console: Console
) -> tuple[Times, dict[str, Score], dict[Objective, Times]]:
    """Measure everything, with a progress bar."""
    times: Times = {}
    others: dict[Objective, Times] = {}
    wanted = (Objective.MAX_MARGIN, Objective.MIN_PEAK, Objective.LOAD_FACTOR)
    hard = list(instances(HARD_SEED, effort.per_family))
    # few refreshes: the bar's thread is in the way of what is timed
    with Progress(transient=True, console=console, refresh_per_second=1) as progress:
        bar = progress.add_task("times", total=effort.grasps * len(sizes))
        done = partial(progress.advance, bar)
        for n in sizes:
            able = [method for method in methods if method.most_contacts >= n]
            times[n] = measure(able, n, effort, EffortJudge, done)
        bar = progress.add_task("other objectives", total=effort.grasps * len(PARTS) * len(wanted))
        done = partial(progress.advance, bar)
        for objective in wanted:
            judge = partial(ThetaJudge, objective=objective)
            others[objective] = {n: measure(of_objective(objective), n, effort, judge, done) for n in PARTS}
        bar = progress.add_task("hard families", total=len(hard))
        found = scores(methods, hard, partial(progress.advance, bar))
    return times, found, others
