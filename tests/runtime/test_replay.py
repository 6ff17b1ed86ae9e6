"""Replays of anything that puppets do: the same samples give the same commands, and one bit less does not."""

import math
import os
import signal
import struct
from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.runtime.data import ArmSample, Command, HandSample, Phase, Sample, WrenchSample
from palpate.runtime.live import Change, LiveParameter, LiveParameters
from palpate.runtime.log import Event, Heading, Level, Log, LogWriter, MemoryLog, Recorder, read_log
from palpate.runtime.log.chunk import PERIOD_CHANNEL
from palpate.runtime.log.period_codec import PeriodCodec
from palpate.runtime.loop import run
from palpate.runtime.pacing import SimulatedTime
from palpate.runtime.replay import RecordedChanges, replay
from palpate.runtime.replay_difference import difference_of_commands, difference_of_sensing
from palpate.runtime.replay_extent import extent_of, rows_of_replay
from palpate.runtime.result import Ending, result_until
from palpate.runtime.supervision import Limits, Supervisor
from palpate.runtime.touch import Finger, Touch
from palpate.spatial import IDENTITY
from palpate.surfaces import Sphere

PERIOD = 1e-3
LIMITS = Limits(force=5.0, acceleration=1000.0, joint_lower=(-9.0, -9.0), joint_upper=(9.0, 9.0))
FINGERS = 2


# --- a robot with an arm of two joints, a hand and two fingers, that feels numbers made up for each period ---


def made_up(index, wrenches=None, **changes):
    """The sample of one period: nothing in it is round."""
    rng = np.random.default_rng(index)
    time = index * PERIOD
    push = [(0.3, -0.2, 2.0, 0.001, 0.002, 0.003), (0.1, 0.4, 1.5, -0.002, 0.001, 0.0)]
    felt = wrenches or [tuple((np.array(p) * rng.uniform(0.9, 1.1, 6)).tolist()) for p in push]
    arm = ArmSample(
        time,
        tuple(rng.uniform(-1e-3, 1e-3, 3).tolist()),
        IDENTITY,
        (0.0, 0.0, 0.0),
        tuple(rng.uniform(-1, 1, 2).tolist()),
    )
    hand = HandSample(time, tuple(rng.uniform(0, 1, 3).tolist()))
    acceleration = (0.0, 0.0, 9.81)
    made = Sample(time, arm, tuple(WrenchSample(time, one, acceleration) for one in felt), hand)
    return replace(made, **changes)


class Robot:
    """Says what is made up; `faults` maps a period to a sample or an exception."""

    def __init__(self, faults=None, hand=True):
        self.period, self.pacer, self.faults, self.index = PERIOD, SimulatedTime(), faults or {}, 0
        self.hand = hand

    def start(self):
        return self.next_sample()

    def step(self, command):
        self.index += 1
        return self.next_sample()

    def next_sample(self):
        found = self.faults.get(self.index) or made_up(self.index)
        if isinstance(found, Exception):
            raise found
        return found if self.hand else replace(found, hand=None)

    def close(self):
        pass

    def __enter__(self):
        return self

    def __exit__(self, kind, error, trace):
        self.close()


class Feeler:
    """Commands from what it feels and remembers; `faults` maps periods to what is done instead."""

    def __init__(self, faults=None, end=None):
        self.faults, self.end = faults or {}, end
        self.live = LiveParameters(LiveParameter("gain", 1e-3, 1e-4, 1e-2, 0.05, "m/s/N", "velocity per force"))

    def start(self, first):
        self.live.restart()
        self.index, self.memory = 0, 0.0

    def step(self, now):
        index, self.index = self.index, self.index + 1
        if index in self.faults:
            done = self.faults[index]
            return done() if callable(done) else done
        if self.end is not None and index >= self.end[0]:
            return Command(phase=self.end[1])
        finger, other = now.fingers
        self.memory = 0.9 * self.memory + 0.1 * finger.wrench[0] + 1e-3 * now.arm.joint_position[0]
        gain = self.live.value("gain")
        velocity = (gain * finger.contact.normal_force, -0.0 * self.memory, gain * (self.memory + other.wrench[3]))
        grip = None if index % 3 == 0 or now.hand is None else (1.0 + abs(self.memory), 0.0)
        return Command(velocity, Phase.SCAN, grip)


