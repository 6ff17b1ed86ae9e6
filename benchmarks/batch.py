"""Independent explorations over processes: how much sooner they are done, and that the numbers are the same.

    python benchmarks/batch.py [--runs 16] [--processes 2] [--rounds 3] [--quick]

Each run explores a sphere with another seed, speed and friction. A plain loop in this process, then rounds of a
batch in one process and in several, in turns, so that what else the machine does falls on both. The speed-up is
that of the whole call, starting the workers included (about a second); what the machine could give at best is
measured next to it, with as many processes that only count. "Computed" is the time that the workers had a core:
where it is the same for one process and for several, the cores are what is short. Every number of every run is
compared bit for bit.
"""

import argparse
import hashlib
import os
import time
from dataclasses import dataclass, fields

import joblib
import numpy as np
from rich.console import Console
from rich.table import Table

from palpate.experiments.explore import explore
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.exploration import Exploration
from palpate.runtime.batch import results_of, run_batch

ASKED = 1.7
"""Speed-up with two processes on two quiet cores."""

COUNTED = 40_000_000
"""Steps of the loop that shows what the cores give: about a second."""


@dataclass(frozen=True, slots=True)
class Found:
    """What is left of an exploration; the record stays in the worker.

    Attributes:
        digest: Of every bit of record, truth, points and force.
        force_rms: [N]
        duration: On the simulation's clock [s].
    """

    digest: str
    force_rms: float
    duration: float


def found(config: ExploreConfig) -> Found:
    """Explore, and reduce what was found."""
    exploration = explore(config)
    return Found(digest(exploration), exploration.force_rms, float(exploration.record.time[-1]))


def digest(exploration: Exploration) -> str:
    """Return a hash of every bit that was recorded."""
    whole = hashlib.sha256()
    for part in (exploration.record, exploration.truth, exploration.cloud):
        for field in fields(part):
            value = getattr(part, field.name)
            if isinstance(value, np.ndarray):
                whole.update(field.name.encode() + np.ascontiguousarray(value).tobytes())
    whole.update(exploration.set_force.tobytes() + exploration.point_error.tobytes())
    return whole.hexdigest()


def cases(runs: int, size: float) -> list[ExploreConfig]:
    """Return as many explorations that differ in seed, speed and friction."""
    return [
        ExploreConfig(
            width=size,
            depth=size,
            spacing=0.004,
            speed=(0.02, 0.03, 0.05)[seed % 3],
            friction=(0.2, 0.3)[seed % 2],
            force_noise=0.01,
            moment_noise=1e-4,
            seed=seed,
        )
        for seed in range(runs)
    ]


def counting_time(steps: int) -> float:
    """Keep a core busy; return for how long [s]."""
    began, total = time.perf_counter(), 0
    for step in range(steps):
        total += step
    return time.perf_counter() - began


def timed(work, cases, processes):
    """Return the results, how long they took, and how long the workers computed [s]."""
    began, computed = time.perf_counter(), children_time()
    results = results_of(run_batch(work, cases, processes))
    return results, time.perf_counter() - began, children_time() - computed


def children_time() -> float:
    """Return how long processes computed that this one had started and that have ended [s]."""
    times = os.times()
    return times.children_user + times.children_system


def counting_speed_up(processes: int) -> float:
    """Return how much faster so many processes count than one, without their start."""
    alone, together = (
        max(results_of(run_batch(counting_time, [COUNTED] * number, number))) for number in (1, processes)
    )
    return processes * alone / together


def main() -> None:
    """Measure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=16, help="explorations in a batch")
    parser.add_argument("--processes", type=int, default=2, help="compared with one")
    parser.add_argument("--rounds", type=int, default=3, help="times that both are measured")
    parser.add_argument("--quick", action="store_true", help="a few short runs, for trying it out")
    given = parser.parse_args()
    runs, rounds, size = (4, 1, 0.008) if given.quick else (given.runs, given.rounds, 0.04)
    console, configs, n = Console(), cases(runs, size), given.processes

    began = time.perf_counter()
    plain = [found(config) for config in configs]
    loop = time.perf_counter() - began
    table = Table(
        title=f"{runs} explorations in 1 and in {n} processes, on {joblib.cpu_count()} cores", title_justify="left"
    )
    for heading in ("round", "1: s", f"{n}: s", "speed-up", "counting", "computed s", "bits"):
        table.add_column(heading, justify="right", no_wrap=True)
    ratios, equal = [], True
    for index in range(rounds):
        possible = counting_speed_up(n)
        order = (1, n) if index % 2 else (n, 1)
        measured = {processes: timed(found, configs, processes) for processes in order}
        alike = all(results == plain for results, *_ in measured.values())
        equal &= alike
        one, several = measured[1][1], measured[n][1]
        ratios.append(one / several)
        alike_shown = "equal" if alike else "[red]DIFFERENT[/red]"
        ratio = f"{ratios[-1]:.2f}"
        computed = " / ".join(f"{measured[processes][2]:.1f}" for processes in (1, n))
        seconds = (f"{one:.1f}", f"{several:.1f}")
        table.add_row(str(index + 1), *seconds, ratio, f"{possible:.2f}", computed, alike_shown)
    console.print(table)
    simulated = sum(run.duration for run in plain)
    console.print(
        f"plain loop {loop:.1f} s for {simulated:.0f} s simulated; force RMS "
        f"{min(run.force_rms for run in plain):.3f} to {max(run.force_rms for run in plain):.3f} N"
    )
    median = float(np.median(ratios))
    if n == 2:
        kept = "yes" if median >= ASKED else "[red]NO[/red]"
        console.print(f"median speed-up {median:.2f}; asked on two quiet cores {ASKED}: {kept}")
    if not equal:
        raise SystemExit("the numbers depend on the process that computes them")


if __name__ == "__main__":
    main()
