"""The record is what was fed, contact quantities in base coordinates."""

import math
from dataclasses import replace

import numpy as np
import pytest

from palpate.runtime.data import Command, Phase
from palpate.runtime.log import MemoryLog
from palpate.sensing.contact import ContactStatus
from runtime.log.log_examples import started
from runtime.puppets import PERIOD, sample, touch

# a rotation with rational entries, neither symmetric nor about an axis of coordinates
ROTATION = ((0.8, 0.0, 0.6), (0.36, 0.8, -0.48), (-0.48, 0.6, 0.64))
POSITION = (0.3, -0.2, 0.1)


def recorded(*samples, fingers=1, commands=None):
    """The memory of some samples, and the periods as (sample, observation, command)."""
    memory, hand = MemoryLog(), touch(fingers)
    rows = [(s, hand.sense(s), c) for s, c in zip(samples, commands or [Command()] * len(samples), strict=True)]
    recorder = started(rows, memory)
    for row in rows:
        recorder.record(*row, 1e-5, 0.0)
    recorder.close()
    return memory, rows


def random_run(count):
    rng = np.random.default_rng(4)
    samples, commands = [], []
    for i in range(count):
        wrench = rng.normal(size=6) * np.repeat([2.0, 1e-3], 3)
        velocity, commanded = (tuple(each) for each in rng.normal(size=(2, 3)).tolist())
        samples.append(sample(0.25 * i, tuple(wrench.tolist()), POSITION, velocity, ROTATION))
        commands.append(Command(commanded, tuple(Phase)[i % len(Phase)]))
    memory, rows = recorded(*samples, commands=commands)
    return memory.record(), rows


def test_it_holds_what_was_fed_in_order():
    record, rows = random_run(20)
    assert len(record) == 20
    for i, (s, now, command) in enumerate(rows):
        finger = now.fingers[0]
        assert record.time[i] == s.time
        assert record.position[i].tolist() == list(s.arm.position_base_tip)
        assert record.velocity[i].tolist() == list(s.arm.velocity_base_tip)
        assert record.wrench[i].tolist() == list(finger.wrench)
        assert record.command[i].tolist() == list(command.velocity_base_tip)
        assert record.phase[i] == command.phase
        assert record.touching[i] == finger.touching
        assert record.status[i] == finger.contact.status
        assert record.normal_force[i] == finger.contact.normal_force
        assert record.spin_torque[i] == finger.contact.spin_torque


def test_contacts_are_given_in_base_coordinates():
    record, rows = random_run(20)
    R = np.array(ROTATION)
    for i, (_, now, _) in enumerate(rows):
        contact = now.fingers[0].contact
        assert record.centroid[i] == pytest.approx(POSITION + R @ contact.centroid, abs=1e-15)
        assert record.normal[i] == pytest.approx(R @ contact.normal, abs=1e-15)
        assert record.tangential_force[i] == pytest.approx(R @ contact.tangential_force, abs=1e-14)
        # the force adds up whatever the frame
        total = record.tangential_force[i] - record.normal_force[i] * record.normal[i]
        assert total == pytest.approx(R @ record.wrench[i, :3], abs=1e-13)
    on_tip = np.linalg.norm(record.centroid - POSITION, axis=1)
    assert on_tip == pytest.approx(np.full(20, 0.01))


@pytest.mark.parametrize(
    ("wrench", "status"),
    [
        ((0.0,) * 6, ContactStatus.NO_FORCE),
        ((math.nan,) + (0.0,) * 5, ContactStatus.INVALID),
        ((0.0, 0.0, 2.0, 1.0, 0.0, 0.0), ContactStatus.NO_CONTACT),
    ],
)
def test_without_a_contact_it_holds_nan_and_says_why(wrench, status):
    record = recorded(*[sample(0.25 * i, wrench, POSITION, rotation=ROTATION) for i in range(3)])[0].record()
    assert set(record.status) == {status}
    for name in ("centroid", "normal", "normal_force", "tangential_force", "spin_torque"):
        assert np.isnan(getattr(record, name)).all()
    assert not record.touching.any()
    assert np.isfinite(record.position).all()


def test_recording_may_be_read_and_go_on():
    memory, hand = MemoryLog(), touch()
    assert len(memory.record()) == 0
    assert (memory.record().centroid.shape, memory.record().wrench.shape) == ((0, 3), (0, 6))
    rows = [(s, hand.sense(s)) for s in map(sample, (0.0, 1.0, 2.0))]
    recorder = started(rows, memory)
    for i, row in enumerate(rows):
        recorder.record(*row, Command(), 0.0, 0.0)
        recorder.flush()
        assert memory.record().time.tolist() == [0.0, 1.0, 2.0][: i + 1]


def test_there_is_a_record_of_each_finger():
    wrenches = ((0.0, 0.0, 1.0, 0.0, 0.0, 0.0), (0.0, 3.0, 0.0, 0.0, 0.0, 0.0))
    memory, _ = recorded(sample(wrenches=wrenches), fingers=2)
    assert [memory.record(i).normal_force[0] for i in (0, 1)] == pytest.approx([1.0, 3.0])
    assert memory.record().normal_force[0] == pytest.approx(1.0)


def test_a_late_wrench_belongs_to_where_the_tip_was_when_it_was_sampled():
    """At a steady 20 mm/s, 18 ms late: 0.36 mm sideways that are not in the record."""
    late, samples = 0.018, []
    for time in (PERIOD * np.arange(30)).tolist():
        given = sample(time, (0.1, 0.2, -2.0, 0.0, 0.0, 0.0), (0.02 * time, 0.0, 0.0), (0.02, 0.0, 0.0), ROTATION)
        samples.append(replace(given, wrenches=(replace(given.wrenches[0], time=time - late),)))
    memory, rows = recorded(*samples)
    record, contacts = (
        memory.record(),
        [np.array(ROTATION) @ now.fingers[0].contact.centroid for _, now, _ in rows],
    )
    wanted = np.array(contacts) + np.outer(0.02 * np.maximum(PERIOD * np.arange(30) - late, 0.0), [1.0, 0.0, 0.0])
    np.testing.assert_allclose(record.centroid, wanted, atol=1e-12)
    np.testing.assert_allclose(record.time - record.wrench_time, late, atol=1e-12)
