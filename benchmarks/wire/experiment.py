"""One exploration and one grasp on a simulation, over real wires, and from the log of the wires.

The UR5e explores a sphere at 500 Hz with noise of the sensor: on MuJoCo directly; with the maker's ur_rtde and
a Net F/T client against emulated devices with the same scene behind them; and from the log of that run, whose
samples pass touch, controller and report again. The age of a state counts in wall time from the controller's
sample to the loop. Then the slip-safe grasp with two fingers: servos over dynamixel_sdk on a terminal, two F/T
boxes, ur_rtde for the lift.
"""

import argparse
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
from harness.campaign import Listing, load

from palpate.commands.replay.run import replay_log
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.experiment import Explore
from palpate.experiments.explore.exploration import ExplorationResult, evaluate
from palpate.experiments.explore.plan import plan
from palpate.experiments.grasp.config import GraspConfig
from palpate.experiments.grasp.plan import plan as plan_grasp
from palpate.experiments.grasp.result import GraspResult, grasp_of
from palpate.experiments.kit.from_log import LoggedRun
from palpate.experiments.kit.recorded_run import RecordedRun, carry_out
from palpate.experiments.kit.recording import log_writer
from palpate.robots.emulated.hand import OLDEST, HandWires, emulated_hand
from palpate.robots.robot import Robot, load_robot
from palpate.runtime.data import Command, Observation, Sample
from palpate.runtime.log import log_in, read_log

MAX_RATIO = 2.0
"""Largest ratio of the force's RMS error on the wire to that of direct simulation."""

AGE_MEDIAN, AGE_99 = 3e-3, 8e-3
"""Required ages of a state at the controller [s]."""

RUNS, GRASP_SCALE = 3, 0.25
"""Number of explorations, and time scale of the grasp."""

PART = {"width": 0.02, "depth": 0.006}
"""Explored rectangle [m]: 8 s, of which 7 are on the object."""


class Watch:
    """An observer that keeps how old arm and wrench were when taken, plant time [s]."""

    def __init__(self) -> None:
        self.arm: list[float] = []
        self.wrench: list[float] = []

    def __call__(self, sample: Sample, now: Observation, command: Command) -> None:
        self.arm.append(sample.time - sample.arm.time)
        self.wrench.append(sample.time - sample.wrenches[0].time)


def robots() -> tuple[Robot, Robot]:
    """Return the emulated robot, and the same without wires."""
    from palpate.robots.emulated.ur5e import simulated_twin

    robot = load_robot("emulated-ur5e")
    entry = msgspec.structs.replace(robot.file.backend, time_scale=1.0, address="127.0.9.20")
    robot = replace(robot, file=msgspec.structs.replace(robot.file, backend=entry))
    return robot, simulated_twin(robot)


def explorations(seed: int, folder: Path) -> tuple[dict[str, ExplorationResult], Watch, bool]:
    """Return the exploration on each back end, how old the wire's samples were, and whether its log replays."""
    config = ExploreConfig(robot="emulated-ur5e", seed=seed, out=folder, **PART)
    emulated, simulated = robots()
    direct, wired, watch = plan(config, simulated, {}), plan(config, emulated, {}), Watch()
    found = {
        "MuJoCo": evaluate(direct, carry_out(direct)),
        "wire": evaluate(wired, carry_out(wired, (watch,), (log_writer(Explore(), wired, folder),))),
    }
    log = read_log(log_in(folder))
    found["replay"] = LoggedRun.of(log).evaluate()
    return found, watch, replay_log(log).identical


def grasps(folder: Path) -> dict[str, GraspResult]:
    """Return the grasp by the simulated hand, and by the one on the wire."""
    planned = plan_grasp(GraspConfig(), None, {})
    planned = replace(planned, limits=msgspec.structs.replace(planned.limits, sample_age=OLDEST))
    wires = HandWires("127.0.9.30", ("127.0.9.31", "127.0.9.32"), folder / "bus", GRASP_SCALE)
    found = {}
    for name, hand in (("MuJoCo", None), ("wire", emulated_hand(planned.task(), wires))):
        run = RecordedRun(planned, hand)
        found[name] = grasp_of(planned, run.recorded(run.run()))
    return found


def yes(fine: bool) -> str:
    """Return a mark."""
    return "yes" if fine else "NO"


def experiment(_: argparse.Namespace) -> Iterator[Listing]:
    """Explore on each back end with each seed, then grasp."""
    rows, ratios, arm, wrench, same, identical = [], [], [], [], True, True
    for seed in range(RUNS):
        with tempfile.TemporaryDirectory() as folder:
            found, ages, bit_for_bit = explorations(seed, Path(folder))
        reports = {
            key: {metric.name: metric.value for metric in Explore().report(one).metrics}
            for key, one in found.items()
        }
        for key, one in found.items():
            across = reports[key].get("map to true surface, RMS", float("nan"))
            cells = (f"{one.force_rms:.4f}", f"{1e6 * one.point_rms:.2f}")
            shown = f"{1e3 * across:.2f}" if isinstance(across, float) else across
            rows.append((seed, key, one.run.ending.value, *cells, shown, len(reports[key])))
        ratios.append(found["wire"].force_rms / found["MuJoCo"].force_rms)
        arm += ages.arm
        wrench += ages.wrench
        same = same and len({tuple(each) for each in reports.values()}) == 1
        identical = identical and bit_for_bit
    heads = ("seed", "back end", "ending", "true force, RMS N", "points, RMS um", "map, RMS um", "figures")
    yield Listing(f"exploration, {load()}", heads, rows)
    worst = max(ratios)
    asked = [("force RMS, wire over MuJoCo, worst", f"<= {MAX_RATIO:g}", f"{worst:.2f}", yes(worst <= MAX_RATIO))]
    for name, plant_ages in (("arm", arm), ("wrench", wrench)):
        for share, limit in ((50, AGE_MEDIAN), (99, AGE_99)):
            got = float(np.percentile(plant_ages, share))
            shown = (f"<= {1e3 * limit:g} ms", f"{1e3 * got:.2f} ms", yes(got <= limit))
            asked.append((f"age of the {name}'s sample, p{share}", *shown))
    asked.append(("figures of the report", "the same", "in all three", yes(same)))
    asked.append(("replay of the wire's log", "bit for bit", "commands", yes(identical)))
    notes = (f"500 Hz, {len(arm)} periods.",)
    yield Listing("asked and found", ("figure", "asked", "got", "held"), asked, notes=notes)
    with tempfile.TemporaryDirectory() as folder:
        held = grasps(Path(folder))
    rows = [
        (
            key,
            grasp.run.ending.value,
            yes(not grasp.dropped and not grasp.gave_way),
            f"{1e6 * grasp.slip_aloft:.2f}",
            f"{1e3 * grasp.spin_aloft:.3f}",
            f"{grasp.grip_ratio:.3f}",
            f"{grasp.tightest:.3f}",
        )
        for key, grasp in held.items()
    ]
    heads = ("grasp by", "ending", "held", "slip aloft um", "spin aloft mrad", "grip / least", "tightest")
    yield Listing(f"grasp, time scale {GRASP_SCALE:g}, 1 kHz of the hand's time", heads, rows)


PARTS = {"experiment": experiment}
