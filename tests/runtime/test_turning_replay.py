"""A run that turns: log and replay keep every bit of the angular velocity, reported and commanded."""

import math
import struct
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.runtime.data import Command, Phase
from palpate.runtime.log import LogWriter, Recorder, read_log
from palpate.runtime.loop import run
from palpate.runtime.replay import replay
from palpate.runtime.replay_difference import difference_of_commands
from palpate.runtime.replay_extent import extent_of, rows_of_replay
from palpate.runtime.result import Ending
from palpate.runtime.supervision import Limits, Supervisor
from palpate.runtime.touch import Finger, Touch
from palpate.sim import ContactLaw, MujocoBackend, SphereObject, Tip, TurningStage, build_scene, white_noise
from palpate.surfaces import Sphere
from runtime.log.log_examples import ONE_FINGER, PERIOD, a_run, any_bits, bits, write

TIP = Tip(Sphere(0.008))
LIMITS = Limits(acceleration=1000.0, angular_acceleration=5000.0)


class Swaying:
    """Turns by what it feels and by how fast it turns: one bit in either is a bit in its commands."""

    def start(self, first):
        self.memory = 0.0

    def step(self, now):
        u, v, w = now.arm.angular_velocity_base_tip
        self.memory = 0.99 * self.memory + 1e-3 * now.fingers[0].wrench[0]
        rate = (0.3 * math.sin(7.0 * now.time) - 0.1 * u, 0.2 + 0.1 * w + self.memory, -0.0 - 0.3 * v)
        return Command((0.01 * w, 0.0, 0.002), Phase.SCAN, None, rate)


def touch():
    return Touch(Finger(TIP.surface))


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    file = tmp_path_factory.mktemp("turning") / "a.mcap"
    scene = build_scene(TIP, SphereObject(0.04), ContactLaw(), (0.0, 0.0, 0.1), TurningStage())
    backend = MujocoBackend(scene, sensor=white_noise(0.01, 1e-4, seed=1))
    recorder = Recorder(LogWriter(file))
    result = run(backend, touch(), Swaying(), Supervisor(LIMITS), duration=0.4, recorder=recorder)
    assert result.ending is Ending.TIME_UP
    return read_log(file)


def flipped(number):
    """The same but for one of its last bits: a hundred-trillionth of it."""
    (word,) = struct.unpack("<Q", struct.pack("<d", number))
    return struct.unpack("<d", struct.pack("<Q", word ^ 64))[0]


def samples_of(log):
    """The samples that can be replayed."""
    return list(log.samples())[: extent_of(log).count]


def difference(log, samples):
    """Commands of a replay of these samples against those of the log."""
    done = replay(samples, PERIOD, touch(), Swaying(), Supervisor(LIMITS), log.changes, truth=log.truth)
    return difference_of_commands(log, len(samples), done, rows_of_replay(done))


def test_a_replay_gives_the_same_turns_bit_for_bit(log):
    samples = samples_of(log)
    count, commands = len(samples), list(log.commands())[: len(samples)]
    found = difference(log, samples)
    assert (found.first, found.identical) == (None, count)
    assert max(math.hypot(*sample.arm.angular_velocity_base_tip) for sample in samples) > 0.2
    assert len({bits(command.angular_velocity_base_tip)[1] for command in commands}) > count - 5


@pytest.mark.parametrize("axis", range(3))
def test_one_flipped_bit_of_how_it_turned_is_found_in_its_command(log, axis):
    samples = samples_of(log)
    for row in range(50, len(samples), 70):
        arm = samples[row].arm
        rate = list(arm.angular_velocity_base_tip)
        rate[axis] = flipped(rate[axis])
        changed = replace(samples[row], arm=replace(arm, angular_velocity_base_tip=tuple(rate)))
        assert difference(log, [*samples[:row], changed, *samples[row + 1 :]]).first.row == row


@pytest.mark.slow
@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**31))
def test_any_64_bits_of_an_angular_velocity_come_back(seed):
    """Told and commanded: not a number, minus zero, and what is hardly one."""
    rng = np.random.default_rng(seed)
    periods = []
    for sample, now, command, *times in a_run(120, ONE_FINGER, seed):
        arm = replace(sample.arm, angular_velocity_base_tip=tuple(any_bits(rng, 3).tolist()))
        command = replace(command, angular_velocity_base_tip=tuple(any_bits(rng, 3).tolist()))
        periods.append((replace(sample, arm=arm), replace(now, arm=arm), command, *times))
    with tempfile.TemporaryDirectory() as folder:
        write(Path(folder) / "a.mcap", periods)
        log = read_log(Path(folder) / "a.mcap")
        samples, commands = list(log.samples()), list(log.commands())
    assert len(samples) == len(periods)
    for period, sample, command in zip(periods, samples, commands, strict=True):
        assert bits(sample.arm) == bits(period[0].arm)
        assert bits(command) == bits(period[2])
