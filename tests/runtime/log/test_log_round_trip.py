"""What comes out of a log is, bit for bit, what went in; palpate's reader and others' agree."""

import struct
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader
from mcap_ros2.decoder import DecoderFactory

from palpate.runtime.data import Phase
from palpate.runtime.log import Change, Event, Layout, Level, LogWriter, MemoryLog, read_log
from palpate.sensing.contact import ContactStatus
from palpate.sensing.ft.health import HealthCheck
from runtime.log.log_examples import (
    FEELING,
    ONE_FINGER,
    SMALL,
    TWO_FINGERS_AND_A_HAND,
    a_run,
    bits,
    feed,
    started,
    write,
)


@st.composite
def layouts(draw):
    hand_joints = draw(st.none() | st.integers(0, 4))
    channels = draw(st.lists(st.integers(1, 8), min_size=1, max_size=3))
    grips = max(2, hand_joints or 0, len(channels))
    return Layout(draw(st.integers(0, 8)), hand_joints, tuple(channels), grips)


@pytest.mark.slow
@settings(max_examples=15, deadline=None)
@given(layouts(), st.integers(0, 2**31), st.integers(1, 450), st.floats(-1e6, 1e6))
def test_samples_and_commands_come_back_bit_for_bit(layout, seed, count, start):
    periods = a_run(count, layout, seed, start)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.mcap"
        summary = write(path, periods)
        log = read_log(path)
    assert (summary.rows_written, summary.rows_lost, summary.problem) == (count, 0, None)
    assert (log.complete, log.damage, log.gaps) == (True, None, ())
    assert log.sequence.tolist() == list(range(count))
    for period, sample, command in zip(periods, log.samples(), log.commands(), strict=True):
        assert bits(sample) == bits(period[0])
        assert bits(command) == bits(period[2])


@pytest.mark.parametrize("layout", [ONE_FINGER, FEELING, SMALL, TWO_FINGERS_AND_A_HAND])
def test_what_touch_made_of_it_comes_back_too(layout, tmp_path):
    periods, attachments = a_run(300, layout), {"a.yaml": "", "nöte.txt": "µ\n" * 10_000}
    write(tmp_path / "a.mcap", periods, attachments)
    log = read_log(tmp_path / "a.mcap")
    assert log.attachments == attachments
    table = log.channels["/period"]
    for (_, now, _, compute_time, lateness), row in zip(periods, table, strict=True):
        assert row["compute_time"].tobytes() == struct.pack("<d", compute_time)
        assert row["lateness"].tobytes() == struct.pack("<d", lateness)
        for i, finger in enumerate(now.fingers):
            found, contact = row[f"finger_{i}"], finger.contact
            assert found["wrench"].tobytes() == struct.pack("<6d", *finger.wrench)
            for name in ("centroid", "normal", "tangential_force"):
                assert found[name].tobytes() == getattr(contact, name).tobytes()
            for name in ("normal_force", "spin_torque", "condition"):
                assert found[name].tobytes() == struct.pack("<d", getattr(contact, name))
            assert found["status"] == contact.status
            assert found["touching"] == finger.touching
            assert list(HealthCheck)[found["health"]] is finger.health.measure


def test_memory_and_file_give_the_same_record(tmp_path):
    periods = a_run(500, TWO_FINGERS_AND_A_HAND)
    memory = MemoryLog()
    recorder = started(periods, memory, LogWriter(tmp_path / "a.mcap"))
    feed(recorder, periods)
    recorder.close()
    log = read_log(tmp_path / "a.mcap")
    for finger in (0, 1):
        here, there = memory.record(finger), log.record(finger)
        for name in here.__slots__:
            assert getattr(here, name).tobytes() == getattr(there, name).tobytes(), name
    assert (tuple(memory.events), tuple(memory.changes)) == (log.events, log.changes)


def test_events_and_changes_come_back_in_order_with_exact_times(tmp_path):
    periods = a_run(3, start=1e9)  # where a double resolves 120 ns
    recorder = started(periods, LogWriter(tmp_path / "a.mcap"))
    events = [
        Event(1e9, Level.DEBUG, "", ""),
        Event(1e9 + 1e-6, Level.INFO, "µ source", "two\nlines, \0 and \U0001f916"),
        Event(1 / 3, Level.ERROR, "third", "no decimal fraction"),
        Event(float("inf"), Level.FATAL, "clock", "x" * 9000),
    ]
    changes = [Change(1e9 + 2**-20, "gain", -0.0), Change(1e9, "ζ", float("nan"))]
    for event, change in zip(events, [*changes, None, None], strict=True):
        recorder.event(event.time, event.level, event.source, event.text)
        if change is not None:
            recorder.change(change.time, change.name, change.value)
    recorder.event(0.0, Level.INFO, "test", "\ud800" + 20_000 * "é")
    recorder.close()
    log = read_log(tmp_path / "a.mcap")
    assert (log.complete, len(log)) == (True, 0)
    assert log.events[-1].text == "\\ud800" + 9_994 * "é"  # a text that is too long is cut, and no text is escaped
    assert bits(log.events[:-1]) == bits(tuple(events))
    assert bits(log.changes) == bits(tuple(changes))


