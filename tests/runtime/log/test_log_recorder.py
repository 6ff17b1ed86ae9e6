"""The recorder: it never ends a run, never loses count, keeps order, hands over in time."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.runtime.data import Command, HandSample, WrenchSample
from palpate.runtime.log import Level, LogWriter, MemoryLog, Recorder, RecordingSummary, read_log
from palpate.runtime.log.chunk import PackedRows
from palpate.runtime.log.fields import Codes, period_groups, walk
from palpate.runtime.log.row_packer import any_packer, one_finger_packer
from runtime.log.log_examples import ONE_FINGER, PERIOD, SMALL, TWO_FINGERS_AND_A_HAND, a_run, bits, started
from runtime.puppets import sample, touch

WIDTH = sum(quantity.count for _, quantity in walk(period_groups(SMALL, Codes())))


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
    """Name, layout, and what does not fit it."""
    both, one = TWO_FINGERS_AND_A_HAND, ONE_FINGER
    ((s, now, command, _, _),) = a_run(1, both)
    first, second = s.wrenches
    yield (
        "channel less",
        both,
        (replace(s, wrenches=(replace(first, wrench=first.wrench[1:]), second)), now, command),
    )
    yield "finger less", both, (replace(s, wrenches=(first,)), now, command)
    yield "finger more", both, (replace(s, wrenches=(first, second, second)), now, command)
    yield "joint more", both, (replace(s, arm=replace(s.arm, joint_position=(0.0,) * 8)), now, command)
    yield "no hand", both, (replace(s, hand=None), now, command)
    yield "None for a number", both, (replace(s, wrenches=(replace(first, time=None), second)), now, command)
    yield "wrong shape", both, (s, now, Command((0.0, 0.0)))
    yield "too many grip forces", both, (s, now, replace(command, grip_force=(1.0,) * 4))
    yield "no command", both, (s, now, None)
    # as many numbers as before in all
    moved = (WrenchSample(0.0, (0.0,) * 7, (0.0,) * 3), WrenchSample(0.0, (0.0,) * 15, (0.0,) * 3))
    yield "channel of one finger at another", both, (replace(s, wrenches=moved), now, command)
    swapped = replace(s, arm=replace(s.arm, joint_position=(0.0,) * 6), hand=HandSample(0.0, (0.0,) * 4))
    yield "joint of the arm at the hand", both, (swapped, now, command)
    ((s, now, command, _, _),) = a_run(1, one)
    (given,), gripping = s.wrenches, replace(command, grip_force=(1.0,) * 3)
    less = replace(s.arm, joint_position=s.arm.joint_position[1:])
    short, long = (replace(given, wrench=w) for w in (given.wrench[1:], (*given.wrench, 0.0)))
    yield "hand beside one finger", one, (replace(s, hand=HandSample(0.0, (0.0,))), now, command)
    yield "joint as a channel", one, (replace(s, arm=less, wrenches=(long,)), now, command)
    yield "channel less, grip force more", one, (replace(s, wrenches=(short,)), now, gripping)
    yield "joint less, grip force more", one, (replace(s, arm=less), now, gripping)
    yield "fingers for one", one, (replace(s, wrenches=(given, given)), now, command)


@pytest.mark.parametrize(("name", "layout", "wrong"), list(misfits()), ids=[name for name, *_ in misfits()])
def test_a_period_that_does_not_fit_is_dropped_counted_and_reported(name, layout, wrong, tmp_path):
    periods = a_run(10, layout)
    recorder = started(periods, LogWriter(tmp_path / "a.mcap"))
    for i, period in enumerate(periods):
        recorder.record(*((*wrong, 0.0, 0.0) if i in (3, 4, 8) else period))
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
            ends = {
                packer(layout)(block, 8, *period)
                for packer, block in zip((one_finger_packer, any_packer), blocks, strict=True)
            }
            assert ends == {8 + 8 * sum(q.count for _, q in walk(period_groups(layout, Codes())))}
            assert blocks[0] == blocks[1]


def test_whole_numbers_are_numbers_too():
    """Python's ints pass where floats are meant, as in (0, 0, 1)."""
    memory = MemoryLog()
    s = sample(0, (0, 0, 2, 0, 0, 0), (0, 0, 1), (0, 0, 0))
    now = touch().sense(s)
    recorder = started([(s, now)], memory)
    recorder.record(s, now, Command((0, 1, 0)), 0, 0)
    assert recorder.close().rows_lost == 0
    assert memory.record().command.tolist() == [[0.0, 1.0, 0.0]]


def test_before_start_and_after_close_it_records_nothing_and_does_no_harm(tmp_path):
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
    unused = Recorder(MemoryLog(), LogWriter(tmp_path / "a.mcap")).close()
    assert (unused.rows_written, unused.rows_lost, unused.problem) == (0, 0, None)
    assert not (tmp_path / "a.mcap").exists()


def test_a_run_of_many_kinds_of_blocks_adds_up():
    """Full blocks, parts of blocks, dropped rows: every row is there once, in order."""
    rng = np.random.default_rng(1)
    watcher, (first,) = Watcher(), a_run(1, SMALL)
    recorder = started([first], watcher)
    numbers = []
    for i in range(3000):
        match rng.integers(0, 100):
            case 0:
                recorder.flush()
            case 1:
                recorder.event(0.0, Level.INFO, "test", "")
            case 2:
                recorder.record(first[0], None, *first[2:])
                continue
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
