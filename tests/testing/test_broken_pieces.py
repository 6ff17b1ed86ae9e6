"""Pieces that are broken in one place each: every check finds it, and says what to mend."""

import math
import random
import threading
import time
from collections import deque
from dataclasses import replace
from functools import partial
from time import monotonic as present_time
from typing import ClassVar

import numpy as np
import pytest

from palpate.errors import InvalidValueError
from palpate.hw.devices import SensorReading
from palpate.kinematics.pose import rotation_from_rotvec
from palpate.runtime.data import Command, Phase
from palpate.spatial import ZERO, scale
from palpate.surfaces import Composite, Patch, Sphere
from palpate.surfaces.implicit import Implicit
from palpate.testing import (
    ConformanceError,
    SpringPlane,
    check_arm,
    check_backend,
    check_controller,
    check_hand,
    check_sensor,
    check_surface,
)
from testing.made_up import LOAD, NOISE, IdealArm, IdealHand, LoadedSensor

R = 0.01


def changed(base, **methods):
    """A class that differs from another one in some methods."""
    return type(f"Broken{base.__name__}", (base,), methods)


# -- fingertips --


class Formula(Implicit):
    """From plain functions of value and gradient, unchecked."""

    def __init__(self, value, gradient):
        object.__setattr__(self, "center", np.zeros(3))
        object.__setattr__(self, "rotation", np.eye(3))

        def evaluate(_, *point):
            p = np.array(point) / R
            return (value(p), *gradient(p) / R, *(np.array([2.0, 2.0, 2.0, 0.0, 0.0, 0.0]) / R**2))

        self._settle(evaluate, np.zeros(1), R)


def ball(p):
    return p @ p - 1.0


def bent(rotation):
    tip = Sphere(R)
    object.__setattr__(tip, "rotation", rotation)
    return tip


class Lax(Sphere):
    """Takes whatever it is given."""

    def __post_init__(self):
        try:
            super().__post_init__()
        except InvalidValueError:
            return


SIZES = deque([Sphere(R).packed, Sphere(2 * R).packed])


def another_size(self):
    SIZES.rotate()
    return SIZES[0]


def peanut():
    """Two balls that overlap, and a waist between them."""
    left, right = ([[sign, 0.0, 0.0, 0.0]] for sign in (1.0, -1.0))
    at = (0.7 * R, 0.0, 0.0)
    return Composite([Patch(Sphere(R, center=at), right), Patch(Sphere(R, center=scale(-1.0, at)), left)])


SURFACES = {
    "millimetres": (lambda: Sphere(8.0), "give lengths in metres, not in millimetres"),
    "no rotation": (lambda: bent(2.0 * np.eye(3)), "an orthonormal matrix"),
    "a reflection": (lambda: bent(np.diag([1.0, 1.0, -1.0])), "determinant 1"),
    "written to": (lambda: bent(np.eye(3)), "setflags(write=False)"),
    "gradient of another": (lambda: Formula(ball, lambda p: p * [2.0, 2.0, 3.0]), "the formula of the gradient"),
    "inwards": (lambda: Formula(ball, lambda p: -2.0 * p), "value grows outwards"),
    "dented": (peanut, "a convex surface"),
    "takes NaN": (lambda: Lax(R), "never a silent NaN"),
    "remembers": (
        lambda: changed(Sphere, packed=property(another_size, lambda self, value: None))(R),
        "state that the surface's functions keep",
    ),
}


# -- controllers --


class Press:
    """Goes down, then presses."""

    def start(self, first):
        self.periods = 0

    def step(self, now):
        self.periods += 1
        finger = now.fingers[0]
        if not finger.touching:
            return Command((0.0, 0.0, -0.01), Phase.APPROACH)
        return Command((0.0, 0.0, 0.01 * (finger.contact.normal_force - 1.0)))


def steps(step):
    """A controller that differs from `Press` by this."""
    return changed(Press, step=step)


