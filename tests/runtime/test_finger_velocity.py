"""Velocities of a hand's fingertips on their way: supervised, logged, read back."""

import math
from dataclasses import replace

import numpy as np
import pytest

from palpate.controllers.grip.belief import KnownSurface
from palpate.controllers.grip.controller_sequence import ControllerSequence
from palpate.controllers.grip.lift import LiftController, LiftParameters
from palpate.controllers.grip.slip_safe import SlipSafeGrip
from palpate.controllers.grip.turn import TurnInHand, TurnParameters
from palpate.errors import InvalidValueError
from palpate.runtime.data import Command, HandSample, Phase
from palpate.runtime.log import Layout, LogWriter, Recorder, read_log
from palpate.runtime.loop import run
from palpate.runtime.replay import replay
from palpate.runtime.replay_difference import difference_of_commands
from palpate.runtime.replay_extent import extent_of, rows_of_replay
from palpate.runtime.result import Ending
from palpate.runtime.supervision import Limits, Supervisor
from palpate.sim import Lift, white_noise
from palpate.sim.hand.backend import HandBackend
from palpate.sim.hand.contact import GraspContact
from palpate.sim.hand.scene import build_grasp_scene
from palpate.sim.hand.turning_hand import turning_hand
from palpate.sim.objects.table import Table
from palpate.spatial import ZERO
from runtime.log.log_examples import PERIOD, a_run, bits, write
from support.turned_object import BRISTLES, KNOWN, RADIUS, SPHERE, touch_of

SIDEWAYS = Layout(7, 4, (6, 6), 4, 2)
CLOSING = Layout(7, 2, (6, 6), 2)
VELOCITIES = [((0.1, -0.2, 0.3), None), None, ((math.nan, -0.0, 1.0),) * 2, (None, (math.inf, 5e-324, 0.0)), ()]


def moving_run(count, seed=0):
    """Periods of a hand of two fingers, each with a joint sideways."""
    rng = np.random.default_rng(seed)
    for i, (sample, now, command, *times) in enumerate(a_run(count, SIDEWAYS, seed)):
        given = VELOCITIES[i] if i < len(VELOCITIES) else (None, tuple(rng.normal(size=3).tolist()))
        yield sample, now, replace(command, finger_velocity=None if i % 6 == 5 else given), *times


def test_they_come_back_bit_for_bit(tmp_path):
    periods = list(moving_run(300))
    summary = write(tmp_path / "a.mcap", periods)
    assert (summary.rows_written, summary.rows_lost) == (300, 0)
    log = read_log(tmp_path / "a.mcap")
    assert log.layout == SIDEWAYS
    for period, command in zip(periods, log.commands(), strict=True):
        assert bits(command) == bits(period[2])
    table = log.channels["/period"]["command"]
    for period, row in zip(periods, table, strict=True):
        given = period[2].finger_velocity
        assert row["finger_velocity_count"] == (-1 if given is None else 3 * len(given))
        if given is not None:
            flat = [number for velocity in given for number in velocity or (math.nan,) * 3]
            assert bits(tuple(row["finger_velocity"].tolist()[: len(flat)])) == bits(tuple(flat))


def test_of_a_hand_that_only_closes_none_is_logged(tmp_path):
    """No room is kept, and the period of a velocity that comes up is dropped."""
    periods = list(a_run(50, CLOSING))
    write(tmp_path / "a.mcap", periods)
    log = read_log(tmp_path / "a.mcap")
    assert log.layout == CLOSING
    assert "finger_velocity" not in log.channels["/period"]["command"].dtype.names
    assert all(command.finger_velocity is None for command in log.commands())
    periods[20] = (*periods[20][:2], replace(periods[20][2], finger_velocity=(ZERO, ZERO)), *periods[20][3:])
    assert write(tmp_path / "b.mcap", periods).rows_lost == 1


