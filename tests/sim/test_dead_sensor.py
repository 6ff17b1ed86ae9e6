"""A sensor that is dead, whatever it still reports, is found by name, without a sensor file."""

import itertools
from typing import Any, cast

import numpy as np
import pytest

from faults.dead_sensor import FAULTS, NOISE, RATIO, DeadSensor
from palpate.runtime import Supervisor, Touch, run
from palpate.runtime.replay import ReplayBackend
from palpate.runtime.result import Ending
from support.regulate_runs import planned

LIMIT, STIFFNESS = 20.0, 20e3


def regulation(robot, noise):
    return planned(
        robot=robot, duration=1.0, force_noise=noise, moment_noise=None if noise is None else RATIO * noise
    )


def carried_out(plan, backend, watch=None):
    observers = () if watch is None else (watch,)
    touch, supervisor = Touch(*plan.fingers), Supervisor(plan.limits)
    return run(backend, touch, plan.controller(), supervisor, duration=plan.longest_duration, observers=observers)


@pytest.mark.slow
@pytest.mark.parametrize("robot", ["stage", "ur5e-sim"])
@pytest.mark.parametrize("noise", [None, NOISE], ids=["noiseless", "noisy"])
def test_a_dead_sensor_cannot_press_harder_than_the_limit_allows(robot, noise):
    plan = regulation(robot, noise)
    for since, fault in itertools.product((0.0, 0.5, 1.2), FAULTS):
        backend, forces, speeds = cast("Any", plan.backend()), [], []

        def watch(sample, now, command, backend=backend, forces=forces, speeds=speeds):
            forces.append(float(np.linalg.norm(backend.truth().force)))
            speeds.append(float(np.linalg.norm(sample.arm.velocity_base_tip)))

        result = carried_out(plan, DeadSensor(backend, fault, since), watch)
        assert max(forces) <= 1.5 * LIMIT + max(speeds) * backend.period * STIFFNESS, (fault, since)
        if fault == "none":
            assert result.ending is Ending.DONE
        elif fault == "noise only":
            assert "difference between the contact force" in result.why or "arm itself measures" in result.why
        elif noise is not None and fault != "a tenth":
            assert "not changed" in result.why or "no channel has changed" in result.why


def test_a_replay_trips_over_the_same():
    plan, samples = regulation("stage", NOISE), []
    backend = DeadSensor(plan.backend(), "noise only", 1.0)
    first = carried_out(plan, backend, lambda sample, now, command: samples.append(sample))
    again = carried_out(plan, ReplayBackend(samples, backend.period))
    assert "difference between the contact force" in first.why
    assert again.trip == first.trip
