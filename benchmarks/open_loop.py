"""Contact studies without a controller: MuJoCo's threads against back ends that Python steps, a process per core.

    python benchmarks/open_loop.py [--runs 400] [--rounds 3] [--quick]

A run presses a fingertip on a ball and slides it aside, 0.4 s, each with a contact stiffness of its own. All of
them by `palpate.sim.rollout_presses`, and by `MujocoBackend` in `run_batch`, both on every core and in turns; next
to it MuJoCo's own steps, one after the other on one core. The ratio of the times that they had a core does not
depend on what else the machine does. Every number is compared bit for bit.
"""

import argparse
import time
from functools import partial

import joblib
import mujoco
import numpy as np
from batch import children_time
from rich.console import Console
from rich.table import Table

from palpate.errors import FloatArray
from palpate.runtime.batch import quiet, results_of, run_batch
from palpate.runtime.data import Command
from palpate.sim import ContactLaw, MujocoBackend, Scene, SphereObject, Tip, build_scene, rollout_presses
from palpate.surfaces import Sphere

PERIODS = 400
"""Of 1 ms: half of them down, half aside."""

STEPPED = 20
"""Runs per case of the batch: so many take about a second, as long as a worker's case should."""


def study(runs: int) -> tuple[list[float], FloatArray]:
    """Return the stiffness of each run [N/m], and its velocities, shape (n, p, 3) [m/s]."""
    velocity, rng = np.zeros((runs, PERIODS, 3)), np.random.default_rng(0)
    velocity[:, : PERIODS // 2, 2] = -0.005
    velocity[:, PERIODS // 2 :, :2] = rng.uniform(-0.02, 0.02, (runs, 1, 2))
    return np.linspace(5e3, 40e3, runs).tolist(), velocity


def scene_of(stiffness: float) -> Scene:
    """Return a fingertip just above a ball."""
    law = ContactLaw(stiffness=stiffness)
    return build_scene(Tip(Sphere(0.008)), SphereObject(0.04), law, (0.0, 0.0, 0.0482))


def stepped(part: tuple[list[float], FloatArray]) -> FloatArray:
    """Return the contact forces of some runs, by a back end, shape (n, p, 3) [N]."""
    forces = []
    for stiffness, velocity in zip(*part, strict=True):
        backend = MujocoBackend(scene_of(stiffness))
        backend.start()
        for x, y, z in velocity.tolist():
            backend.step(Command((x, y, z)))
            forces.append(backend.truth().force)
    return np.array(forces).reshape(len(part[0]), -1, 3)


def in_processes(stiffness: list[float], velocity: FloatArray) -> FloatArray:
    """Return the contact forces of all runs, by back ends in a process per core."""
    parts = [(stiffness[i : i + STEPPED], velocity[i : i + STEPPED]) for i in range(0, len(stiffness), STEPPED)]
    return np.concatenate(results_of(run_batch(stepped, parts, progress=quiet)))


def in_threads(stiffness: list[float], velocity: FloatArray) -> FloatArray:
    """Return the same by MuJoCo's threads."""
    return rollout_presses([scene_of(each) for each in stiffness], velocity).force


def physics_alone(runs: int) -> float:
    """Return how long MuJoCo's steps of so many runs take on one core, in contact [s]."""
    scene = scene_of(20e3)
    model, data = scene.model, mujoco.MjData(scene.model)
    steps = round(1e-3 * PERIODS / scene.fidelity.time_step)
    data.ctrl[2] = -1e-3
    mujoco.mj_step(model, data, steps)
    began = time.perf_counter()
    mujoco.mj_step(model, data, steps)
    return runs * (time.perf_counter() - began)


def timed(call) -> tuple[float, float, FloatArray]:
    """Return how long it took, how long it had a core, workers included [s], and what it gave."""
    began, computed = time.perf_counter(), time.process_time() + children_time()
    found = call()
    computed = time.process_time() + children_time() - computed
    return time.perf_counter() - began, computed, found


def main() -> None:
    """Measure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=400, help="presses")
    parser.add_argument("--rounds", type=int, default=3, help="times that both are measured")
    parser.add_argument("--quick", action="store_true", help="a few runs, for trying it out")
    given = parser.parse_args()
    runs, rounds = (40, 1) if given.quick else (given.runs, given.rounds)
    console, (stiffness, velocity) = Console(), study(runs)
    title = f"{runs} presses of {1e-3 * PERIODS:g} s, on {joblib.cpu_count()} cores"
    table = Table(title=title, title_justify="left")
    headings = ("threads: a minute", "processes: a minute", "ratio", "of core time", "steps alone, 1 core")
    for heading in ("round", *headings):
        table.add_column(heading, justify="right")
    ratios = []
    for index in range(rounds):
        calls = (partial(in_threads, stiffness, velocity), partial(in_processes, stiffness, velocity))
        (threads, ours_computed, ours), (processes, theirs_computed, theirs) = (timed(call) for call in calls)
        if not np.array_equal(ours, theirs):
            raise SystemExit("threads and back ends give other numbers")
        ratios.append((processes / threads, theirs_computed / ours_computed))
        rates = [f"{60.0 * runs / seconds:.0f}" for seconds in (threads, processes, physics_alone(runs))]
        table.add_row(str(index + 1), *rates[:2], *(f"{ratio:.1f}" for ratio in ratios[-1]), rates[2])
    console.print(table)
    wall, computed = np.median(ratios, axis=0)
    console.print(
        f"threads do {wall:.1f} times as many a minute, {computed:.1f} times by core time; the bits are equal"
    )


if __name__ == "__main__":
    main()