def touch():
    return Touch(*[Finger(Sphere(0.01))] * FINGERS)


class Noted(MemoryLog):
    """A log in memory that can be looked at as one read from a file."""

    def start(self, heading: Heading) -> None:
        super().start(heading)
        self.heading = heading

    def as_log(self, path="made up") -> Log:
        codec = PeriodCodec(self.heading, PERIOD_CHANNEL)
        rows = self.kept_rows()
        changes, events = tuple(self.changes), tuple(self.events)
        return Log(path, codec, {}, np.arange(len(rows)), rows, events, changes, None, True)


@dataclass
class Run:
    """A recorded run."""

    log: Log
    ending: Ending


def recorded(robot_faults=None, faults=None, end=None, periods=60, changes=(), observers=(), file=None, hand=True):
    """Run the robot; the log is read from a file, if one is named."""
    noted, controller = Noted(), Feeler(faults, end)
    for index, value in changes:
        ask = controller.faults.setdefault
        ask(index, lambda v=value: (controller.live.request("gain", v), Command((0.0, 0.0, 0.0), Phase.SCAN))[1])
    try:
        result = run(
            Robot(robot_faults, hand),
            touch(),
            controller,
            Supervisor(LIMITS),
            duration=periods * PERIOD,
            recorder=Recorder(noted) if file is None else Recorder(LogWriter(file)),
            observers=observers,
        )
    except KeyboardInterrupt as interruption:
        result = result_until(interruption)
    return Run(noted.as_log() if file is None else read_log(file), result.ending)


def replayed(log, faults=None, end=None):
    """Replay it; returns the differences of commands and of sensing, and the replay."""
    extent = extent_of(log)
    samples = list(log.samples())[: extent.count]
    done = replay(samples, log.heading.period, touch(), Feeler(faults, end), Supervisor(LIMITS), log.changes)
    rows = rows_of_replay(done)
    return (
        difference_of_commands(log, extent.count, done, rows),
        difference_of_sensing(log, extent.count, done, rows),
        done,
    )


def stop_here():
    os.kill(os.getpid(), signal.SIGINT)
    return Command((0.001, 0.0, 0.0), Phase.SCAN)


def raise_it():
    raise ZeroDivisionError("made up")


def hard(index):
    """More than the limit."""
    return made_up(index, [(0.1, 0.0, 7.0, 0.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0, 0.0, 0.0)])


NAN = made_up(30, [(0.1, 0.0, math.nan, 0.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0, 0.0, 0.0)])
SHORT = made_up(30, [(0.1, 0.0, 1.0), (0.0, 0.0, 1.0, 0.0, 0.0, 0.0)])
LATE = made_up(30, time=0.02)
GONE = made_up(35, [(0.1, 0.0, math.nan, 0.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0, 0.0, 0.0)])


@dataclass(frozen=True)
class Story:
    """How a run goes, how it ends, and how many of its periods can be replayed."""

    ending: Ending
    count: int
    robot: dict | None = None
    controller: dict | None = None
    end: tuple | None = None
    observed: int | None = None
    hand: bool = True


STORIES = {
    "done": Story(Ending.DONE, 41, end=(40, Phase.DONE)),
    "contact lost": Story(Ending.LOST, 41, end=(40, Phase.LOST)),
    "time up": Story(Ending.TIME_UP, 60),
    "Ctrl-C": Story(Ending.INTERRUPTED, 31, controller={30: stop_here}),
    # with the period of the trip
    "force over limit": Story(Ending.TRIPPED, 31, robot={30: hard(30)}),
    # and the way back, which is not finished at once: a wrench that is none ends it
    "retracts": Story(Ending.TRIPPED, 36, robot={i: hard(i) for i in range(30, 35)} | {35: GONE}, hand=False),
    "NaN in a sample": Story(Ending.TRIPPED, 31, robot={30: NAN}),
    "clock goes back": Story(Ending.TRIPPED, 31, robot={30: LATE}),
    "controller raises": Story(Ending.TRIPPED, 31, controller={30: raise_it}),
    "controller returns None": Story(Ending.TRIPPED, 31, controller={30: None}),
    "command of NaN": Story(Ending.TRIPPED, 31, controller={30: Command((math.nan, 0.0, 0.0))}),
    "jump": Story(Ending.TRIPPED, 31, controller={30: Command((3.0, 0.0, 0.0))}),
    # what no sample shows: up to there
    "device lost": Story(Ending.TRIPPED, 30, robot={30: OSError("no answer")}),
    "observer raises": Story(Ending.TRIPPED, 30, observed=30),
    "touch raises": Story(Ending.TRIPPED, 30, robot={30: SHORT}),
}