@pytest.mark.slow
@pytest.mark.parametrize("layout", [ONE_FINGER, TWO_FINGERS_AND_A_HAND])
def test_the_mcap_library_reads_every_message_with_the_values_that_went_in(layout, tmp_path):
    periods = a_run(450, layout)
    write(tmp_path / "a.mcap", periods, {"experiment.yaml": "a: 1"})
    with (tmp_path / "a.mcap").open("rb") as file:
        assert len(list(StreamReader(file, validate_crcs=True).records)) > 450
        file.seek(0)
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        found = {"/period": [], "/event": [], "/parameter": []}
        for _, channel, message, decoded in reader.iter_decoded_messages(log_time_order=False):
            assert message.log_time == message.publish_time
            assert message.log_time == decoded.stamp.sec * 10**9 + decoded.stamp.nanosec
            found[channel.topic].append((message.sequence, decoded))
        statistics = reader.get_summary().statistics
        assert [x.name for x in reader.iter_attachments()] == ["palpate_log.json", "experiment.yaml"]
    assert statistics.message_count == sum(len(messages) for messages in found.values())
    assert [sequence for sequence, _ in found["/period"]] == list(range(450))
    for (sample, now, command, compute_time, lateness), (_, seen) in zip(periods, found["/period"], strict=True):
        assert bits(seen.time) == bits(sample.time)
        assert bits((seen.compute_time, seen.lateness)) == bits((compute_time, lateness))
        assert bits(tuple(seen.arm.joint_position)) == bits(sample.arm.joint_position)
        assert bits(tuple(seen.arm.rotation)) == bits(sum(sample.arm.rotation_base_tip, ()))
        assert bits(xyz(seen.arm.position)) == bits(sample.arm.position_base_tip)
        assert bits(xyz(seen.arm.velocity)) == bits(sample.arm.velocity_base_tip)
        if sample.hand is not None:
            assert bits(tuple(seen.hand[0].joint_position)) == bits(sample.hand.joint_position)
        for i, (wrench, finger) in enumerate(zip(sample.wrenches, now.fingers, strict=True)):
            logged = seen.fingers[i]
            assert bits(logged.time) == bits(wrench.time)
            assert bits(tuple(logged.reading)) == bits(wrench.wrench)
            assert bits(xyz(logged.acceleration)) == bits(wrench.acceleration)
            assert bits((*xyz(logged.wrench.force), *xyz(logged.wrench.torque))) == bits(finger.wrench)
            assert bits(xyz(logged.centroid)) == bits(tuple(finger.contact.centroid.tolist()))
            assert (logged.status, logged.touching) == (finger.contact.status, finger.touching)
        assert bits(xyz(seen.command.velocity)) == bits(command.velocity_base_tip)
        assert seen.command.grip_count == (-1 if command.grip_force is None else len(command.grip_force))
        given = command.grip_force or ()
        assert bits(tuple(seen.command.grip_force[: len(given)])) == bits(given)
        assert list(Phase)[seen.command.phase] is command.phase
    event = found["/event"][0][1]
    assert (event.level, event.name, event.msg) == (30, "test", "event before period 50")
    assert float(event.function) == periods[50][0].time
    parameter = found["/parameter"][0][1]
    assert (parameter.time, parameter.name, parameter.value) == (periods[60][0].time, "gain 60", 60.1)


def test_every_code_in_the_schema_has_its_name(tmp_path):
    write(tmp_path / "a.mcap", a_run(2))
    with (tmp_path / "a.mcap").open("rb") as file:
        schemas = {x.name: x.data.decode() for x in make_reader(file).get_summary().schemas.values()}
    text = schemas["palpate_msgs/msg/Period"]
    for i, phase in enumerate(Phase):
        assert f"uint8 PHASE_{phase.name}={i}\n" in text
    for status in ContactStatus:
        assert f"uint8 STATUS_{status.name}={status.value}\n" in text
    assert "# [m/s] of the tip frame's origin in base coordinates" in text
    assert set(schemas) == {"palpate_msgs/msg/Period", "rcl_interfaces/msg/Log", "palpate_msgs/msg/Parameter"}


def test_stamps_are_the_start_on_the_wall_clock_plus_the_sample_time(tmp_path):
    periods = a_run(1000, start=123.456)
    write(tmp_path / "a.mcap", periods)
    heading = read_log(tmp_path / "a.mcap").heading
    with (tmp_path / "a.mcap").open("rb") as file:
        stamps = [x.log_time for _, _, x in make_reader(file).iter_messages(["/period"])]
    assert np.diff(stamps).min() == np.diff(stamps).max() == 1_000_000
    assert stamps[0] == heading.wall_start


def xyz(vector):
    return (vector.x, vector.y, vector.z)
