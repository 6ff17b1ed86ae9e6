"""What a grip does where friction is less than believed, how often it hears what is not, how it holds what shakes.

    python benchmarks/grip_changes.py changes    mu -30 % and -50 % in 20 ms, everywhere or at one finger
    python benchmarks/grip_changes.py too-high   mu 30 % less than believed, from the lift on
    python benchmarks/grip_changes.py alarms     undisturbed at a load ratio of 0.9, and with noise x 3
    python benchmarks/grip_changes.py shaken     with 1 N, 2 to 10 Hz, for 30 s

Prints a Markdown table. `--known`, `--fingers`: which, all if not given; `--plant`: the friction plant's bristles
instead of MuJoCo's friction. Seeds from 2000 on are those that nothing was tuned on.
"""

import argparse
import itertools
import math
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from grip.changed_friction import FrictionChange, Run, believed_too_high, drawn
from grip.league import HEADS, LONG, Row, wilson
from grip.long_hold import shaken, undisturbed

from palpate.experiments.grasp.plan import plan

KNOWN, FINGERS = ("touched", "estimated", "untouched"), (2, 3)
MINUTE, SHAKING = 60.0, 30.0
"""[s] How long one object is held, or shaken."""

Cells = tuple[str, ...]


Runs = Sequence[Any]
"""One of each seed."""


@dataclass(frozen=True, slots=True)
class Table:
    """A table: what is done with a seed, one thing or several, and what the row of each thing says.

    Attributes:
        rows: Their names.
        runs: What came of each, by (seed, known, fingers, plant).
        heads: Of the columns.
        cells: From the fingers and the runs of a row.
    """

    rows: Cells
    runs: Callable[[int, Any, int, bool], Runs]
    heads: Cells
    cells: Callable[[int, Runs], Cells]


def changed(seed: int, known: Any, fingers: int, plant: bool) -> Runs:
    """Hold an object; its friction changes."""
    return Run(plan(drawn(seed, known, fingers, plant=plant), None, {})).each_held(CHANGES.values(), LONG)


def too_high(seed: int, known: Any, fingers: int, plant: bool) -> Runs:
    """Lift and hold an object of less friction than believed."""
    return [Run(plan(believed_too_high(seed, known, fingers, plant=plant), None, {})).held(None, LONG)]


def quiet(seed: int, known: Any, fingers: int, plant: bool) -> Runs:
    """Hold an object undisturbed."""
    return [undisturbed(seed, known, fingers, seconds=MINUTE, noisier=by, plant=plant) for by in NOISES]


def all_shaken(seed: int, known: Any, fingers: int, plant: bool) -> Runs:
    """Shake an object."""
    return [shaken(seed, known, fingers, hertz, seconds=SHAKING, plant=plant) for hertz in SHAKES]


def held_cells(fingers: int, runs: Runs) -> Cells:
    """What is told of friction that changes."""
    return (*Row.of(list(runs)).cells, f"{sum(each.early for each in runs)}")


def drops_of(runs: Runs) -> str:
    """How many were lost."""
    drops = sum(each.dropped for each in runs)
    low, high = wilson(drops, len(runs))
    return f"{drops}/{len(runs)} ({100.0 * low:.0f} to {100.0 * high:.0f} %)"


def quiet_cells(fingers: int, runs: Runs) -> Cells:
    """What is told of an undisturbed hold."""
    alarms, tens = sum(each.alarms for each in runs), len(runs) * fingers * MINUTE / 600.0
    return (
        drops_of(runs),
        f"{alarms / tens:.2g} ({alarms} in {tens:.0f})",
        f"{1e3 * max(each.slip for each in runs):.2g}",
        f"{np.mean([each.grip for each in runs]):.2f}",
        f"{np.mean([each.ratio for each in runs]):.2f}",
    )


def shaken_cells(fingers: int, runs: Runs) -> Cells:
    """What is told of shaking."""
    creeps, ratios = [1e6 * each.creep for each in runs], [each.grip / each.peak for each in runs]
    return (
        drops_of(runs),
        f"{np.median(creeps):.2g} / {max(creeps):.2g}",
        f"{math.degrees(max(each.turning for each in runs)):.2g}",
        f"{np.median(ratios):.2f} / {max(ratios):.2f}",
        f"{sum(each.alarms for each in runs)}",
    )


CHANGES = {
    "nothing changes": FrictionChange(),
    "mu -30 %, all": FrictionChange(0.7),
    "mu -50 %, all": FrictionChange(0.5),
    "mu -30 %, one finger": FrictionChange(0.7, fingers=(0,)),
    "mu -50 %, one finger": FrictionChange(0.5, fingers=(0,)),
}
NOISES, SHAKES = (1.0, 3.0), (2.0, 3.5, 5.0, 7.0, 10.0)
"""Times the sensors' noise, and [Hz]."""

HELD_HEADS = (*HEADS, "alarms before")
TABLES = {
    "changes": Table(tuple(CHANGES), changed, HELD_HEADS, held_cells),
    "too-high": Table(("believed 30 % too high",), too_high, HELD_HEADS, held_cells),
    "alarms": Table(
        tuple(f"noise x {by:g}" for by in NOISES),
        quiet,
        ("drops", "alarms per finger in 10 min", "slip mm, worst", "grip N", "load ratio"),
        quiet_cells,
    ),
    "shaken": Table(
        tuple(f"{hertz:g} Hz" for hertz in SHAKES),
        all_shaken,
        ("drops", "creep um/s, median / worst", "deg/s, worst", "grip over least of the peak", "alarms"),
        shaken_cells,
    ),
}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=TABLES)
    parser.add_argument("--known", nargs="+", default=KNOWN, choices=KNOWN)
    parser.add_argument("--fingers", nargs="+", type=int, default=FINGERS, choices=FINGERS)
    parser.add_argument("--plant", action="store_true", help="bristles")
    parser.add_argument("--seeds", type=int, default=40)
    parser.add_argument("--first", type=int, default=2000)
    parser.add_argument("--jobs", type=int, default=2)
    asked = parser.parse_args()
    table, seeds = TABLES[asked.what], range(asked.first, asked.first + asked.seeds)
    for row in (("", "friction", "fingers", *table.heads), ["---"] * (3 + len(table.heads))):
        print(f"| {' | '.join(row)} |", flush=True)
    with ProcessPoolExecutor(asked.jobs) as pool:
        for known, fingers in itertools.product(asked.known, asked.fingers):
            one = partial(table.runs, known=known, fingers=fingers, plant=asked.plant)
            for name, runs in zip(table.rows, zip(*pool.map(one, seeds), strict=True), strict=True):
                print(f"| {' | '.join((name, known, str(fingers), *table.cells(fingers, runs)))} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
