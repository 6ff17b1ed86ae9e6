"""What a sweep costs: against a process per run, two jobs against one, against the number of runs, what ray adds.

    python benchmarks/sweep.py [--runs 200] [--rounds 3] [--ray] [--quick]

Everything is the command as people type it, from its start to its end: imports, checks, worker processes, tables,
picture and report included. A run is a small exploration of about half a second.

- Warm workers: the runs per minute of a sweep over those of as many commands of one run each, two at a time: each
  imports, loads kernels, compiles its scene and writes a page for itself.
- Speed-up: the same sweep with one job and with two, in turns, so that what else the machine does falls on both;
  next to it what two processes that only count gain on the same machine, and how busy it was (load average at the
  end). Where counting gains nothing, other work has the cores, and the speed-up says nothing of sweeps.
- Cost against the number of runs, with two jobs: wall time, what of it no run accounts for, and the time that all
  processes together had a core (not that of ray's, which are nobody's children).

Every row of every sweep is compared with that of the first: whoever does a run, its figures are the same bits.
"""

import argparse
import csv
import os
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from batch import children_time, counting_speed_up
from rich.console import Console
from rich.table import Table

ASKED = 1.8
"""Speed-up of 200 short runs with two jobs on two quiet cores."""

ASKED_WARM = 3.0
"""Runs per minute over those of a process per run."""

FRESH = 12
"""Runs that are commands of their own: their rate does not depend on how many they are."""

COUNTS = (1, 10, 50, 200)
"""Runs of the sweeps whose cost is compared."""

NOT_FIGURES = {"duration_s", "host"}


@dataclass(frozen=True, slots=True)
class Swept:
    """A sweep that was measured.

    Attributes:
        wall: From the command's start to its end [s].
        computed: Wall time of its runs together, each in its process [s].
        processor: Time that it had a core, all processes together [s]; what else the machine does adds little.
        rows: Figures by run, as text.
    """

    wall: float
    computed: float
    processor: float
    rows: list[tuple[str, ...]]


def sweep(runs: int, *words: str) -> Swept:
    """Type a sweep of so many runs, and wait for it."""
    typed = [
        "explore",
        "--seeds",
        str(runs),
        "--set",
        "width=0.01",
        "depth=0.004",
        "speed=0.05",
        "force_noise=0.01",
    ]
    with tempfile.TemporaryDirectory() as folder:
        began, processor = time.perf_counter(), children_time()
        command = [sys.executable, "-m", "palpate", "sweep", *typed, *words, "--out", folder]
        done = subprocess.run(command, capture_output=True, text=True)
        wall, processor = time.perf_counter() - began, children_time() - processor
        if done.returncode:
            raise SystemExit(done.stdout + done.stderr)
        with (Path(folder) / "runs.csv").open(newline="") as file:
            rows = list(csv.DictReader(file))
    figures = [tuple(value for name, value in row.items() if name not in NOT_FIGURES) for row in rows]
    return Swept(wall, sum(float(row["duration_s"]) for row in rows), processor, figures)


def speed_up(console: Console, runs: int, rounds: int) -> list[tuple[str, ...]]:
    """Measure one job against two; return the figures."""
    table = Table(title=f"{runs} runs with 1 job and with 2, whole command", title_justify="left")
    for heading in ("round", "1 job: s", "2 jobs: s", "speed-up", "counting", "load"):
        table.add_column(heading, justify="right")
    ratios, rows = [], []
    for index in range(rounds):
        possible = counting_speed_up(2)
        order = (1, 2) if index % 2 else (2, 1)
        found = {jobs: sweep(runs, "--jobs", str(jobs)) for jobs in order}
        rows = rows or found[1].rows
        if not rows == found[1].rows == found[2].rows:
            raise SystemExit("the numbers depend on the process that computes them")
        ratios.append(found[1].wall / found[2].wall)
        seconds = (f"{found[jobs].wall:.1f}" for jobs in (1, 2))
        load = f"{os.getloadavg()[0]:.1f}"
        table.add_row(str(index + 1), *seconds, f"{ratios[-1]:.2f}", f"{possible:.2f}", load)
    console.print(table)
    median = float(np.median(ratios))
    kept = "yes" if median >= ASKED else "[red]NO[/red]"
    console.print(f"median speed-up {median:.2f}; asked of 200 short runs on two quiet cores {ASKED}: {kept}")
    return rows


def warm(console: Console, runs: int, rows: list[tuple[str, ...]]) -> None:
    """Measure a sweep of two jobs against commands of one run each, two at a time."""
    fresh = min(runs, FRESH)
    began = time.perf_counter()
    with ThreadPoolExecutor(2) as pool:
        alone = list(pool.map(lambda seed: sweep(1, "--jobs", "1", "--set", f"seed={seed}"), range(fresh)))
    rate_alone = 60.0 * fresh / (time.perf_counter() - began)
    together = sweep(runs, "--jobs", "2")
    rate = 60.0 * runs / together.wall
    if [each.rows[0][1:] for each in alone] != [row[1:] for row in rows[:fresh]] or together.rows != rows:
        raise SystemExit("the numbers depend on what else a process has computed")
    computed = together.computed / runs
    kept = "yes" if rate >= ASKED_WARM * rate_alone else "[red]NO[/red]"
    console.print(
        f"{rate:.0f} runs a minute in a sweep of {runs}, {computed:.2f} s each; {rate_alone:.0f} as commands of "
        f"their own: {rate / rate_alone:.1f} times as many, asked {ASKED_WARM}: {kept}"
    )


def cost(console: Console, counts: tuple[int, ...], rows: list[tuple[str, ...]], *words: str) -> None:
    """Measure the cost against the number of runs."""
    title = f"Cost against the number of runs, 2 jobs{' on ray' if words else ''}"
    table = Table(title=title, title_justify="left")
    for heading in ("runs", "wall s", "s per run", "computing s", "besides s", "processor s", "load"):
        table.add_column(heading, justify="right")
    for count in counts:
        found = sweep(count, "--jobs", "2", *words)
        if [row[1:] for row in found.rows[: len(rows)]] != [row[1:] for row in rows[:count]]:
            raise SystemExit("the numbers depend on how many runs there are")
        besides = found.wall - found.computed / min(2, count)
        cells = (
            found.wall,
            found.wall / count,
            found.computed,
            besides,
            found.processor,
            os.getloadavg()[0],
        )
        table.add_row(str(count), *(f"{cell:.2f}" for cell in cells))
    console.print(table)


def main() -> None:
    """Measure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--runs", type=int, default=200, help="of the sweep that is done with one job and with two"
    )
    parser.add_argument("--rounds", type=int, default=3, help="times that both are measured")
    parser.add_argument("--ray", action="store_true", help="also on a ray cluster of its own")
    parser.add_argument("--quick", action="store_true", help="a few runs, for trying it out")
    given = parser.parse_args()
    runs, rounds = (4, 1) if given.quick else (given.runs, given.rounds)
    counts = (1, 4) if given.quick else tuple(count for count in COUNTS if count <= runs)
    console = Console()
    rows = speed_up(console, runs, rounds)
    warm(console, runs, rows)
    cost(console, counts, rows)
    if given.ray:
        cost(console, counts, rows, "--ray", "local")


if __name__ == "__main__":
    main()
