"""What wanted micro-motions are made of: readings followed, speed held by grip alone, slip made up for."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.controllers.grip.belief import KnownSurface
from palpate.controllers.grip.hand_motion import MoveAlong, StandStill
from palpate.controllers.grip.in_turn import InTurn
from palpate.controllers.grip.motion_source import HandJoint, MotionReading, MotionTracker
from palpate.controllers.grip.pivot import PivotController, PivotParameters
from palpate.controllers.grip.slide import SLIDE_SERVO
from palpate.controllers.grip.slip_safe import SlipSafeGrip
from palpate.controllers.grip.slip_servo import SlipServo, SlipServoParameters
from palpate.errors import InvalidValueError
from palpate.friction.limit_surface import LimitSurface
from palpate.runtime.data import ArmSample, Command, FingerObservation, HandSample, Observation, Phase
from palpate.sensing.contact import Contact, ContactStatus
from palpate.spatial import IDENTITY, ZERO

PERIOD = 1e-3
SURFACE = LimitSurface(0.5, 0.004)
ARM = ArmSample(0.0, ZERO, IDENTITY, ZERO)
FINGER_0 = ((-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, -1.0))
"""Rotation of a sensor whose x points to -x of the hand and whose z points down."""


def seen(time, *joints, fingers=()):
    return Observation(time, ARM, fingers, HandSample(time, joints))


def finger(tangential, torque, normal=3.0):
    contact = Contact(
        centroid=np.zeros(3),
        normal=np.array([1.0, 0.0, 0.0]),
        force=np.array([-normal, *tangential]),
        normal_force=normal,
        tangential_force=np.array([0.0, *tangential]),
        spin_torque=torque,
        condition=1.0,
        status=ContactStatus.OK,
    )
    return FingerObservation(0.0, (-normal, *tangential, torque, 0.0, 0.0), contact, True)


# --- where the object is


@given(st.floats(-2.0, 2.0), st.floats(-1.0, 1.0), st.floats(0.01, 0.1), st.integers(1, 5), st.floats(0.0, 2e-3))
def test_a_steady_motion_is_followed_without_lag_however_late_and_rare_its_readings(
    start, rate, smoothing, every, age
):
    tracker, time = MotionTracker(smoothing), 0.0
    for i in range(round(25 * smoothing / PERIOD) + 1):
        time = i * PERIOD
        at = every * PERIOD * (i // every) - age
        tracker.step(time, MotionReading(at, start + rate * at))
    assert tracker.value == pytest.approx(start + rate * time, abs=1e-5)
    assert tracker.rate == pytest.approx(rate, abs=1e-3)
    assert tracker.silent < every * PERIOD + age + 1e-9


def test_noise_comes_through_as_stated():
    generator, tracker, dt, smoothing = np.random.default_rng(1), MotionTracker(0.025), 2e-3, 0.025
    values, rates = [], []
    for i, noise in enumerate(generator.standard_normal(40000)):
        tracker.step(i * dt, MotionReading(i * dt, float(noise)))
        values.append(tracker.value)
        rates.append(tracker.rate)
    assert np.std(values) == pytest.approx(math.sqrt(1.25 * dt / smoothing), rel=0.1)
    assert np.std(rates) == pytest.approx(math.sqrt(dt / (4.0 * smoothing**3)), rel=0.1)


def test_a_reading_given_again_says_nothing_new():
    once, often = MotionTracker(0.02), MotionTracker(0.02)
    for i in range(200):
        reading = MotionReading(2e-3 * (i // 2), math.sin(0.01 * (i // 2)))
        often.step(i * 1e-3, reading)
        once.step(i * 1e-3, reading if i % 2 == 0 else None)
    assert (once.value, once.rate) == pytest.approx((often.value, often.rate), abs=1e-15)


def test_a_hand_that_does_not_tell_is_refused_and_a_broken_reading_is_none():
    with pytest.raises(InvalidValueError, match="2 joints"):
        HandJoint(2).read(seen(0.0, 0.1, 0.2))
    with pytest.raises(InvalidValueError, match="0 or above"):
        HandJoint(-1)
    assert HandJoint(2).read(seen(0.0, 0.1, 0.2, math.nan)) is None
    assert HandJoint(2).read(Observation(0.0, ARM, ())) is None
    assert HandJoint(2).read(seen(0.5, 0.1, 0.2, 0.3)) == MotionReading(0.5, 0.3)


# --- speed by grip


class Sliding:
    """A block of unit weight between two fingers: it slips where grip is below what bears it, as Coulomb says."""

    def __init__(self, authority, needed, lag=0.015):
        self.authority, self.needed, self.keep = authority, needed, math.exp(-PERIOD / lag)
        self.grip, self.way, self.rate, self.fastest = 2.0 * needed, 0.0, 0.0, 0.0

    def step(self, grip):
        self.grip = self.keep * self.grip + (1.0 - self.keep) * grip
        pull = self.authority * (1.0 - self.grip / self.needed)
        self.rate = max(0.0, self.rate + PERIOD * pull)
        self.way += PERIOD * self.rate
        self.fastest = max(self.fastest, self.rate)


@pytest.mark.parametrize("share", [0.5, 1.0])
@pytest.mark.parametrize(("needed", "believed"), [(0.5, 0.9), (2.0, 1.0), (4.0, 1.2)])
def test_the_speed_is_held_until_shortly_before_the_end_whatever_is_needed_and_believed(share, needed, believed):
    """The authority may be less than said, the belief too small or too large."""
    servo = SlipServo(SLIDE_SERVO, PERIOD)
    block, way = Sliding(share * SLIDE_SERVO.authority, needed), 0.02
    servo.start(2.0 * needed, 1.06 * believed * needed)
    times = []
    for i in range(15000):
        block.step(servo.step(way - block.way, block.rate, 0.3 * needed))
        times += [i * PERIOD] if 0.005 < block.way < 0.015 else []
        if block.way >= way:
            break
    assert block.way >= way
    assert 0.01 / (times[-1] - times[0]) == pytest.approx(0.01, rel=0.2 / share)
    assert block.fastest < 0.02
    assert block.rate < 0.7 * block.fastest  # slow before the end


def test_it_never_lets_go_below_the_least():
    servo = SlipServo(SlipServoParameters(0.5, 1.0, 200.0), PERIOD)
    servo.start(3.0, 2.0)
    assert min(servo.step(1.0, 0.0, 1.7) for _ in range(20000)) == 1.7


def test_what_slips_already_is_not_let_go_further():
    servo = SlipServo(SlipServoParameters(0.5, 1.0, 200.0), PERIOD)
    servo.start(3.0, 1.0)
    assert servo.step(1.0, 1.0, 0.5) > 3.0


# --- the hand


@given(st.floats(0.1, 1.0), st.floats(1e-3, 8e-3), st.floats(0.0, 2.0 * math.pi))
def test_the_hand_goes_against_the_slip_by_e_squared_over_the_lever(force, torque, heading):
    """v / omega = e^2 f_t / tau, against the force that drags the finger; the second spins the other way."""
    along = MoveAlong(KnownSurface(SURFACE), (FINGER_0, FINGER_0), largest_speed=1.0)
    drag = (force * math.cos(heading), force * math.sin(heading))
    now = seen(0.0, fingers=(finger(drag, torque), finger(drag, -torque)))
    speed = 0.1 * SURFACE.spin_length**2 * force / torque
    wanted = (0.0, -speed * math.cos(heading), speed * math.sin(heading))
    assert along.velocity(now, 0.1) == pytest.approx(wanted, abs=1e-12)
    assert along.velocity(now, -0.1) == pytest.approx(tuple(-x for x in wanted), abs=1e-12)
    assert StandStill().velocity(now, 0.1) == ZERO


def test_the_hand_never_goes_faster_than_it_may_and_stands_without_spin():
    along = MoveAlong(KnownSurface(SURFACE), (FINGER_0,), largest_speed=0.01)
    assert math.hypot(*along.velocity(seen(0.0, fingers=(finger((1.0, 0.0), 1e-6),)), 1.0)) == pytest.approx(0.01)
    assert along.velocity(seen(0.0, fingers=(finger((1.0, 0.0), 0.0),)), 1.0) == ZERO


@pytest.mark.parametrize("glitch", [False, True])
def test_a_finger_that_feels_nothing_for_a_moment_does_not_end_a_pivot(glitch):
    """Which way the weight turns the object is told by all other samples."""
    grip = SlipSafeGrip(2, KnownSurface(SURFACE), PERIOD)
    pivot = PivotController(grip, KnownSurface(SURFACE), HandJoint(2), PERIOD, PivotParameters(0.5))
    nothing = replace(finger((math.nan, math.nan), math.nan, math.nan), touching=False)
    first = seen(0.0, 0.0, 0.0, 0.0, fingers=(finger((0.5, 0.0), 2e-3), finger((0.5, 0.0), -2e-3)))
    pivot.start(first)
    for i in range(300):
        one = nothing if glitch and i == 50 else first.fingers[0]
        pivot.step(seen(i * PERIOD, 0.0, 0.0, 0.0, fingers=(one, first.fingers[1])))
    assert pivot.phase is Phase.SCAN


# --- one after another


class Says:
    """Ends with a phase after some steps."""

    def __init__(self, phase, after):
        self.phase, self.after, self.started = phase, after, 0

    def start(self, first):
        self.started, self.count = self.started + 1, 0

    def step(self, now):
        self.count += 1
        return Command(phase=self.phase if self.count >= self.after else Phase.HOLD)


def test_each_begins_where_the_one_before_was_done_and_a_loss_ends_all():
    first, second, third = Says(Phase.DONE, 2), Says(Phase.LOST, 2), Says(Phase.DONE, 1)
    both = InTurn(first, second, third)
    both.start(seen(0.0))
    phases = [both.step(seen(0.0)).phase for _ in range(4)]
    assert phases == [Phase.HOLD, Phase.HOLD, Phase.LOST, Phase.LOST]
    assert (first.started, second.started, third.started) == (1, 1, 0)
    with pytest.raises(InvalidValueError, match="at least one"):
        InTurn()
