"""Presses by MuJoCo's threads against back ends in processes, and sweeps."""

import csv
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from harness.study import Check, Effort, Study
from harness.tables import grid

from palpate.errors import FloatArray
from palpate.runtime.batch import quiet, results_of, run_batch
from palpate.runtime.data import Command
from palpate.sim import ContactLaw, MujocoBackend, Scene, SphereObject, Tip, build_scene, rollout_presses
from palpate.surfaces import Sphere

COUNTED = 40_000_000
"""Steps of the loop that shows the speed of the cores: about a second."""

PERIODS, STEPPED = 400, 20
"""Periods of 1 ms of a press, half of them down, half aside; presses per case of the batch."""


def children_time() -> float:
    """Return the processor time of ended child processes [s]."""
    times = os.times()
    return times.children_user + times.children_system


def counting_time(steps: int) -> float:
    """Keep a core busy; return for how long [s]."""
    began, total = time.perf_counter(), 0
    for step in range(steps):
        total += step
    return time.perf_counter() - began


def counting_speed_up(processes: int) -> float:
    """Return how much faster that many processes count than one, without their start."""
    alone, together = (
        max(results_of(run_batch(counting_time, [COUNTED] * number, number, progress=quiet)))
        for number in (1, processes)
    )
    return processes * alone / together


def timed(call: Callable[[], object]) -> tuple[object, float, float]:
    """Return the result, the wall time, and the processor time including children [s]."""
    began, computed = time.perf_counter(), time.process_time() + children_time()
    found = call()
    return found, time.perf_counter() - began, time.process_time() + children_time() - computed


def press_scene(stiffness: float) -> Scene:
    """Return a fingertip just above a ball."""
    law = ContactLaw(stiffness=stiffness)
    return build_scene(Tip(Sphere(0.008)), SphereObject(0.04), law, (0.0, 0.0, 0.0482))


def stepped(part: tuple[list[float], FloatArray]) -> FloatArray:
    """Return the contact forces of some presses, by a back end, shape (n, p, 3) [N]."""
    forces = []
    for stiffness, velocity in zip(*part, strict=True):
        backend = MujocoBackend(press_scene(stiffness))
        backend.start()
        for x, y, z in velocity.tolist():
            backend.step(Command((x, y, z)))
            forces.append(backend.truth().force)
    return np.array(forces).reshape(len(part[0]), -1, 3)


