"""How hard a dead force sensor lets a robot press, with and without a second channel of force.

    python benchmarks/dead_sensors.py [--quick] [--robot stage]

A regulation of 2 N on a plate of 20 kN/m, with force limits of 10 and 20 N. The fingertip's sensor dies before
or during the approach, or in contact, and reports a constant, zeros, noise alone, or a tenth of the force; or one
axis is dead. Asked: the largest true force is at most 1.5 times the limit, and what one period at the measured
speed adds. Ends with 1 if one is larger.
"""

import argparse
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, cast

import msgspec
import numpy as np
from rich.console import Console
from rich.table import Table

from faults.dead_sensor import FAULTS, NOISE, RATIO, DeadSensor, WithoutTipForce
from palpate.experiments.kit.recorded_run import RecordedRun
from palpate.experiments.regulate.config import RegulateConfig
from palpate.experiments.regulate.experiment import Regulate
from palpate.robots.robot import load_robot
from palpate.runtime.data import Command, Observation, Sample

SHARE, STIFFNESS = 1.5, 20e3
ROBOTS, LIMITS, SINCE = ("stage", "ur5e-sim"), (10.0, 20.0), (0.0, 0.5, 1.2)
CHANNELS = {"with": lambda backend: backend, "without": WithoutTipForce}


@dataclass(frozen=True, slots=True)
class Case:
    """A robot, its force limit [N], whether the arm measures force itself, and whether its sensor has noise."""

    robot: str
    limit: float
    channel: str
    noisy: bool


def pressed(case: Case, fault: str, since: float) -> tuple[float, float, str]:
    """Return the largest true force, the largest allowed [N], and how it ended."""
    given = load_robot(case.robot)
    limits = msgspec.structs.replace(given.file.limits, force=case.limit, contact_speed=None)
    robot = replace(given, file=msgspec.structs.replace(given.file, limits=limits))
    noise = NOISE if case.noisy else None
    config = RegulateConfig(
        robot=case.robot, duration=1.0, force_noise=noise, moment_noise=None if noise is None else RATIO * noise
    )
    plan = Regulate().plan(config, robot, {})
    backend, forces, speeds = cast("Any", plan.backend()), [0.0], [0.0]

    def watch(sample: Sample, now: Observation, command: Command) -> None:
        truth = backend.truth()
        forces.append(float(np.linalg.norm(truth.force)) if truth.touching else 0.0)
        speeds.append(float(np.linalg.norm(sample.arm.velocity_base_tip)))

    result = RecordedRun(plan, DeadSensor(CHANNELS[case.channel](backend), fault, since)).run([watch])
    return max(forces), SHARE * case.limit + max(speeds) * backend.period * STIFFNESS, result.why


def worst(case: Case, quick: bool) -> Iterator[tuple[str, float, float, float, str]]:
    """Of each fault: since when [s] it is worst, the largest true force, the largest allowed [N], the ending."""
    for fault in FAULTS:
        if fault != "none":
            tried = [(since, *pressed(case, fault, since)) for since in (SINCE[:1] if quick else SINCE)]
            since, force, allowed, why = max(tried, key=lambda each: each[1] - each[2])
            yield fault, since, force, allowed, why


def main() -> int:
    """Measure and print; return 1 if a force is larger than asked."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="sensors that are dead from the start only")
    parser.add_argument("--robot", action="append", help=f"instead of {', '.join(ROBOTS)}; may be repeated")
    given = parser.parse_args()
    table = Table(
        "robot", "limit N", "second channel", "noise", "sensor", "since s", "force N", "allowed N", "trip"
    )
    missed = 0
    for robot in given.robot or ROBOTS:
        for case in [
            Case(robot, limit, c, noisy) for limit in LIMITS for c in CHANNELS for noisy in (True, False)
        ]:
            for fault, since, force, allowed, why in worst(case, given.quick):
                missed += force > allowed
                row = (f"{force:.3g}", f"{allowed:.3g}", why[:60])
                noise = "declared" if case.noisy else "none"
                table.add_row(robot, f"{case.limit:g}", case.channel, noise, fault, f"{since:g}", *row)
    Console(width=190).print(table)
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
