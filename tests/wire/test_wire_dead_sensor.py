"""A fingertip's sensor that dies on an emulated UR5e: the TCP force that ur_rtde reads shows it."""

from dataclasses import replace
from typing import Any, cast

import msgspec
import numpy as np
import pytest

from faults.dead_sensor import DeadSensor
from palpate.experiments.regulate.config import RegulateConfig
from palpate.experiments.regulate.experiment import Regulate
from palpate.robots.robot import load_robot
from palpate.runtime import Supervisor, Touch, run
from palpate.runtime.result import Ending
from support.ur_library import needs_ur

pytestmark = needs_ur

LIMIT, STIFFNESS = 10.0, 20e3
PATIENCE = 0.5
"""[s] Age of samples, and from one to the next: a busy machine lets devices wait."""


ATTEMPTS = 3
"""A busy machine may lose a device of its own accord."""


def regulated(fault, since):
    """Return what came of the first attempt in which no device was lost."""
    for _ in range(ATTEMPTS):
        result, force, added = attempted(fault, since)
        if result.error is None:
            break
    return result, force, added


def attempted(fault, since):
    """Return how a regulation of 2 N over sockets went, at a quarter of the time.

    And the largest true force [N], and what the longest period, as the machine made it, may add to it [N].
    """
    given = load_robot("emulated-ur5e")
    entry = msgspec.structs.replace(given.file.backend, address="127.0.9.61", time_scale=0.25)
    limits = msgspec.structs.replace(given.file.limits, force=LIMIT, impact_force=None, sample_age=PATIENCE)
    robot = replace(given, file=msgspec.structs.replace(given.file, backend=entry, limits=limits))
    plan = Regulate().plan(RegulateConfig(robot="emulated-ur5e", duration=2.0), robot, {})
    backend, forces, times, speeds = cast("Any", plan.backend()), [], [], []

    def watch(sample, now, command):
        force = np.linalg.norm(backend.truth().force)
        forces.append(float(force) if np.isfinite(force) else 0.0)
        times.append(sample.time)
        speeds.append(float(np.linalg.norm(sample.arm.velocity_base_tip)))

    result = run(
        DeadSensor(backend, fault, since),
        Touch(*plan.fingers),
        plan.controller(),
        Supervisor(plan.limits),
        duration=plan.longest_duration,
        observers=(watch,),
    )
    return result, max(forces), max(np.diff(times)) * max(speeds) * STIFFNESS


@pytest.mark.slow
def test_the_tcp_force_shows_what_a_dead_sensor_does_not():
    assert regulated("none", 0.0)[0].ending is Ending.DONE
    for fault, named in (("noise only", "that the arm itself measures"), ("zeros", "no channel has changed")):
        result, force, added = regulated(fault, 1.5)
        assert result.ending is Ending.TRIPPED
        assert named in result.why
        assert result.at_rest
        assert force <= 1.5 * LIMIT + added