def rollout(effort: Effort) -> Study:
    """Measure presses by MuJoCo's threads against back ends in processes; all bits must agree."""
    runs = effort.of(400, 40)
    velocity, rng = np.zeros((runs, PERIODS, 3)), np.random.default_rng(0)
    velocity[:, : PERIODS // 2, 2] = -0.005
    velocity[:, PERIODS // 2 :, :2] = rng.uniform(-0.02, 0.02, (runs, 1, 2))
    stiffness = np.linspace(5e3, 40e3, runs).tolist()
    parts = [(stiffness[i : i + STEPPED], velocity[i : i + STEPPED]) for i in range(0, runs, STEPPED)]
    heads = ("round", "threads: a minute", "processes: a minute", "ratio", "ratio of core time")
    table, ratios = grid(f"{runs} presses of {1e-3 * PERIODS:g} s", *heads), []
    for index in range(effort.of(3, 1)):
        ours, threads, computed = timed(lambda: rollout_presses([*map(press_scene, stiffness)], velocity).force)
        theirs, processes, theirs_computed = timed(
            lambda: np.concatenate(results_of(run_batch(stepped, parts, progress=quiet)))
        )
        if not np.array_equal(ours, theirs):
            raise SystemExit("threads and back ends give different numbers")
        ratios.append((processes / threads, theirs_computed / computed))
        rates = (f"{60.0 * runs / seconds:.0f}" for seconds in (threads, processes))
        table.add_row(str(index + 1), *rates, *(f"{ratio:.1f}" for ratio in ratios[-1]))
    wall, core = np.median(ratios, axis=0)
    about = f"Threads do {wall:.1f} times as many a minute, {core:.1f} times by core time; the bits are equal."
    return Study("Presses by threads", about, tables=(table,))


SMALL = ("explore", "--set", "width=0.01", "depth=0.004", "speed=0.05", "force_noise=0.01")
FRESH, COUNTS = 12, (1, 10, 50, 200)
"""Runs that are commands of their own, and runs of the sweeps whose cost is compared."""


@dataclass(frozen=True, slots=True)
class Swept:
    """A sweep: wall time of the command, of its runs, and processor time [s]; figures by run, as text."""

    wall: float
    computed: float
    processor: float
    rows: list[tuple[str, ...]]


def sweep(runs: int, *words: str) -> Swept:
    """Run a sweep as a command, to its end: imports, checks, workers, tables, picture and report included."""
    with tempfile.TemporaryDirectory() as folder:
        typed = ["sweep", *SMALL[:1], "--seeds", str(runs), *SMALL[1:], *words, "--out", folder]
        command = [sys.executable, "-m", "palpate", *typed]
        done, wall, processor = timed(partial(subprocess.run, command, capture_output=True, text=True))
        assert isinstance(done, subprocess.CompletedProcess)
        if done.returncode:
            raise SystemExit(done.stdout + done.stderr)
        with (Path(folder) / "runs.csv").open(newline="") as file:
            rows = list(csv.DictReader(file))
    figures = [tuple(value for name, value in row.items() if name not in ("duration_s", "host")) for row in rows]
    return Swept(wall, sum(float(row["duration_s"]) for row in rows), processor, figures)


def agree(rows: Sequence[tuple[str, ...]], others: Sequence[tuple[str, ...]]) -> None:
    """Compare the figures of runs; the first column is the number of the run."""
    count = min(len(rows), len(others))
    if [row[1:] for row in rows[:count]] != [row[1:] for row in others[:count]]:
        raise SystemExit("the numbers depend on the process that computes them")


def sweeps(effort: Effort) -> Study:
    """Measure one job against two, warm workers against commands of one run each, and cost against runs."""
    runs, rows = effort.of(200, 4), list[tuple[str, ...]]()
    jobs = grid(f"{runs} runs, whole command", "round", "1 job: s", "2 jobs: s", "speed-up", "counting", "load")
    ratios = []
    for index in range(effort.of(3, 1)):
        effort.tell(f"sweep: jobs, round {index + 1}")
        possible = counting_speed_up(2)
        found = {n: sweep(runs, "--jobs", str(n)) for n in ((1, 2), (2, 1))[index % 2]}
        agree(found[1].rows, found[2].rows)
        rows = found[1].rows
        ratios.append(found[1].wall / found[2].wall)
        cells = (found[1].wall, found[2].wall, ratios[-1], possible, os.getloadavg()[0])
        jobs.add_row(str(index + 1), *(f"{each:.2f}" for each in cells))
    effort.tell("sweep: commands of one run")
    fresh, began = min(runs, FRESH), time.perf_counter()
    with ThreadPoolExecutor(2) as pool:
        alone = list(pool.map(lambda seed: sweep(1, "--jobs", "1", "--set", f"seed={seed}"), range(fresh)))
    rate_alone = 60.0 * fresh / (time.perf_counter() - began)
    agree([each.rows[0] for each in alone], rows)
    table, rate = cost_against_runs(effort, rows)
    gain, warm = float(np.median(ratios)), rate / rate_alone
    checks = (
        Check("speed-up of 200 runs on two quiet cores", ">= 1.8", f"{gain:.2f}", gain >= 1.8),
        Check("runs a minute over commands of one run", ">= 3", f"{rate:.0f} / {rate_alone:.0f}", warm >= 3.0),
    )
    return Study("Sweeps", checks=checks, tables=(jobs, table))


def cost_against_runs(effort: Effort, rows: Sequence[tuple[str, ...]], *words: str) -> tuple[object, float]:
    """Return the table, and the runs a minute of the largest sweep."""
    heads = ("wall s", "s per run", "computing s", "besides s", "processor s", "load")
    table, rate = grid(f"Cost against the number of runs, 2 jobs {' '.join(words)}", "runs", *heads), 0.0
    for count in (1, 4) if effort.quick else COUNTS:
        effort.tell(f"sweep: {count} runs")
        found = sweep(count, "--jobs", "2", *words)
        agree(found.rows, rows)
        besides = found.wall - found.computed / min(2, count)
        cells = (found.wall, found.wall / count, found.computed, besides, found.processor, os.getloadavg()[0])
        table.add_row(str(count), *(f"{cell:.2f}" for cell in cells))
        rate = 60.0 * count / found.wall
    return table, rate


def sweeps_on_ray(effort: Effort) -> Study:
    """Measure the cost against the number of runs on a ray cluster of its own."""
    if find_spec("ray") is None:
        return Study("Sweeps on ray", 'ray is not installed: pip install "palpate[cluster]"')
    return Study("Sweeps on ray", tables=(cost_against_runs(effort, (), "--ray", "local")[0],))


COSTS = {"rollout": rollout, "sweep": sweeps, "sweep-ray": sweeps_on_ray}
