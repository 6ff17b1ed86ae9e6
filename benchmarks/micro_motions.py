"""Wanted micro-motions: pivots to an angle, slides by a way, and rolls without slip, against what was asked.

    python benchmarks/micro_motions.py [--quick] [--seeds N] [--first SEED] [--only WORDS] [--processes N]

A box of 0.1 kg between two fingertips is lifted, then let turn by 30 degrees about the contacts, or slide down by
5 or 10 mm; a fingertip is rolled by 10 mm over a plate. Wrench sensors: noise 10 mN and 0.1 mNm, drift 1 mN/s and
0.01 mNm/s. The turn is read with 0.2 degrees of noise, the slide with 50 um, every 2 ms. mu 0.5 and e 4 mm are
what was touched; the true ones lie up to 3 % and 5 % off. Offsets are drawn evenly, 8 to 20 mm. How translation
and slip are defined is said in `benchmarks/micro`. Shares are with their 95 % intervals (Clopper & Pearson 1934).
Ends with 1 if a figure that was asked for is missed.
"""

import argparse
import math
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from micro.roll_run import roll
from micro.slip_run import GRIPPED_ABOVE, pivot, slide, translation_of_normality, true_surface
from rich.console import Console
from rich.table import Table
from scipy.stats import beta

from palpate.runtime.batch import progress_bar, results_of, run_batch

ANGLE = math.radians(30.0)
NEAREST, FARTHEST = 0.008, 0.020
"""[m] Offset of the centre of mass from the contacts."""

ASIDE = 0.0005
"""[m] As far at most a box that slides is gripped beside its middle. A contact that slides bears hardly a torque,
so that it turns until it hangs: 1.9 degrees, 15 mm below the contacts, whoever controls."""


@dataclass(frozen=True, slots=True)
class Told:
    """What a run comes to.

    Attributes:
        off: From what was wanted: degrees, or mm.
        second: The other figure: see the case.
        kept: Whether both are as asked.
    """

    off: float
    second: float
    kept: bool


@dataclass(frozen=True, slots=True)
class Case:
    """Many runs of a kind.

    Attributes:
        name: For the table.
        run: From a seed to what came of it.
        asked: In words.
    """

    name: str
    run: Callable[[int], Told]
    asked: str


def pivoted(seed: int, along: bool = False, bristles: bool = False) -> Told:
    """Second figure: translation over e^2 / offset per radian, or in mm if the hand moves along."""
    offset = float(np.random.default_rng((seed, 13)).uniform(NEAREST, FARTHEST))
    came = pivot(seed, ANGLE, offset, along, bristles)
    off = abs(math.degrees(came.turn - ANGLE))
    if along:
        second, most = 1e3 * came.translation, 0.5
    else:
        second, most = came.translation / translation_of_normality(true_surface(seed), offset, ANGLE), 1.3
    return Told(off, second, came.done and off <= 1.0 and second <= most)


def slid(seed: int, way: float, bristles: bool = False) -> Told:
    """Second figure: largest turn over that with which the box farthest aside hangs."""
    offset = float(np.random.default_rng((seed, 13)).uniform(-ASIDE, ASIDE))
    came = slide(seed, way, offset, bristles)
    off, turned = 1e3 * abs(came.way - way), came.turned / math.atan2(ASIDE, GRIPPED_ABOVE)
    return Told(off, turned, came.done and off <= 0.2 and turned <= 1.1)


def rolled(seed: int, bristles: bool = False) -> Told:
    """Second figure: tangential over normal force, at most."""
    heading = float(np.random.default_rng((seed, 13)).uniform(0.0, 2.0 * math.pi))
    came = roll(seed, heading=heading, bristles=bristles)
    return Told(1e3 * came.slip, came.sideways, came.done and came.slip <= 0.02e-3)


def cases() -> list[Case]:
    """Return what is run."""
    still, moving = "1 deg; 1.3 e^2/offset per rad", "1 deg; 0.5 mm"
    slides, rolls = "0.2 mm; 1.1", "0.02 mm slip; -"
    return [
        Case("pivot, hand still", pivoted, still),
        Case("pivot, hand moves along", partial(pivoted, along=True), moving),
        Case("pivot, hand still, friction plant", partial(pivoted, bristles=True), still),
        Case("pivot, hand moves along, friction plant", partial(pivoted, along=True, bristles=True), moving),
        Case("slide 5 mm", partial(slid, way=0.005), slides),
        Case("slide 10 mm", partial(slid, way=0.01), slides),
        Case("slide 5 mm, friction plant", partial(slid, way=0.005, bristles=True), slides),
        Case("roll 10 mm", rolled, rolls),
        Case("roll 10 mm, friction plant", partial(rolled, bristles=True), rolls),
    ]


def interval(failures: int, runs: int) -> tuple[float, float]:
    """Return the 95 % interval of a share."""
    low = 0.0 if failures == 0 else float(beta.ppf(0.025, failures, runs - failures + 1))
    high = 1.0 if failures == runs else float(beta.ppf(0.975, failures + 1, runs - failures))
    return low, high


def main() -> int:
    """Run all, print a table, return what the process ends with."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="2 seeds of each")
    parser.add_argument("--seeds", type=int, default=30, help="runs of each case (30)")
    parser.add_argument(
        "--first", type=int, default=1000, help="first seed (1000; below 100 is what was tuned with)"
    )
    parser.add_argument("--only", default="", help="only cases with this in their name")
    parser.add_argument("--processes", type=int, default=1, help="how many at once (1)")
    options = parser.parse_args()
    seeds = range(options.first, options.first + (2 if options.quick else options.seeds))
    console = Console(soft_wrap=True)
    table = Table(title="Wanted micro-motions: median / worst over the runs")
    for head in ("case", "runs", "off", "second", "asked", "failures", "as asked"):
        table.add_column(head, justify="left" if head == "case" else "right")
    good = True
    with progress_bar(console) as show:
        for case in cases():
            if options.only not in case.name:
                continue
            came = results_of(run_batch(case.run, seeds, processes=options.processes, progress=show))
            failures = sum(not each.kept for each in came)
            low, high = interval(failures, len(came))
            good = good and failures == 0
            figures = ([each.off for each in came], [each.second for each in came])
            row = [
                case.name,
                str(len(came)),
                *(f"{np.median(values):.3g} / {max(values):.3g}" for values in figures),
                case.asked,
                f"{failures} ({100 * low:.1f} to {100 * high:.1f} %)",
                "NO" if failures else "yes",
            ]
            table.add_row(*row)
            console.print("  ".join(row))
    console.print(table)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
