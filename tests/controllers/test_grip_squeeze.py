"""Friction and zeros that are wrong while an object is held: squeeze tests, bounds, zeros that wander."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.controllers.grip.belief import KnownSurface
from palpate.controllers.grip.followed_zeros import FollowedZeros
from palpate.controllers.grip.hanging_load import MeasuredLoad
from palpate.controllers.grip.parameters import GripParameters
from palpate.controllers.grip.slip_bounded_surface import LEAST_LEFT, REGAINS, SlipBoundedSurface
from palpate.controllers.grip.slip_safe import SlipSafeGrip
from palpate.controllers.grip.squeeze_test import LASTS, SQUEEZE, Answer, SqueezeTest
from palpate.controllers.grip.zero_wander import TipOnSensor, ZeroWander
from palpate.friction.contact_load import ContactLoad
from palpate.friction.limit_surface import LimitSurface
from palpate.runtime.data import ArmSample, FingerObservation, Observation
from palpate.sensing.ft.health import HEALTHY
from palpate.sensing.solver import contact_from_wrench
from palpate.spatial import IDENTITY, ZERO
from palpate.surfaces import Sphere

PERIOD, NOISE = 1e-3, 0.014

SLIPPERY = LimitSurface(0.6, 0.004)


def answer(load_of, seed):
    """Answer of a squeeze test after 0.2 s; `load_of` gives the load at a relative grip."""
    generator, test, grip = np.random.default_rng(seed), SqueezeTest(2, PERIOD), 4.0
    for k in range(200 + round(LASTS / PERIOD) + 2):
        if k == 200:
            assert test.steady
            test.begin(k * PERIOD)
        grip += 0.08 * (4.0 * (1.0 + SQUEEZE * test.active) - grip)
        load = MeasuredLoad(load_of(grip / 4.0) + NOISE * generator.standard_normal(), NOISE)
        found = test.step(k * PERIOD, (load,), grip)
        if found is not None:
            return found
    raise AssertionError("no answer")


@given(st.integers(0, 10**6), st.floats(1.0, 3.0))
@settings(max_examples=20, deadline=None)
def test_friction_follows_the_grip_and_a_load_does_not(seed, load):
    """A load that is about to grow is not tested."""
    assert answer(lambda grip: load * grip, seed) is Answer.SLIDES
    assert answer(lambda grip: load, seed) is not Answer.SLIDES
    test = SqueezeTest(2, PERIOD)
    for k in range(100):
        test.step(k * PERIOD, (MeasuredLoad(1.0 + 0.002 * k, NOISE),), 4.0)
    assert not test.steady


# --- bounds


def bounded():
    surface = SlipBoundedSurface(KnownSurface(SLIPPERY))
    surface.watch(0.0, (None, None), (False, False))
    return surface


@given(st.floats(0.05, 0.59), st.floats(0.0, 0.59))
def test_a_slip_bounds_both_frictions_and_is_taken_back(shown, carried):
    """The finger that slips shows its friction; the other one may have lost the same share."""
    surface, first = bounded(), max(shown, LEAST_LEFT * SLIPPERY.friction)
    surface.keep()
    surface.show((shown, math.inf), (shown, carried))
    assert surface.surface(0).friction == pytest.approx(first)
    assert surface.surface(1).friction == pytest.approx(min(max(first, carried), SLIPPERY.friction))
    surface.take_back()
    assert surface.surface(0) == surface.surface(1) == SLIPPERY


def test_a_bound_rises_at_once_to_what_is_borne_and_beyond_slowly_and_ever_slower():
    surface, gained = bounded(), []

    def carried(ratio, second):
        load = ContactLoad(2.0, (ratio * 2.0, 0.0, 0.0), 0.0)
        for i in range(1, 1001):
            surface.watch(second + i * PERIOD, (load, load), (False, False))
        return surface.surface(0).friction

    for second in range(3):
        surface.keep()
        surface.show((0.4, 0.4), (0.4, 0.4))
        at = surface.surface(0).friction
        gained.append(carried(0.5 * at, second) / at - 1.0)
    assert gained == pytest.approx([1.0 / REGAINS, 0.5 / REGAINS, 0.25 / REGAINS], rel=0.05)
    assert carried(0.5, 3.0) == pytest.approx(0.5, rel=0.01)


WANDER = ZeroWander(1e-3, 1e-5)

RADIUS, CENTER = 0.008, (0.0, 0.0, 0.012)

TIP, BALL = TipOnSensor(RADIUS, CENTER), Sphere(RADIUS, center=CENTER)

SURFACE = LimitSurface(0.5, 0.004)

NOISELESS = (1e-6, 1e-6, 1e-6, 1e-8, 1e-8, 1e-8)

SIGNS = st.lists(st.sampled_from((-1.0, 1.0)), min_size=12, max_size=12).map(lambda s: np.reshape(s, (2, 6)))


def wrench(normal=2.0, down=0.5, spin=1e-3):
    """The wrench of a finger that presses along x and carries a load and a torque."""
    f = np.array([-normal, 0.0, -down])
    m = np.cross(np.add(CENTER, (RADIUS, 0.0, 0.0)), f)
    return np.array([*f, m[0] + spin, m[1], m[2]])


HELD = np.array([wrench()] * 2)


class Zeros(FollowedZeros):
    """The followed zeros of two fingers; `feel` lets time go on."""

    def __init__(self):
        super().__init__((BALL, BALL), TIP, WANDER, NOISELESS, PERIOD)
        self.time = 0.0

    def feel(self, true, seconds=0.0, rate=0.0, forces=(2.0, 2.0), speed=0.0):
        """Sense a true load with zeros that wander at a rate; returns the last observation.

        A sample stands for several of a block: quicker.
        """
        slow = self._count // 4
        self._count = 4
        for _ in range(round(seconds / PERIOD / slow)):
            now = self.step(sensed(self.time, true + rate * self.time, speed), forces)
            self.time += slow * PERIOD
        self._count = 4 * slow
        return now


def sensed(time, wrenches, speed=0.0):
    fingers = [
        FingerObservation(time, tuple(w.tolist()), contact_from_wrench(BALL, w), bool(np.any(w)), HEALTHY)
        for w in wrenches
    ]
    return Observation(time, ArmSample(time, ZERO, IDENTITY, (0.0, 0.0, speed)), tuple(fingers))


@given(st.lists(st.floats(-1.0, 1.0), min_size=6, max_size=6), st.floats(0.5, 5.0), st.floats(0.0, 1.0))
def test_errors_of_zeros_move_the_contact_by_no_more_than_stated(shares, normal, down):
    """To first order, for small errors."""
    box, true = np.array(WANDER.within(0.5)), wrench(normal, down * normal * 0.3)
    exact, off = contact_from_wrench(BALL, true), contact_from_wrench(BALL, true + box * shares)
    b_n, b_t, b_spin = TIP.felt(tuple(box.tolist()))
    room = 1.0 + 0.4 * down  # the normal is that of the sensor's x, but for its tilt
    assert abs(off.normal_force - exact.normal_force) <= room * b_n + 0.3 * b_t
    assert np.linalg.norm(off.tangential_force - exact.tangential_force) <= room * b_t + 1e-6
    assert abs(off.spin_torque - exact.spin_torque) <= room * b_spin + 1e-9


@given(SIGNS)
@settings(max_examples=6, deadline=None)
def test_a_zero_that_wanders_at_rest_is_followed(signs):
    """A load that grows at all fingers alike is held as if it were real."""
    zeros, same, rate = Zeros(), Zeros(), np.array(WANDER.within(1.0)) * signs
    rest = np.array([wrench(), wrench(spin=-1e-3)])
    now = zeros.feel(rest, 20.0, rate)
    left = np.abs([finger.wrench for finger in now.fingers] - rest)
    assert zeros.resting
    assert zeros.unseen < 1.0
    assert (left <= np.array(WANDER.within(1.5))).all()
    assert np.abs(rate * now.time).max() > 10.0 * left[:, :3].max()
    same.feel(HELD, 20.0, rate)
    alike = (signs[:, 2] < 0.0).all()  # the load points along -z of both
    assert same.hidden == pytest.approx(1e-3 * now.time / 0.5 if alike else 0.0, rel=0.05, abs=5e-3)


def test_a_load_that_comes_is_felt_at_once_and_not_followed():
    zeros, after = Zeros(), np.array([wrench(down=1.5)] * 2)
    zeros.feel(HELD, 2.0)
    now = zeros.feel(after, 0.5)
    assert now.fingers[0].wrench == pytest.approx(tuple(after[0].tolist()), abs=2e-3)
    known = zeros.unseen
    zeros.feel(after, 10.0)
    assert zeros.unseen == pytest.approx(known)


def test_a_moving_hand_follows_no_zeros_and_an_open_one_resets_them():
    """Grasps in a row do not add up."""
    zeros, rate, unseen = Zeros(), np.array(WANDER.within(1.0)), []
    assert zeros.reserve(SURFACE) == 0.0
    for seconds in (10.0, 1.0, 1.0, 1.0):
        zeros.feel(HELD, seconds, rate, speed=0.1)
        unseen.append(zeros.unseen)
        assert zeros.reserve(SURFACE) >= WANDER.reserve(SURFACE, TIP, seconds - 0.3)
        now = zeros.feel(0.0 * HELD, 1.0, rate, forces=())
        assert zeros.unseen == zeros.reserve(SURFACE) == 0.0
        assert np.abs([finger.wrench for finger in now.fingers]).max() < 5e-4
    assert unseen[0] == pytest.approx(10.0, abs=0.3)
    assert max(unseen[1:]) <= unseen[1] + 0.41  # a block more or less at either end


def test_at_rest_a_normal_force_that_seems_to_sink_moves_no_command():
    """The same observations find the same zeros again."""
    zeros = Zeros()
    grip = SlipSafeGrip(2, KnownSurface(SURFACE), PERIOD, GripParameters(), zeros=zeros)
    zeros.feel(HELD, 2.0)
    assert zeros.resting
    sunk = HELD + [[0.3, 0, 0, 0, 0.3 * CENTER[2], 0]] * 2
    commands = [grip.step(sensed(i * PERIOD, HELD if i < 500 else sunk)) for i in range(800)]
    assert commands[-1] == pytest.approx(commands[499], rel=0.05)
    noise = 0.01 * np.random.default_rng(3).standard_normal((3000, 2, 6)) * [1, 1, 1, 0.01, 0.01, 0.01]

    def run():
        zeros.start()
        return [zeros.step(sensed(i * PERIOD, HELD + each), (2.0, 2.0)) for i, each in enumerate(noise)]

    assert [now.fingers[0].wrench for now in run()] == [now.fingers[0].wrench for now in run()]