def test_room_is_kept_where_a_finger_has_a_second_joint():
    sample = a_run(1, CLOSING)[0][0]
    for joints, room in ((2, 0), (3, 2), (4, 2), (6, 2)):
        layout = Layout.of(replace(sample, hand=HandSample(0.0, (0.0,) * joints)))
        assert layout.finger_velocities == room
    assert Layout.of(replace(sample, hand=None)).finger_velocities == 0
    with pytest.raises(InvalidValueError):
        replace(SIDEWAYS, finger_velocities=-1)


def lifts_and_turns(hand):
    grip = SlipSafeGrip(3, KnownSurface(KNOWN), PERIOD)
    lift = LiftController(grip, PERIOD, LiftParameters(height=0.005, hold_time=0.1))
    return ControllerSequence(lift, TurnInHand(grip, hand, PERIOD, TurnParameters((0.05, 0.0))))


@pytest.mark.slow
def test_a_run_that_turns_an_object_replays_bit_for_bit(tmp_path):
    """Under the default limits, from opened fingers to DONE."""
    hand = turning_hand()
    law = GraspContact(friction=KNOWN.friction, spin_length=KNOWN.spin_length)
    scene = build_grasp_scene(hand, SPHERE, law, carrier=Lift(), table=Table(-RADIUS), friction=BRISTLES)
    backend, recorder = (
        HandBackend(scene, PERIOD, white_noise(0.01, 1e-4)),
        Recorder(LogWriter(tmp_path / "a.mcap")),
    )
    result = run(backend, touch_of(hand), lifts_and_turns(hand), Supervisor(), duration=8.0, recorder=recorder)
    assert result.ending is Ending.DONE
    log = read_log(tmp_path / "a.mcap")
    count = extent_of(log).count
    samples, commands = list(log.samples())[:count], list(log.commands())[:count]
    again = (touch_of(hand), lifts_and_turns(hand), Supervisor(), log.changes)
    done = replay(samples, PERIOD, *again, truth=log.truth)
    found = difference_of_commands(log, count, done, rows_of_replay(done))
    assert (found.first, found.identical) == (None, count)
    moving = [command for command in commands if command.finger_velocity]
    assert len(moving) > 500
    assert {command.phase for command in moving} == {Phase.SCAN, Phase.HOLD}


def supervised(*velocities, limits=None):
    supervisor, now = Supervisor(limits), a_run(1, SIDEWAYS)[0][1]
    supervisor.start(PERIOD)
    for velocity in velocities:
        command = Command(phase=Phase.SCAN, grip_force=(2.0, 2.0), finger_velocity=velocity)
        still = replace(now, time=0.0, arm=replace(now.arm, position_base_tip=ZERO, velocity_base_tip=ZERO))
        passed = supervisor.check(still, command)
    return supervisor, passed


def test_what_is_within_the_limit_passes_unchanged():
    supervisor, passed = supervised(((0.15, -0.2, 0.0), None), None, (ZERO, None), limits=Limits(speed=0.25))
    assert supervisor.trip is None
    assert passed.finger_velocity == (ZERO, None)


@pytest.mark.parametrize(
    "velocity",
    [
        (ZERO, (0.15, -0.2, 0.1)),
        ((math.nan, 0.0, 0.0), ZERO),
        (ZERO, (0.0, math.inf, 0.0)),
        (ZERO,),
        (ZERO,) * 3,
        [ZERO, ZERO],
        (0.1, 0.1),
        ((0.1, 0.1), ZERO),
        (),
    ],
)
def test_what_is_not_stops_the_fingers_and_keeps_the_grip(velocity):
    supervisor, passed = supervised((ZERO, ZERO), velocity, limits=Limits(speed=0.25))
    assert supervisor.trip is not None
    assert "finger" in supervisor.trip.measure
    assert passed.finger_velocity is None
    assert passed.grip_force in (None, (2.0, 2.0))
    assert supervisor.standstill() == Command(phase=Phase.STOP, grip_force=(2.0, 2.0))
