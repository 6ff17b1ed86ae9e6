"""Pieces that are broken in one place each: every check finds it, and says what to mend."""

import random
import threading
import time
from collections import deque
from dataclasses import replace
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
    check_sensor,
    check_surface,
)
from testing.made_up import LOAD, NOISE, IdealArm, LoadedSensor

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


def slope(p):
    return 2.0 * p


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


class Moody(Sphere):
    """Is of another size every other time."""

    @property
    def packed(self):
        sizes = self.__dict__.setdefault("sizes", deque([Sphere(R).packed, Sphere(2 * R).packed]))
        sizes.rotate()
        return sizes[0]

    @packed.setter
    def packed(self, value):
        pass


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
    "remembers": (lambda: Moody(R), "state that the surface's functions keep"),
}


@pytest.mark.parametrize(("make", "words"), SURFACES.values(), ids=SURFACES)
def test_surfaces(make, words):
    with pytest.raises(ConformanceError) as raised:
        check_surface(make())
    assert words in str(raised.value)


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
    return Press.step(self, now)


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
    "one for all": (lambda: ONE, "construct it in make"),
    "changes what it sees": (steps(changing), "observations as they were"),
    "opens a file": (
        steps(lambda self, now: open("/dev/null").close() or Press.step(self, now)),
        "files and printing to observers",
    ),
    "raises": (steps(lambda self, now: Press.step(self, now) if now.time < 0.02 else 1 / 0), "ZeroDivisionError"),
    "no command": (steps(lambda self, now: (0.0, 0.0, -0.01)), "return Command"),
}


@pytest.mark.parametrize(("make", "words"), CONTROLLERS.values(), ids=CONTROLLERS)
def test_controllers(make, words):
    with pytest.raises(ConformanceError) as raised:
        check_controller(make, periods=300)
    assert words in str(raised.value)


# -- back ends --


def samples(change):
    """A back end whose samples are changed by a function of (sample, number)."""

    class Broken(SpringPlane):
        def _sample(self):
            return change(super()._sample(), self._count)

    return Broken


def arms(change):
    """Likewise, the states of its arm."""
    return samples(lambda sample, k: replace(sample, arm=change(sample.arm, k)))


def readings(change):
    """Likewise, its wrenches."""
    return samples(lambda sample, k: replace(sample, wrenches=(change(sample.wrenches[0], k),)))


def noisy(k):
    chance = random.Random(k)
    return tuple(mean + chance.gauss(0.0, sigma) for mean, sigma in zip(LOAD, NOISE, strict=True))


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


def forgiving(base):
    """Stands still where it should refuse."""

    def step(self, command):
        try:
            return base.step(self, command)
        except InvalidValueError:
            return base.step(self, Command())

    return changed(base, step=step)