@pytest.mark.parametrize("name", STORIES)
def test_whatever_ended_a_run_its_commands_come_out_again_bit_for_bit(name, tmp_path):
    story, seen = STORIES[name], []

    def observe(sample, now, command):
        seen.append(None)
        if len(seen) == (story.observed or -2) + 1:
            raise_it()

    changes = ((10, 4e-3), (20, 2e-3))
    file = tmp_path / "a.mcap"
    faults = dict(story.controller or {})
    original = recorded(story.robot, faults, story.end, 60, changes, (observe,), file, story.hand)
    assert original.ending is story.ending
    assert extent_of(original.log).count == story.count
    assert len(original.log) > story.count, "how it came to rest was recorded too"
    assert [change.value for change in original.log.changes] == [4e-3, 2e-3]
    still = Command((0.0, 0.0, 0.0), Phase.SCAN)
    same = {30: Command((0.001, 0.0, 0.0), Phase.SCAN)} if name == "Ctrl-C" else story.controller or {}
    commands, sensing, done = replayed(original.log, same | {10: still, 20: still}, story.end)
    assert commands.first is None, str(commands.first)
    assert sensing.first is None, str(sensing.first)
    assert commands.identical == commands.count == story.count
    # the supervisor objects again where it did, and nowhere else
    inside = story.ending is Ending.TRIPPED and story.count > 30
    assert (done.trip is not None) == inside
    if inside:
        assert str(done.trip) == original.log.events[0].text


def test_a_device_that_is_lost_while_the_robot_retracts_ends_what_can_be_replayed():
    robot = {i: hard(i) for i in range(30, 40)} | {33: OSError("no answer")}
    log = recorded(robot, hand=False).log
    lost = replace(log, events=(*log.events, Event(0.033, Level.ERROR, "back end", "OSError: no answer")))
    assert extent_of(lost).count == 33
    commands, _, _ = replayed(lost)
    assert (commands.identical, commands.first) == (33, None)


def again(log, **changes):
    """Differences and replay of a log made with `LOG`'s controller."""
    return replayed(log, end=(50, Phase.DONE), **changes)


def with_number(row, column, change):
    """`LOG` with one of its numbers changed."""
    rows = LOG.rows.copy()
    rows[row, column] = change(rows[row, column])
    return replace(LOG, rows=rows)


def flip(bit):
    """Change one bit of a number."""
    return lambda number: (np.array([number]).view(np.uint64) ^ np.uint64(1 << bit)).view(np.float64)[0]


LOG = recorded(end=(50, Phase.DONE)).log
COLUMNS = [
    (LOG.codec.columns[f"finger_{finger}.reading"].start + i) for finger in range(FINGERS) for i in range(6)
]


@pytest.mark.slow
@settings(max_examples=80, deadline=None, derandomize=True)
@given(st.integers(0, 49), st.sampled_from(COLUMNS), st.integers(0, 63))
def test_one_flipped_bit_in_one_wrench_is_found_in_its_period(row, column, bit):
    _, sensing, _ = again(with_number(row, column, flip(bit)))
    assert sensing.first.row == row
    assert sensing.first.recorded != sensing.first.replayed


def test_a_flipped_bit_that_a_controller_uses_is_found_in_its_command():
    column = LOG.codec.columns["finger_0.reading"].start
    for row in range(0, 50, 7):
        # 1e-12 of the number: the controller's filter does not round that away
        commands, _, _ = again(with_number(row, column, flip(12)))
        assert commands.first.row in (row, row + 1)
        assert commands.first.name.startswith("command.")


