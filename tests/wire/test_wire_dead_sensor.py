"""A fingertip's sensor that dies on an emulated UR5e: the TCP force that ur_rtde reads shows it."""

from dataclasses import replace

import msgspec
import numpy as np
import pytest

from palpate.experiments.regulate.config import RegulateConfig
from palpate.experiments.regulate.experiment import Regulate
from palpate.runtime import Supervisor, Touch, run
from palpate.runtime.result import Ending
from palpate.runtime.robot import load_robot
from support.dead_sensor import DeadSensor
from support.ur_library import needs_ur

pytestmark = needs_ur

LIMIT = 10.0


def regulated(fault, since):
    """Return how a regulation of 2 N over sockets went, at a quarter of the time, and the largest true force."""
    given = load_robot("emulated-ur5e")
    entry = msgspec.structs.replace(given.file.backend, address="127.0.9.61", time_scale=0.25)
    robot = replace(given, file=msgspec.structs.replace(given.file, backend=entry))
    plan, forces = Regulate().plan(RegulateConfig(robot="emulated-ur5e", duration=2.0), robot, {}), []
    limits = msgspec.structs.replace(plan.limits, force=LIMIT)
    backend = plan.backend()

    def watch(sample, now, command):
        force = np.linalg.norm(backend.truth().force)
        forces.append(float(force) if np.isfinite(force) else 0.0)

    result = run(
        DeadSensor(backend, fault, since),
        Touch(*plan.fingers),
        plan.controller(),
        Supervisor(limits),
        duration=plan.longest_duration,
        observers=(watch,),
    )
    return result, max(forces)


@pytest.mark.slow
def test_the_tcp_force_shows_what_a_dead_sensor_does_not():
    assert regulated("none", 0.0)[0].ending is Ending.DONE
    for fault, named in (("noise only", "that the arm itself measures"), ("zeros", "no channel has changed")):
        result, force = regulated(fault, 1.5)
        assert result.ending is Ending.TRIPPED
        assert named in result.why
        assert result.stopped
        assert force <= 1.5 * LIMIT
