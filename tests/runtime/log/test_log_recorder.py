"""The recorder: it never ends a run, never loses count, keeps order, hands over in time."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.runtime.data import Command, HandSample, WrenchSample
from palpate.runtime.log import Level, LogWriter, MemoryLog, Recorder, RecordingSummary, read_log
from palpate.runtime.log.chunk import PackedRows
from palpate.runtime.log.fields import Codes, period_groups, walk
from palpate.runtime.log.row_packer import any_packer, one_finger_packer
from runtime.log.log_examples import ONE_FINGER, PERIOD, SMALL, TWO_FINGERS_AND_A_HAND, a_run, bits
from runtime.puppets import sample, touch

WIDTH = sum(quantity.count for _, quantity in walk(period_groups(SMALL, Codes())))

PACKERS = (one_finger_packer, any_packer)


class Watcher:
    """A sink that remembers what it was handed, and when."""

    def __init__(self):
        self.heading, self.seen, self.closed = None, [], 0

    def start(self, heading):
        self.heading = heading

    def rows(self, rows):
        self.seen.append(rows)

    def entry(self, entry):
        self.seen.append(entry)

    def close(self):
        self.closed += 1
        return RecordingSummary()


def started(periods, *sinks, period=PERIOD):
    recorder = Recorder(*sinks)
    recorder.start(periods[0][0], periods[0][1], period)
    return recorder


def test_rows_are_handed_over_before_a_quarter_of_a_second_of_them_has_gathered():
    """However long the period is, and where the loop is slower than it should be: what a crash would cost."""
    for period, pace in ((1e-4, 1e-4), (1e-3, 1e-3), (0.01, 0.01), (0.3, 0.3), (1e-3, 0.02), (1e-3, 0.5)):
        watcher = Watcher()
        (first,) = a_run(1, SMALL)
        recorder = started([first], watcher, period=period)
        for i in range(round(3.0 / pace)):
            now = i * pace
            recorder.record(replace(first[0], time=now), *first[1:])
            handed = sum(len(x.data) for x in watcher.seen) // (8 * WIDTH)
            assert now - handed * pace <= 0.25 + pace  # since the first row that was not


def test_entries_keep_their_place_among_the_rows():
    watcher, periods = Watcher(), a_run(500)
    recorder = started(periods, watcher)
    for i, period in enumerate(periods):
        if i in (7, 200, 201):
            recorder.event(period[0].time, Level.INFO, "test", f"before {i}")
        recorder.record(*period)
    recorder.change(1.0, "gain", 2.0)
    recorder.close()
    size = sum(len(x.data) for x in watcher.seen if isinstance(x, PackedRows)) // 500
    before, place = [], 0
    for thing in watcher.seen:
        if isinstance(thing, PackedRows):
            assert thing.first == place
            place += len(thing.data) // size
        else:
            before.append((thing.sequence, place))
    assert before == [(0, 7), (1, 200), (2, 201), (3, 500)]


def misfits():
    (fit,) = a_run(1, TWO_FINGERS_AND_A_HAND)
    s, now, command, _, _ = fit
    first, second = s.wrenches
    yield "a channel less", (replace(s, wrenches=(replace(first, wrench=first.wrench[1:]), second)), now, command)
    yield "a finger less", (replace(s, wrenches=(first,)), now, command)
    yield "a finger more", (replace(s, wrenches=(first, second, second)), now, command)
    yield "a joint more", (replace(s, arm=replace(s.arm, joint_position=(0.0,) * 8)), now, command)
    yield "no hand", (replace(s, hand=None), now, command)
    yield "None for a number", (replace(s, wrenches=(replace(first, time=None), second)), now, command)
    yield "a wrong shape", (s, now, Command((0.0, 0.0)))
    yield "too many grip forces", (s, now, replace(command, grip_force=(1.0,) * 4))
    yield "no command", (s, now, None)
    # as many numbers as before in all
    moved = (WrenchSample(0.0, (0.0,) * 7, (0.0,) * 3), WrenchSample(0.0, (0.0,) * 15, (0.0,) * 3))
    yield "a channel of one finger at another", (replace(s, wrenches=moved), now, command)
    swapped = replace(s, arm=replace(s.arm, joint_position=(0.0,) * 6), hand=HandSample(0.0, (0.0,) * 4))
    yield "a joint of the arm at the hand", (swapped, now, command)


@pytest.mark.parametrize(("name", "wrong"), list(misfits()), ids=[name for name, _ in misfits()])
def test_a_period_that_does_not_fit_is_dropped_counted_and_reported(name, wrong, tmp_path):
    periods = a_run(10, TWO_FINGERS_AND_A_HAND)
    recorder = started(periods, LogWriter(tmp_path / "a.mcap"))
    for i, period in enumerate(periods):
        if i in (3, 4, 8):
            recorder.record(*wrong, 0.0, 0.0)
        else:
            recorder.record(*period)
    summary = recorder.close()
    assert (summary.rows_written, summary.rows_lost) == (7, 3)
    assert "3 periods did not fit the layout of the first" in summary.problem
    log = read_log(tmp_path / "a.mcap")
    assert log.sequence.tolist() == [0, 1, 2, 5, 6, 7, 9]
    assert [(gap.after, gap.count) for gap in log.gaps] == [(2, 2), (7, 1)]
    for number, found in zip(log.sequence, log.samples(), strict=True):
        assert bits(found) == bits(periods[number][0])


def test_one_finger_is_packed_as_any_number_is():
    for layout in (SMALL, ONE_FINGER):
        for period in a_run(50, layout):
            blocks = bytearray(1000), bytearray(1000)
            ends = {packer(layout)(block, 8, *period) for packer, block in zip(PACKERS, blocks, strict=True)}
            assert ends == {8 + 8 * sum(q.count for _, q in walk(period_groups(layout, Codes())))}
            assert blocks[0] == blocks[1]


ODD = (
    "a hand",
    "a joint as a channel",
    "a channel less, a grip force more",
    "a joint less, a grip force more",
    "fingers",
)


@pytest.mark.parametrize("name", ODD)
def test_with_one_finger_too_what_does_not_fit_is_dropped(name):
    memory, periods = MemoryLog(), a_run(1)
    s, now, command, *times = periods[0]
    (given,), arm = s.wrenches, s.arm
    wrong, sent = {
        "a hand": (replace(s, hand=HandSample(0.0, (0.0,))), command),
        "a joint as a channel": (
            replace(
                s,
                arm=replace(arm, joint_position=arm.joint_position[1:]),
                wrenches=(replace(given, wrench=(*given.wrench, 0.0)),),
            ),
            command,
        ),
        "a channel less, a grip force more": (
            replace(s, wrenches=(replace(given, wrench=given.wrench[1:]),)),
            replace(command, grip_force=(1.0,) * 3),
        ),
        "a joint less, a grip force more": (
            replace(s, arm=replace(arm, joint_position=arm.joint_position[1:])),
            replace(command, grip_force=(1.0,) * 3),
        ),
        "fingers": (replace(s, wrenches=(given, given)), command),
    }[name]
    recorder = started(periods, memory)
    recorder.record(wrong, now, sent, *times)
    assert recorder.close().rows_lost == 1
    assert len(memory.record()) == 0


def test_whole_numbers_are_numbers_too():
    """Python's ints pass where floats are meant, as in (0, 0, 1)."""
    memory = MemoryLog()
    s = sample(0, (0, 0, 2, 0, 0, 0), (0, 0, 1), (0, 0, 0))
    now = touch().sense(s)
    recorder = started([(s, now)], memory)
    recorder.record(s, now, Command((0, 1, 0)), 0, 0)
    assert recorder.close().rows_lost == 0
    assert memory.record().command.tolist() == [[0.0, 1.0, 0.0]]


