"""Largest force of a robot whose force sensor is dead, with and without a second channel of force.

A regulation of 2 N on a plate of 20 kN/m, with force limits of 10 and 20 N. The fingertip's sensor dies before
or during the approach, or in contact, and reports a constant, zeros, noise alone, or a tenth of the force; or
one axis is dead. Required: the largest true force is at most 1.5 times the limit plus the increase in one
period at the measured speed.
"""

import argparse
import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, cast

import msgspec
import numpy as np
from harness.campaign import Listing

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
    """Return the largest true force, the largest allowed force [N], and the ending."""
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


def worst(case: Case) -> Iterator[tuple[str, float, float, float, str]]:
    """Yield each fault, its worst time [s], the largest true and the largest allowed force [N], and the ending."""
    for fault in FAULTS:
        if fault != "none":
            tried = [(since, *pressed(case, fault, since)) for since in SINCE]
            since, force, allowed, why = max(tried, key=lambda each: each[1] - each[2])
            yield fault, since, force, allowed, why


def dead(_: argparse.Namespace) -> Iterator[Listing]:
    """Press with each dead sensor."""
    rows, met = [], True
    for case in itertools.product(ROBOTS, LIMITS, CHANNELS, (True, False)):
        for fault, since, force, allowed, why in worst(Case(*case)):
            met = met and force <= allowed
            noise = "declared" if case[-1] else "none"
            rows.append((*case[:-1], noise, fault, since, f"{force:.3g}", f"{allowed:.3g}", why[:60]))
    heads = ("robot", "limit N", "second channel", "noise", "sensor", "since s", "force N", "allowed N", "trip")
    yield Listing("force with a dead sensor", heads, rows, met)


PARTS = {"dead": dead}
