"""A sensor that is dead, whatever it still reports, is found by name, without a sensor file."""

from typing import Any, cast

import pytest
from dead_sensors import CHANNELS, Case, pressed

from faults.dead_sensor import FAULTS, NOISE, RATIO, DeadSensor, WithoutTipForce
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.kit.recorded_run import RecordedRun
from palpate.runtime import Supervisor, Touch, run
from palpate.runtime.following import CommandedMotion
from palpate.runtime.replay import ReplayBackend
from palpate.runtime.result import Ending
from palpate.runtime.servo_following import ServoFollowing
from support.explore_runs import plan_of
from support.regulate_runs import planned

LIMIT = 10.0


@pytest.mark.slow
@pytest.mark.parametrize("robot", ["stage", "ur5e-sim"])
@pytest.mark.parametrize("channel", CHANNELS)
@pytest.mark.parametrize("noisy", [False, True])
def test_a_dead_sensor_cannot_press_harder_than_the_limit_allows(robot, channel, noisy):
    for fault in FAULTS:
        for since in (0.0, 0.5, 1.2):
            force, allowed, why = pressed(Case(robot, LIMIT, channel, noisy), fault, since)
            assert force <= allowed, (fault, since)
            if fault == "none":
                assert why == ""
            elif fault == "noise only":
                assert "difference" in why or "itself measures" in why or "its sensor does not feel" in why
            elif noisy and fault != "a tenth":
                assert "not changed" in why or "no channel has changed" in why


@pytest.mark.slow
@pytest.mark.parametrize("robot", ["stage", "ur5e-nano17"])
def test_an_honest_sensor_goes_on_without_a_second_channel(robot):
    fields = {"robot": robot, "force": 6.0, "speed": 0.05}
    scan = plan_of(ExploreConfig(**fields, object="ellipsoid", friction=0.8, width=0.02, depth=0.004))
    for plan in (scan, planned(robot=robot, force=6.0, duration=1.0), planned(robot=robot, surface="sine")):
        assert RecordedRun(plan, WithoutTipForce(plan.backend())).run().ending is Ending.DONE


def test_only_an_arm_that_measures_no_force_is_compared_with_its_servo():
    plan = planned(robot="stage")
    arm = cast("Any", plan.backend()).start().arm
    assert type(plan.following(plan.period, arm)) is CommandedMotion
    arm = WithoutTipForce(plan.backend()).start().arm
    assert type(plan.following(plan.period, arm)) is ServoFollowing


def test_a_replay_trips_over_the_same():
    samples = []
    plan = planned(robot="stage", duration=1.0, force_noise=NOISE, moment_noise=RATIO * NOISE)
    first = run(
        DeadSensor(plan.backend(), "noise only", 1.0),
        Touch(*plan.fingers),
        plan.controller(),
        Supervisor(plan.limits),
        duration=plan.longest_duration,
        observers=(lambda sample, now, command: samples.append(sample),),
    )
    again = run(
        ReplayBackend(samples, plan.period),
        Touch(*plan.fingers),
        plan.controller(),
        Supervisor(plan.limits),
        duration=plan.longest_duration,
    )
    assert "difference between the contact force" in first.why
    assert again.trip == first.trip