TIPPED = rotation_from_rotvec((0.0, 1.2, 0.0))
BACKENDS = {
    "stamped when logged": (readings(lambda w, k: replace(w, wrench=noisy(k // 2))), "not where it is logged"),
    "stamped at the start": (
        readings(lambda w, k: replace(w, time=0.0, wrench=noisy(k))),
        "not once at the start",
    ),
    "ahead": (readings(lambda w, k: replace(w, time=w.time + 1e-3)), "no forecast, no other clock"),
    "another clock": (arms(lambda a, k: replace(a, time=a.time - 1e9)), "one clock"),
    "arm stamped when logged": (
        samples(lambda s, k: replace(s, arm=replace(s.arm, position_base_tip=(0.0, 0.0, 1e-5 * (k // 2))))),
        "not where it is logged",
    ),
    "moment before force": (
        readings(lambda w, k: replace(w, wrench=LOAD[3:] + LOAD[:3])),
        "force comes before moment",
    ),
    "N mm": (readings(lambda w, k: replace(w, wrench=(*LOAD[:3], *scale(1e3, LOAD[3:])))), "not in N mm"),
    "NaN": (readings(lambda w, k: replace(w, wrench=(np.nan,) * 6)), "never a silent NaN"),
    "gravity taken off": (readings(lambda w, k: replace(w, acceleration=ZERO)), "gravity not taken off"),
    "gravity downwards": (readings(lambda w, k: replace(w, acceleration=(0.0, 0.0, -9.8))), "points up"),
    "millimetres": (
        arms(lambda a, k: replace(a, position_base_tip=scale(1e3, a.position_base_tip))),
        "millimetres",
    ),
    "velocities in mm/s": (
        arms(lambda a, k: replace(a, velocity_base_tip=scale(1e3, a.velocity_base_tip))),
        "in m/s",
    ),
    "velocities of the tip": (
        arms(lambda a, k: replace(a, velocity_base_tip=a.velocity_base_tip[::-1])),
        "velocity_base_tip is in m/s, in base coordinates",
    ),
    "a rotation vector": (
        arms(lambda a, k: replace(a, rotation_base_tip=(0.0, 0.0, 1.0))),
        "have to be converted",
    ),
    "a bent rotation": (
        arms(lambda a, k: replace(a, rotation_base_tip=np.round(TIPPED, 2).tolist())),
        "orthonormal",
    ),
    "arrays": (arms(lambda a, k: replace(a, position_base_tip=np.array(a.position_base_tip))), "plain tuples"),
    "milliseconds": (lambda: SpringPlane(1.0), "in seconds, not in milliseconds"),
    "two periods at once": (
        samples(lambda s, k: replace(s, time=2.0 * s.time, arm=replace(s.arm, time=s.arm.time))),
        "simulate exactly one period",
    ),
    "swallowed exceptions": (changed(SpringPlane, __exit__=lambda self, *_: True), "return None from __exit__"),
    "no refusal": (forgiving(SpringPlane), "check values where they come in"),
    "goes on": (
        changed(
            SpringPlane,
            step=lambda self, c: SpringPlane.step(
                self, c if any(c.velocity_base_tip) else Command((0.0, 0.0, 0.005))
            ),
        ),
        "a tip at rest",
    ),
    "goes on after close": (Restless, "stop the arm itself"),
    "one place for all": (Crowded, "share nothing that changes"),
    "chance": (readings(lambda w, k: replace(w, wrench=(random.gauss(0.0, 1.0), *LOAD[1:]))), "seed its chance"),
}


@pytest.mark.parametrize(("make", "words"), BACKENDS.values(), ids=BACKENDS)
def test_back_ends(make, words):
    with pytest.raises(ConformanceError) as raised:
        check_backend(make)
    assert words in str(raised.value)


# -- devices --


def wrenches(change):
    """A sensor that shows this of a wrench."""
    return changed(
        LoadedSensor, wrench=lambda self, count: tuple(change(np.array(LoadedSensor.wrench(self, count))).tolist())
    )


def read(change):
    """A sensor whose readings are changed."""
    return changed(LoadedSensor, read=lambda self: change(LoadedSensor.read(self)))


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
    "stamped when read": (
        read(lambda r: replace(r, time=present_time())),
        "stamp a record where it arrives from the wire",
    ),
    "the time of day": (read(lambda r: replace(r, time=time.time())), "neither time.time()"),
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


@pytest.mark.slow
@pytest.mark.parametrize(("make", "words"), SENSORS.values(), ids=SENSORS)
def test_sensors(make, words):
    with pytest.raises(ConformanceError) as raised:
        check_sensor(make, NOISE, LOAD)
    assert words in str(raised.value)


def states(change):
    """An arm whose states are changed."""
    return changed(IdealArm, read=lambda self: change(IdealArm.read(self)))


ARMS = {
    "stamped when read": (states(lambda a: replace(a, time=present_time())), "stamp a record where it arrives"),
    "millimetres": (states(lambda a: replace(a, position_base_tip=scale(1e3, a.position_base_tip))), "in m/s"),
    "degrees": (
        states(lambda a: replace(a, angular_velocity_base_tip=scale(57.3, a.angular_velocity_base_tip))),
        "not in degrees",
    ),
    "moves the tip's axes": (
        changed(IdealArm, move=lambda self, v, w: IdealArm.move(self, v[::-1], w)),
        "in base coordinates",
    ),
    "no refusal": (
        changed(
            IdealArm,
            move=lambda self, v, w: IdealArm.move(self, v if np.isfinite(sum(v)) and len(v) == 3 else ZERO, w),
        ),
        "never a silent NaN",
    ),
    "goes on after close": (changed(IdealArm, close=lambda self: setattr(self, "up", False)), "rest after close"),
}


@pytest.mark.slow
@pytest.mark.parametrize(("make", "words"), ARMS.values(), ids=ARMS)
def test_arms(make, words):
    with pytest.raises(ConformanceError) as raised:
        check_arm(make)
    assert words in str(raised.value)


def test_all_findings_are_listed_in_one_error():
    with pytest.raises(ConformanceError, match="breaks 3 rules") as raised:
        check_backend(arms(lambda a, k: replace(a, position_base_tip=scale(1e4, a.position_base_tip))))
    assert len(raised.value.nonconformities) == 3
    assert all(
        word in str(raised.value) for each in raised.value.nonconformities for word in (each.seen, each.remedy)
    )