def test_before_start_and_after_close_it_is_deaf_and_does_no_harm():
    watcher, periods = Watcher(), a_run(3)
    recorder = Recorder(watcher)
    recorder.record(*periods[0])
    recorder.event(0.0, Level.INFO, "test", "early")
    recorder.flush()
    recorder.start(periods[0][0], periods[0][1], PERIOD)
    recorder.record(*periods[0])
    summary = recorder.close()
    recorder.record(*periods[1])
    recorder.change(0.0, "late", 1.0)
    recorder.flush()
    assert len(watcher.seen) == 1
    assert recorder.close() is summary
    assert watcher.closed == 1


def test_it_is_closed_in_peace_if_it_never_started(tmp_path):
    summary = Recorder(MemoryLog(), LogWriter(tmp_path / "a.mcap")).close()
    assert (summary.rows_written, summary.rows_lost, summary.problem) == (0, 0, None)
    assert not (tmp_path / "a.mcap").exists()


def test_a_run_of_many_kinds_of_blocks_adds_up():
    """Full blocks, parts of blocks, dropped rows: every row is there once, in order."""
    rng = np.random.default_rng(1)
    watcher, (first,) = Watcher(), a_run(1, SMALL)
    recorder = started([first], watcher)
    numbers = []
    for i in range(3000):
        what = rng.integers(0, 100)
        if what == 0:
            recorder.flush()
        elif what == 1:
            recorder.event(0.0, Level.INFO, "test", "")
        if what == 2:
            recorder.record(first[0], None, *first[2:])
        else:
            numbers.append(i)
            recorder.record(replace(first[0], time=float(i)), *first[1:])
    recorder.close()
    found = []
    for rows in watcher.seen:
        if isinstance(rows, PackedRows):
            times = np.frombuffer(rows.data).reshape(-1, WIDTH)[:, 0]
            assert times.tolist() == list(range(rows.first, rows.first + len(times)))
            found += times.tolist()
    assert found == numbers