@pytest.mark.parametrize(
    ("name", "before", "after"),
    [("velocity", 0.0, -0.0), ("velocity", math.nan, -math.nan), ("grip_force", 1.0, math.nextafter(1.0, 2.0))],
)
def test_zeros_and_nans_are_compared_by_their_bits(name, before, after):
    at = LOG.codec.columns[f"command.{name}"].start
    _, _, done = again(LOG)
    done.rows[7, at] = before
    same, other = (
        difference_of_commands(with_number(7, at, lambda _, new=new: new), 51, done, 51) for new in (before, after)
    )
    assert same.first is None
    assert (other.first.row, other.identical) == (7, 50)
    assert other.first.recorded != other.first.replayed


def test_a_log_with_a_gap_or_without_its_end_is_replayed_as_far_as_it_goes():
    kept = np.r_[0:20, 30 : len(LOG)]
    gappy = replace(LOG, sequence=LOG.sequence[kept], rows=LOG.rows[kept], damage="a chunk is damaged")
    extent = extent_of(gappy)
    assert extent.count == 20
    assert "periods 20 to 29 are missing" in extent.missing
    killed = replace(LOG, sequence=LOG.sequence[:37], rows=LOG.rows[:37], events=(), complete=False)
    for log, count in ((gappy, 20), (killed, 37)):
        commands, sensing, done = again(log)
        assert (commands.identical, commands.count, commands.first, sensing.first) == (count, count, None, None)
        assert done.reached_end


def test_a_replay_that_ends_sooner_has_fewer_commands_and_says_when():
    commands, _, done = replayed(LOG, end=(30, Phase.DONE))
    first = commands.first
    assert (first.row, first.name, commands.identical) == (30, "command.velocity.x", 30)
    assert rows_of_replay(done) == 31
    assert again(LOG, faults={30: raise_it})[0].identical == 30
    # where it differs last, there is nothing to compare any more
    shorter = difference_of_commands(LOG, 51, done, 30)
    assert str(shorter.first) == f"t = {LOG.rows[30, 0]:.3f} s (period 30): the replay had ended"


def test_phases_are_compared_by_name_however_a_log_numbers_them():
    """A log of a palpate whose enumeration had another order."""
    codes = LOG.heading.codes
    order = list(reversed(range(len(codes.phases))))
    renamed = replace(codes, phases=tuple(codes.phases[i] for i in order))
    rows = LOG.rows.copy()
    column = LOG.codec.columns["command.phase"].start
    rows[:, column] = [order.index(int(number)) for number in rows[:, column]]
    other = replace(LOG, codec=PeriodCodec(replace(LOG.heading, codes=renamed), PERIOD_CHANNEL), rows=rows)
    assert [found.first for found in again(other)[:2]] == [None, None]
    rows[3, column] = renamed.phases.index("SEEK")
    first = again(other)[0].first
    assert (first.row, first.name, first.recorded, first.replayed) == (3, "command.phase", "seek", "scan")


def test_changes_come_in_the_period_in_which_they_came_and_in_no_other():
    """Times as of any clock: a difference of times need not be exact."""
    for start in (0.0, 0.1, 1e9 + 0.3):
        live = LiveParameters(LiveParameter("gain", 1.0, 0.0, 9.0, 1e9, "", ""))
        times = [start + i * PERIOD for i in range(20)]
        again = RecordedChanges(live, [Change(times[7], "gain", 5.0), Change(times[7], "gain", 4.0)])
        took = [i for i, time in enumerate(times) if again.step(time)]
        assert took == [7]
        assert live.value("gain") == 4.0


def test_a_replay_can_be_interrupted_and_speaks_of_no_robot():
    with pytest.raises(KeyboardInterrupt) as stop:
        replay(LOG.samples(), PERIOD, touch(), Feeler({10: stop_here}), Supervisor(LIMITS))
    assert not stop.value.args


def test_all_64_bits_are_shown_of_what_differs():
    at = LOG.codec.columns["finger_1.wrench"].start
    log = with_number(12, at, lambda number: math.nextafter(number, math.inf))
    first = again(log)[1].first
    assert (first.row, first.name) == (12, "finger_1.wrench.fx")
    assert first.recorded.endswith(" N")
    before, after = (float(text.split()[0]) for text in (first.recorded, first.replayed))
    assert struct.pack("<d", before) == struct.pack("<d", log.rows[12, at])
    assert before != after