def remembering(self, now, memory=[]):  # noqa: B006 on purpose
    memory.append(now.time)
    return Command((0.0, 0.0, -1e-6 * len(memory)))


def changing(self, now):
    object.__setattr__(now.fingers[0], "touching", True)
    return Press.step(self, now)


class Crowd(Press):
    """Counts the periods of all of its kind."""

    times: ClassVar = deque()

    def step(self, now):
        self.times.append(now.time)
        return Command((0.0, 0.0, -1e-6 * len(self.times)))


ONE = Press()
CONTROLLERS = {
    "a clock": (
        steps(lambda self, now: Command((0.0, 0.0, 1e-9 * time.perf_counter() % 1e-3))),
        "take the time from",
    ),
    "a clock by another name": (
        steps(lambda self, now: Command((0.0, 0.0, 1e-9 * present_time() % 1e-3))),
        "now.time",
    ),
    "millimetres": (steps(lambda self, now: Command(scale(1e3, Press.step(self, now).velocity_base_tip))), "mm/s"),
    "degrees": (steps(lambda self, now: Command(angular_velocity_base_tip=(0.0, 0.0, 20.0))), "degrees/s"),
    "the normal of no contact": (
        steps(lambda self, now: Command(0.001 * now.fingers[0].contact.normal)),
        "believed",
    ),
    "chance": (steps(lambda self, now: Command((random.random() * 1e-3, 0.0, 0.0))), "chance without a seed"),
    "a list of the class": (Crowd, "`.times` is one object in two controllers"),
    "a default argument": (steps(remembering), "kept outside of the instance"),
    "one for all": (lambda: ONE, "construct it in make"),
    "changes what it sees": (steps(changing), "observations as they were"),
    "opens a file": (
        steps(lambda self, now: open("/dev/null").close() or Press.step(self, now)),
        "files and printing to observers",
    ),
    "raises": (steps(lambda self, now: Press.step(self, now) if now.time < 0.02 else 1 / 0), "ZeroDivisionError"),
    "no command": (steps(lambda self, now: (0.0, 0.0, -0.01)), "return Command"),
}


# -- back ends --


def samples(change):
    """A back end whose samples are changed by a function of (sample, number)."""

    class Broken(SpringPlane):
        def _sample(self):
            return change(super()._sample(), self._count)

    return Broken


def other(piece, changes, *given):
    return replace(piece, **{name: change(piece, *given) for name, change in changes.items()})


def arms(**changes):
    """Likewise, fields of its arm's states, by a function of (state, number)."""
    return samples(lambda sample, k: replace(sample, arm=other(sample.arm, changes, k)))


def readings(**changes):
    """Likewise, of its readings."""
    return samples(lambda sample, k: replace(sample, wrenches=(other(sample.wrenches[0], changes, k),)))


noisy = partial(LoadedSensor.wrench, None)


class Restless(SpringPlane):
    """Is not stopped by `close`."""

    def close(self):
        self.coasting = self._velocity

    def step(self, command):
        return super().step(Command(getattr(self, "coasting", command.velocity_base_tip)))


class Crowded(SpringPlane):
    """All of its kind are at one place."""

    at: ClassVar = deque(maxlen=1)
    _position = property(lambda self: self.at[0], lambda self, position: self.at.append(position))


def forgiving(base, name, *instead):
    """Stands still where it should refuse."""

    def method(self, *given):
        try:
            return getattr(base, name)(self, *given)
        except InvalidValueError:
            return getattr(base, name)(self, *instead)

    return changed(base, **{name: method})


def never_at_rest(self, command):
    return SpringPlane.step(self, command if any(command.velocity_base_tip) else Command((0.0, 0.0, 0.005)))


