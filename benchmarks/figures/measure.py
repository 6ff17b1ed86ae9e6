"""How each figure is measured: times as ratios, side by side, where there is something to compare with."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from time import perf_counter

import mujoco
import numpy as np
from contact.categories import CATEGORIES, errors, known_cases
from contact.methods import METHODS, PALPATE, SOLVER
from contact.speed import measure as measure_contact
from loop import Stopwatch, file_recorder
from loop import measure as measure_loop

import palpate as pp
from figures.figure import Figure
from palpate.experiments.explore import explore
from palpate.experiments.explore.exploration import Exploration
from palpate.runtime.real_time import USUAL_PRIORITY, RealTime
from palpate.runtime.timing import Distribution
from palpate.sim import ContactLaw, SphereObject, Tip, build_scene
from palpate.surfaces import Sphere

CASES, BATCH, ROUNDS = 300, 1_000_000, 9
SECONDS = 10.0
"""Of the paced loop."""

TRIES = 3
"""Of a run whose speed counts: the fastest, since whoever else has the core only slows it down."""

NUMPY, ROOT = "one formula, numpy", "scipy root"
COMPARED = (PALPATE, SOLVER, *(method for method in METHODS if method.name in (NUMPY, ROOT)))
EXPLORED = pp.ExploreConfig(spacing=0.004)
FACTORS = pp.ExploreConfig(object="sphere", force=2.0, speed=0.05, width=0.02, depth=0.02, force_noise=0.01)
"""The exploration that the README shows."""


def contact() -> Iterator[Figure]:
    """One contact and many, and how exact they are."""
    worst = max(errors(PALPATE, list(known_cases(each, CASES))).largest for each in CATEGORIES)
    yield Figure("contact_error", worst, "", "1e-15", "largest relative error of a centroid, hard categories")
    found = measure_contact(COMPARED, BATCH, ROUNDS)
    one, solver = found.single[PALPATE.name], found.single[SOLVER.name]
    yield Figure("contact_time", 1e6 * min(one.seconds), "us", "4", "one contact, result object included")
    yield Figure("solver_time", 1e6 * min(solver.seconds), "us", "2", "one contact by a Solver, in a loop")
    for name, method, means in (
        ("numpy_row", NUMPY, "one row of numpy over one contact"),
        ("scipy_root", ROOT, "scipy's root over one contact"),
    ):
        yield Figure(name, found.single[method].spread[1], "", "", means)
    batch = found.batch[PALPATE.name].spread[1]
    yield Figure("batch_copy", batch, "", "", "1e6 contacts over a copy of as many bytes")


def exploration() -> Iterator[Figure]:
    """Force and points of explorations on stage and arm, against the simulation's truth."""
    for robot in ("stage", "ur5e-sim"):
        for shape, speeds in (("sphere", (20, 50)), ("ellipsoid", (20, 50)), ("bumps", (20,)), ("torus", (20,))):
            for speed in speeds:
                found = explore(replace(EXPLORED, robot=robot, object=shape, size=(), speed=1e-3 * speed))
                yield from _errors(found, f"{robot}_{shape}_{speed}", f"{robot}, {shape}, {speed} mm/s")


def _errors(found: Exploration, name: str, means: str) -> Iterator[Figure]:
    yield Figure(f"force_{name}", found.force_rms, "N", "", f"true normal force, RMS error: {means}")
    yield Figure(f"points_{name}", 1e3 * found.point_rms, "mm", "", f"points to the true surface, RMS: {means}")


def simulation() -> Iterator[Figure]:
    """How many times faster than real time runs are simulated, whole control periods with sensing."""
    runs: tuple[tuple[str, str, Callable[[], float]], ...] = (
        ("factor_stage", "stage, exploring", lambda: explore(FACTORS).run.real_time_factor),
        (
            "factor_ur5e",
            "UR5e, exploring",
            lambda: explore(replace(FACTORS, robot="ur5e-sim")).run.real_time_factor,
        ),
        (
            "factor_hand",
            "hand of two fingers that holds an object",
            lambda: pp.grasp_object(pp.GraspConfig(load="step")).run.real_time_factor,
        ),
        ("factor_physics", "stage, MuJoCo's steps alone", _physics),
    )
    for name, means, factor in runs:
        yield Figure(name, max(factor() for _ in range(TRIES)), "", "", f"times real time: {means}")


def _physics() -> float:
    scene = build_scene(Tip(Sphere(0.008)), SphereObject(0.04), ContactLaw(), (0.0, 0.0, 0.0479))
    data, count = mujoco.MjData(scene.model), 5000
    begun = perf_counter()
    for _ in range(2 * count):  # two time steps in a period
        mujoco.mj_step(scene.model, data)
    return count * 1e-3 / (perf_counter() - begun)


def period() -> Iterator[Figure]:
    """The control period, paced at 1 kHz, without physics."""
    with file_recorder() as recorder:
        whole = measure_loop(SECONDS, RealTime(1e-3, priority=USUAL_PRIORITY), recorder)
    watch: dict[str, Stopwatch] = {}
    with file_recorder() as recorder:
        measure_loop(SECONDS, RealTime(1e-3, priority=USUAL_PRIORITY), recorder, watch)
    spread = Distribution.of(whole.work)
    sensed = Distribution.of(np.array(watch["sense"].taken["sense"])[1:])
    yield Figure("period_median", 1e6 * spread.p50, "us", "45", "paced period, median")
    yield Figure("period_99", 1e6 * spread.p99, "us", "150", "paced period, 99 %")
    yield Figure("period_sensing", 1e6 * sensed.p50, "us", "15", "sensing of it, median")


TOPICS: tuple[Callable[[], Iterator[Figure]], ...] = (contact, exploration, simulation, period)
