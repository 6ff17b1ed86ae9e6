"""The table: speed and error of every solver on one page, and the figures asked for."""

import math
from collections.abc import Sequence

from rich import box
from rich.table import Table

from grasp_forces.asked import Figure, Times
from grasp_forces.hard import Score, Verdict
from grasp_forces.methods import Method
from grasp_forces.timing import Timing
from palpate.grasp import Objective

WIDTH = 168

EXPLANATION = """\
Under a number of contacts: median time cold / warm in us, and below it the largest relative error of the \
objective; "n/m" where only n of m loads were called solved. "-": left out, since it takes seconds, or solves \
nothing of that size. Violation: the largest of equilibrium, cones and bounds, over the load. Hard, feasible: \
right (objective within 1e-4, violation within 1e-6), violating limits, not the best, falsely infeasible, \
undecided; infeasible: certified, wrongly "solved", undecided. Factors of the load that could be held: 0.5 to \
0.999, and 1.0001 to 5; slow solvers get every fifth or twentieth instance. Times are processor time, in turns: \
trust ratios. Warm, for clarabel and cvxpy: workspace kept."""


def speed_error_table(
    methods: Sequence[Method],
    times: Times,
    scores: dict[str, Score],
    others: dict[Objective, Times],
) -> Table:
    """Return the table; solvers by row, first those of min_effort."""
    table = Table(title="Grasp forces: speed against error", box=box.SIMPLE, padding=(0, 1, 0, 0))
    table.add_column("min_effort", no_wrap=True)
    for n in times:
        table.add_column(f"n = {n}", justify="right", no_wrap=True)
    for heading in ("violation", "hard, feasible", "infeasible"):
        table.add_column(heading, justify="right", no_wrap=True)
    for method in methods:
        of = [times[n].get(method.name) for n in times]
        worst = max((each.violation for each in of if each and each.violations), default=math.nan)
        table.add_row(method.name, *[cell(each) for each in of], size(worst), *_hard(scores[method.name]))
    for objective, by_size in others.items():
        table.add_section()
        table.add_row(f"[bold]{objective.value}")
        names = next(iter(by_size.values()))
        for name in names:
            cells = [cell(by_size[n][name]) if n in by_size else "" for n in times]
            worst = max((by_size[n][name].violation for n in by_size), default=math.nan)
            table.add_row(name, *cells, size(worst))
    return table


def figures_table(figures: Sequence[Figure]) -> Table:
    """Return what was asked and got."""
    table = Table(title="Asked for", box=box.SIMPLE, padding=(0, 1, 0, 0))
    table.add_column("figure")
    for heading in ("at most", "got", "unit", ""):
        table.add_column(heading, justify="right")
    for each in figures:
        verdict = "kept" if each.kept else "[bold red]missed"
        table.add_row(each.name, f"{each.limit:.3g}", f"{each.got:.3g}", each.unit, verdict)
    return table


def cell(timing: Timing | None) -> str:
    """Return times and error of one solver at one size."""
    if timing is None:
        return "-"
    times = f"{micro(timing.median(warm=False))}/{micro(timing.median(warm=True))}"
    solved = timing.judged - timing.unsolved
    part = "" if not timing.unsolved else f"{solved}/{timing.judged} "
    return f"{times}\n{part}{size(timing.error)}"


def micro(seconds: float) -> str:
    """Return microseconds, two or three digits."""
    value = 1e6 * seconds
    if value >= 1e5:
        return f"{value:.0e}".replace("e+0", "e")
    return f"{value:.0f}" if value >= 10.0 else f"{value:.1f}"


def size(value: float) -> str:
    """Return the size of an error."""
    return f"{value:.0e}" if math.isfinite(value) else "none"


def _hard(score: Score) -> tuple[str, str]:
    feasible = (
        Verdict.RIGHT,
        Verdict.VIOLATES,
        Verdict.WORSE,
        Verdict.FALSELY_INFEASIBLE,
        Verdict.UNDECIDED,
    )
    infeasible = (Verdict.CERTIFIED, Verdict.WRONGLY_SOLVED, Verdict.OPEN)
    counts = [" ".join(str(score.verdicts[each]) for each in kinds) for kinds in (feasible, infeasible)]
    return f"{counts[0]}\nof {score.feasible}", f"{counts[1]}\nof {score.infeasible}"