BENT = np.round(rotation_from_rotvec((0.0, 1.2, 0.0)), 2).tolist()
BACKENDS = {
    "stamped when logged": (readings(wrench=lambda w, k: noisy(k // 2)), "not where it is logged"),
    "stamped at the start": (
        readings(time=lambda w, k: 0.0, wrench=lambda w, k: noisy(k)),
        "not once at the start",
    ),
    "ahead": (readings(time=lambda w, k: w.time + 1e-3), "no forecast, no other clock"),
    "another clock": (arms(time=lambda a, k: a.time - 1e9), "one clock"),
    "arm stamped when logged": (
        arms(position_base_tip=lambda a, k: (0.0, 0.0, 1e-5 * (k // 2))),
        "where it is logged",
    ),
    "moment before force": (readings(wrench=lambda w, k: LOAD[3:] + LOAD[:3]), "force comes before moment"),
    "N mm": (readings(wrench=lambda w, k: LOAD[:3] + scale(1e3, LOAD[3:])), "not in N mm"),
    "NaN": (readings(wrench=lambda w, k: (np.nan,) * 6), "never a silent NaN"),
    "gravity taken off": (readings(acceleration=lambda w, k: ZERO), "gravity not taken off"),
    "gravity downwards": (readings(acceleration=lambda w, k: (0.0, 0.0, -9.80665)), "points up"),
    "millimetres": (arms(position_base_tip=lambda a, k: scale(1e3, a.position_base_tip)), "not in millimetres"),
    "velocities in mm/s": (arms(velocity_base_tip=lambda a, k: scale(1e3, a.velocity_base_tip)), "is in m/s"),
    "velocities of the tip": (
        arms(velocity_base_tip=lambda a, k: a.velocity_base_tip[::-1]),
        "in base coordinates",
    ),
    "a rotation vector": (arms(rotation_base_tip=lambda a, k: (0.0, 0.0, 1.0)), "have to be converted"),
    "a bent rotation": (arms(rotation_base_tip=lambda a, k: BENT), "orthonormal"),
    "arrays": (arms(position_base_tip=lambda a, k: np.array(a.position_base_tip)), "plain tuples"),
    "milliseconds": (lambda: SpringPlane(1.0), "in seconds, not in milliseconds"),
    "two periods at once": (samples(lambda s, k: replace(s, time=2.0 * s.time)), "simulate exactly one period"),
    "swallowed exceptions": (changed(SpringPlane, __exit__=lambda self, *_: True), "return None from __exit__"),
    "no refusal": (forgiving(SpringPlane, "step", Command()), "check values where they come in"),
    "goes on": (changed(SpringPlane, step=never_at_rest), "a tip at rest"),
    "goes on after close": (Restless, "stop the arm itself"),
    "one place for all": (Crowded, "share nothing that changes"),
    "chance": (readings(wrench=lambda w, k: (random.gauss(0.0, 1.0), *LOAD[1:])), "seed its chance"),
}


# -- devices --


def wrenches(change):
    """A sensor that shows this of a wrench."""
    shown = lambda self, count: tuple(change(np.array(LoadedSensor.wrench(self, count))).tolist())  # noqa: E731
    return changed(LoadedSensor, wrench=shown)


def read(base, **changes):
    """A device of whose readings some fields are changed."""
    return changed(base, read=lambda self: other(base.read(self), changes))


class Queued(LoadedSensor):
    """Gives one record after the other, each once."""

    def start(self):
        super().start()
        self.next = self.sampled()[0]

    def read(self):
        newest, _ = self.sampled()
        self.next = min(self.next + 1, newest)
        return SensorReading(self.next / 500.0, self.wrench(self.next), True, 0)


class Threaded(LoadedSensor):
    """Leaves its thread behind."""

    def start(self):
        super().start()
        threading.Thread(target=time.sleep, args=(2.0,), daemon=True).start()


SENSORS = {
    "stamped when read": (read(LoadedSensor, time=lambda r: present_time()), "where it arrives from the wire"),
    "the time of day": (read(LoadedSensor, time=lambda r: time.time()), "neither time.time()"),
    "moment before force": (wrenches(lambda w: np.roll(w, 3)), "the moment stands before the force"),
    "its own load": (wrenches(lambda w: -w), "give what acts on its tip side"),
    "N mm": (wrenches(lambda w: w * [1, 1, 1, 1e3, 1e3, 1e3]), "moments are in N mm"),
    "mN": (wrenches(lambda w: 1e3 * w), "newtons and newton metres"),
    "NaN": (wrenches(lambda w: w * np.nan), "never a silent NaN"),
    "a queue": (Queued, "not the next one of a queue"),
    "no tare": (changed(LoadedSensor, tare=lambda self: None), "subtract the mean"),
    "reads before its start": (changed(LoadedSensor, up=True), "refuse until start"),
    "goes on after close": (changed(LoadedSensor, close=lambda self: None), "forget the newest reading in close"),
    "a thread": (Threaded, "end and join them in close"),
}


def askew(self, velocity, rate):
    IdealArm.move(self, velocity[::-1], rate)


ARMS = {
    "stamped when read": (read(IdealArm, time=lambda a: present_time()), "where it arrives from the wire"),
    "millimetres": (read(IdealArm, position_base_tip=lambda a: scale(1e3, a.position_base_tip)), "in m/s"),
    "degrees": (read(IdealArm, angular_velocity_base_tip=lambda a: (0.0, 0.0, 2.9)), "not in degrees"),
    "moves the tip's axes": (changed(IdealArm, move=askew), "in base coordinates"),
    "no refusal": (forgiving(IdealArm, "move", ZERO, ZERO), "never a silent NaN"),
    "goes on after close": (changed(IdealArm, close=lambda self: setattr(self, "up", False)), "rest after close"),
}


HANDS = {
    "the time of day": (read(IdealHand, time=lambda h: time.time()), "neither by time.time()"),
    "NaN": (read(IdealHand, joint_position=lambda h: (math.nan, 0.0)), "finite floats"),
    "a list": (read(IdealHand, joint_position=lambda h: [0.0, 0.0]), "a tuple of finite floats"),
    "encoder steps": (read(IdealHand, joint_position=lambda h: (4096.0 * h.time, 0.0)), "not in encoder steps"),
    "no refusal": (changed(IdealHand, press=lambda self, forces: None), "never a silent NaN"),
    "moves by NaN": (changed(IdealHand, move=lambda self, velocities: None), "name value, limit and remedy"),
    "never closes": (read(IdealHand, joint_position=lambda h: (0.0, 0.0)), "close until something is met"),
    "goes on after close": (changed(IdealHand, close=lambda self: None), "forget the newest reading in close"),
}


BROKEN = [
    (lambda make: check_surface(make()), SURFACES),
    (lambda make: check_controller(make, periods=300), CONTROLLERS),
    (check_backend, BACKENDS),
    (lambda make: check_sensor(make, NOISE, LOAD), pytest.mark.slow, SENSORS),
    (check_arm, pytest.mark.slow, ARMS),
    (lambda make: check_hand(make, 2), pytest.mark.slow, HANDS),
]


@pytest.mark.parametrize(
    ("check", "make", "words"),
    [
        pytest.param(check, make, words, id=name, marks=marks)
        for check, *marks, pieces in BROKEN
        for name, (make, words) in pieces.items()
    ],
)
def test_it_is_found_and_the_remedy_is_named(check, make, words):
    with pytest.raises(ConformanceError) as raised:
        check(make)
    assert words in str(raised.value)


def test_all_findings_are_listed_in_one_error():
    with pytest.raises(ConformanceError, match="breaks 3 rules") as raised:
        check_backend(arms(position_base_tip=lambda a, k: scale(1e4, a.position_base_tip)))
    assert len(raised.value.nonconformities) == 3
    assert all(
        word in str(raised.value) for each in raised.value.nonconformities for word in (each.seen, each.remedy)
    )
