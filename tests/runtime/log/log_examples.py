"""Runs made up for the tests of the log: any layout, any 64 bits as a number, compared bit by bit."""

import dataclasses
import struct
from enum import Enum
from functools import lru_cache

import numpy as np

from palpate.runtime.data import (
    ArmSample,
    Command,
    FingerObservation,
    HandSample,
    Observation,
    Phase,
    Sample,
    WrenchSample,
)
from palpate.runtime.log import Layout, Level, LogWriter, Recorder
from palpate.sensing.contact import Contact, ContactStatus
from palpate.sensing.ft.health import HEALTHY, HealthCheck, SampleHealth

PERIOD = 1e-3
ONE_FINGER = Layout(6, None, (6,), 2)
SMALL = Layout(0, None, (1,), 2)
TWO_FINGERS_AND_A_HAND = Layout(7, 3, (6, 16), 3, tip_force=True)
FEELING = Layout(6, None, (6,), 2, tip_force=True)
SIDEWAYS = Layout(7, 4, (6, 6), 4, 2)


def any_bits(rng, count):
    """Doubles of any bit pattern, every fourth of them special."""
    values = rng.integers(0, 2**64, count, dtype=np.uint64).view(np.float64)
    special = np.array([0.0, -0.0, 5e-324, -5e-324, 2.3e-308, np.nan, -np.nan, np.inf, -np.inf, 1.0, -1.5e308])
    chosen = rng.integers(0, 4, count) == 0
    values[chosen] = rng.choice(special, int(chosen.sum()))
    return values


def one_period(rng, layout, time):
    """A period of random numbers; only its time is given."""

    def numbers(count):
        return tuple(any_bits(rng, count).tolist())

    def some(count, given_):
        return None if not count or rng.integers(2) else tuple(given_() for _ in range(rng.integers(0, count + 1)))

    rotation = (numbers(3), numbers(3), numbers(3))
    felt = numbers(3) if layout.tip_force else None
    arm = ArmSample(numbers(1)[0], numbers(3), rotation, numbers(3), numbers(layout.joints), numbers(3), felt)
    hand = None if layout.hand_joints is None else HandSample(numbers(1)[0], numbers(layout.hand_joints))
    wrenches = tuple(WrenchSample(numbers(1)[0], numbers(channels), numbers(3)) for channels in layout.channels)
    fingers = []
    for wrench in wrenches:
        status = ContactStatus(rng.choice(list(ContactStatus)))
        contact = Contact(*any_bits(rng, 9).reshape(3, 3), *numbers(1), any_bits(rng, 3), *numbers(2), status)
        health = HEALTHY if rng.integers(2) else SampleHealth(rng.choice(list(HealthCheck)))
        fingers.append(FingerObservation(wrench.time, numbers(6), contact, bool(rng.integers(2)), health))
    command = Command(
        numbers(3),
        Phase(rng.choice(list(Phase))),
        some(layout.grips, lambda: numbers(1)[0]),
        numbers(3),
        some(layout.finger_velocities, lambda: numbers(3) if rng.integers(2) else None),
    )
    return Sample(time, arm, wrenches, hand), Observation(time, arm, tuple(fingers), hand), command, *numbers(2)


@lru_cache(maxsize=20)
def a_run(count, layout=ONE_FINGER, seed=0, start=0.0):
    """`count` periods, a millisecond apart."""
    rng = np.random.default_rng(seed)
    return tuple(one_period(rng, layout, start + i * PERIOD) for i in range(count))


def feed(recorder, periods):
    """Record periods, and an event and a change now and then."""
    for i, period in enumerate(periods):
        if i % 97 == 50:
            recorder.event(period[0].time, Level.WARN, "test", f"event before period {i}")
        if i % 131 == 60:
            recorder.change(period[0].time, f"gain {i}", i + 0.1)
        recorder.record(*period)


def started(periods, *sinks, period=PERIOD):
    """A recorder that has begun with the first of some periods."""
    recorder = Recorder(*sinks)
    recorder.start(periods[0][0], periods[0][1], period)
    return recorder


def write(path, periods, attachments=None, **options):
    """Write a log; returns the summary."""
    recorder = started(periods, LogWriter(path, attachments or {}, **options))
    feed(recorder, periods)
    return recorder.close()


def bits(thing):
    """Everything in a piece of data, numbers by their 64 bits."""
    if thing is None or isinstance(thing, str | Enum):
        return [thing]
    if dataclasses.is_dataclass(thing):
        return [x for field in dataclasses.fields(thing) for x in bits(getattr(thing, field.name))]
    if isinstance(thing, tuple):
        return [len(thing), *(x for part in thing for x in bits(part))]
    return [struct.pack("<d", thing)]
