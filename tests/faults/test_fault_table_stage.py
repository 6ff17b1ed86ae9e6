"""Every fault of the table on the stage in MuJoCo, sweeping a sphere at 2 N: the arm has mass, and lags."""

from dataclasses import replace

import msgspec
import pytest

from faults.fault_checks import MOST_PERIODS, check_ending, check_rest, periods_until_safe
from faults.fault_rig import Commands, Limited, carry_out
from faults.fault_table import ANYWHERE, FASTEST_RETRACT, ON_A_SENSOR, RETRACT_DISTANCE, Fault, Reaction
from faults.stage_rig import (
    AT,
    FORCE,
    SENSED,
    SPEED,
    STAGE,
    away,
    digitised,
    nano17,
    plain_finger,
    sensor_finger,
    stage_rig,
)
from palpate.runtime.data import Phase
from palpate.runtime.result import Ending
from palpate.runtime.touch import SensorFinger
from palpate.sensing.ft import Butterworth
from palpate.spatial import norm, subtract

RESTS = 1e-3
"""[m/s]: what the loop calls rest."""

CASES = [(fault, plain_finger) for fault in ANYWHERE] + [(fault, sensor_finger) for fault in ON_A_SENSOR]


@pytest.mark.slow
@pytest.mark.parametrize(("fault", "finger"), CASES, ids=[fault.name for fault, _ in CASES])
def test_a_fault_ends_in_the_safe_state_within_two_periods(fault, finger):
    rig = stage_rig(finger())
    fault.injection.into(rig, AT)
    outcome = carry_out(rig)
    backend = rig.backend
    check_ending(outcome, fault, AT)
    assert outcome.log.record().phase[AT - 1] == Phase.SCAN
    assert norm(backend.commands[AT - 1].velocity_base_tip) > 0.5 * SPEED
    assert periods_until_safe(outcome, fault, AT, lambda index: away(rig, index)) <= MOST_PERIODS
    truth = backend.sound.truth()
    first = outcome.tripped_at(AT)
    gone = norm(subtract(backend.truly[-1].arm.position_base_tip, backend.truly[first].arm.position_base_tip))
    lag = STAGE.lag * (SPEED if fault.reaction is Reaction.STAND else FASTEST_RETRACT)
    assert gone <= (0.0 if fault.reaction is Reaction.STAND else RETRACT_DISTANCE) + lag + 1e-4
    if fault.name != "a device is lost for good":  # there, closing stops it
        assert norm(backend.truly[-1].arm.velocity_base_tip) < RESTS
    check_rest(outcome, norm(backend.truly[-1].arm.velocity_base_tip) < RESTS)
    assert norm(truth.force) < 1.5 * FORCE


RAM = Commands(lambda command: replace(command, velocity_base_tip=(0.0, 0.0, -0.02)))
"""The controller drives straight down whatever it feels."""


@pytest.mark.parametrize("limit", [4.0, 8.0])
def test_a_real_collision_is_drawn_back_from(limit):
    """Nothing is made up: the force grows until it is over the limit, and then falls below half of it."""
    fault = Fault("ram", RAM, "contact force", " N", Reaction.RETRACT)
    rig = stage_rig(plain_finger())
    Limited({"force": limit, "contact_speed": 0.1, "acceleration": 100.0}, RAM).into(rig, AT)
    outcome = carry_out(rig)
    assert outcome.result.ending is Ending.TRIPPED
    assert outcome.result.trip.measure == "contact force"
    assert outcome.result.at_rest
    assert periods_until_safe(outcome, fault, AT, lambda index: away(rig, index)) <= MOST_PERIODS
    felt = outcome.log.record().normal_force
    tripped = outcome.tripped_at(AT)
    assert felt[tripped] > 0.9 * limit
    # what the servos' lag still brings: ramming speed x lag x stiffness of the contact
    assert felt.max() < limit + 0.02 * STAGE.lag * 20e3
    assert norm(rig.backend.sound.truth().force) < 0.5 * limit
    assert felt[-20:].max() < 0.5 * limit  # at rest


@pytest.mark.parametrize("filters", [(), (Butterworth(30.0),)], ids=["unfiltered", "behind a filter"])
def test_a_sensor_that_is_really_pressed_into_saturation_is_drawn_out_of_it(filters):
    """Its converter clips at 5 N: it shows no more, however hard it is pressed, and a filter shows it late."""
    sensor, converter = digitised(msgspec.structs.replace(nano17(), filters=filters), 0.3)
    rig = stage_rig(SensorFinger(SENSED, sensor))
    converter.into(rig, 0)
    fault = Fault("saturated", RAM, "force/torque sensor 1", reaction=Reaction.RETRACT)
    Limited({"acceleration": 100.0}, RAM).into(rig, AT)
    outcome = carry_out(rig)
    assert outcome.result.trip.measure == "force/torque sensor 1"
    assert "raw reading at the end of its range" in outcome.result.trip.value
    assert outcome.result.at_rest
    assert periods_until_safe(outcome, fault, AT, lambda index: away(rig, index)) <= MOST_PERIODS
    assert norm(rig.backend.sound.truth().force) < 1.0


def test_a_path_that_would_leave_the_workspace_is_stopped_before_its_edge():
    edge = stage_rig(plain_finger())
    Limited({"workspace_upper": (-0.002, 1.0, 1.0)}).into(edge, AT)
    outcome = carry_out(edge)
    assert outcome.result.trip.measure == "tip position after a stop from its velocity"
    furthest = max(sample.arm.position_base_tip[0] for sample in edge.backend.truly)
    assert -0.002 - SPEED * STAGE.lag < furthest <= -0.002


def test_without_a_fault_there_is_no_trip():
    for finger in (plain_finger(), sensor_finger()):
        outcome = carry_out(stage_rig(finger))
        assert outcome.result.ending is Ending.TIME_UP
        assert outcome.result.trip is None
