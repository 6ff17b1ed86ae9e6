"""Friction and zeros that are wrong while an object is held: squeeze tests, bounds, zeros that wander."""

import itertools
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


def answer(load_of, seed, fingers=2):
    """Answer of a squeeze after 0.2 s; `load_of` gives the load at a grip over the first."""
    generator, test, grip = np.random.default_rng(seed), SqueezeTest(fingers, PERIOD), 4.0
    for k in itertools.count():
        if k == 200:
            assert test.steady
            test.begin(k * PERIOD)
        grip += 0.08 * (4.0 * (1.0 + SQUEEZE * test.active) - grip)
        load = MeasuredLoad(load_of(grip / 4.0) + NOISE * generator.standard_normal(), NOISE)
        found = test.step(k * PERIOD, (load,), grip)
        if found is not None:
            assert PERIOD * (k - 200) <= LASTS + PERIOD
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
def test_what_slips_shows_its_friction_and_the_others_may_have_lost_the_same_share(shown, borne):
    """A slip that was none is taken back."""
    surface, first = bounded(), max(shown, LEAST_LEFT * SLIPPERY.friction)
    surface.keep()
    surface.show((shown, math.inf), (shown, borne))
    assert surface.surface(0).friction == pytest.approx(first)
    assert surface.surface(1).friction == pytest.approx(min(max(first, borne), SLIPPERY.friction))
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


def pressed(normal=2.0, down=0.5, spin=1e-3):
    """The wrench of a finger that presses along x, and bears a load and a torque."""
    f = np.array([-normal, 0.0, -down])
    m = np.cross(np.add(CENTER, (RADIUS, 0.0, 0.0)), f)
    return np.array([*f, m[0] + spin, m[1], m[2]])


def sensed(time, wrenches, speed=0.0):
    arm = ArmSample(time, ZERO, IDENTITY, (0.0, 0.0, speed))
    fingers = [
        FingerObservation(time, tuple(w.tolist()), contact_from_wrench(BALL, w), bool(np.any(w)), HEALTHY)
        for w in wrenches
    ]
    return Observation(time, arm, tuple(fingers))


def zeros_of(wander=WANDER):
    return FollowedZeros((BALL, BALL), TIP, wander, NOISELESS, PERIOD)


def feel(zeros, true, error, seconds, first=0.0, forces=(2.0, 2.0), every=4, speed=0.0):
    """Let time go on, with true loads and errors as functions of time; returns the last observation, its time."""
    slow = zeros._count // every  # fewer samples of the same block: quicker
    zeros._count = every
    for i in range(round(seconds / PERIOD / slow)):
        t = first + i * slow * PERIOD
        now = zeros.step(sensed(t, true(t) + error(t), speed), forces)
    zeros._count = every * slow
    return now, t


surfaces = st.builds(
    LimitSurface, st.floats(0.1, 1.2), st.floats(1e-3, 8e-3), st.floats(0.0, 1.0 / 3.0), st.floats(1.0, 2.0)
)

loads = st.tuples(st.floats(0.0, 5.0), st.floats(0.0, 0.02))


@given(surfaces, loads, loads)
def test_grips_that_hold_a_load_and_an_error_hold_both_together(surface, first, second):
    both = surface.least_normal_force(first[0] + second[0], first[1] + second[1])
    assert both <= (surface.least_normal_force(*first) + surface.least_normal_force(*second)) * (1.0 + 1e-9)


@given(st.lists(st.floats(-1.0, 1.0), min_size=6, max_size=6), st.floats(0.5, 5.0), st.floats(0.0, 1.0))
def test_what_is_felt_is_off_by_no_more_than_is_stated(shares, normal, down):
    """To first order: zeros that are off by a little."""
    box, wrench = np.array(WANDER.within(0.5)), pressed(normal, down * normal * 0.3)
    true, off = contact_from_wrench(BALL, wrench), contact_from_wrench(BALL, wrench + box * shares)
    b_n, b_t, b_spin = TIP.felt(tuple(box.tolist()))
    room = 1.0 + 0.4 * down  # the normal is that of the sensor's x, and stays so but for its tilt
    assert abs(off.normal_force - true.normal_force) <= room * b_n + 0.3 * b_t
    assert np.linalg.norm(off.tangential_force - true.tangential_force) <= room * b_t + 1e-6
    assert abs(off.spin_torque - true.spin_torque) <= room * b_spin + 1e-9


@given(SIGNS)
@settings(max_examples=6, deadline=None)
def test_a_zero_that_wanders_while_all_rests_is_followed(signs):
    """Growth of the load that all fingers seem to share is held as if it were real."""
    zeros, same, rate = zeros_of(), zeros_of(), np.array(WANDER.within(1.0)) * signs
    rest = np.array([pressed(), pressed(spin=-1e-3)])
    now, end = feel(zeros, lambda t: rest, lambda t: rate * t, 20.0)
    left = np.abs([finger.wrench for finger in now.fingers] - rest)
    assert zeros.resting
    assert zeros.unseen < 1.0
    assert (left <= np.array(WANDER.within(1.5))).all()
    assert np.abs(rate * end).max() > 10.0 * left[:, :3].max()
    feel(same, lambda t: np.array([pressed()] * 2), lambda t: rate * t, 20.0)
    alike = (signs[:, 2] < 0.0).all()  # the load points along -z of both
    assert same.hidden == pytest.approx(1e-3 * end / 0.5 if alike else 0.0, rel=0.05, abs=5e-3)


@given(SIGNS)
@settings(max_examples=6, deadline=None)
def test_a_load_that_seems_to_grow_at_all_fingers_is_held_as_if_it_did(signs):
    zeros, rate = zeros_of(), np.array(WANDER.within(1.0)) * signs
    _, end = feel(zeros, lambda t: np.array([pressed(), pressed()]), lambda t: rate * t, 20.0)
    alike = (signs[:, 2] < 0.0).all()  # the load points along -z of both
    assert zeros.hidden == pytest.approx(1e-3 * end / 0.5 if alike else 0.0, rel=0.05, abs=5e-3)


def test_a_load_that_comes_is_felt_at_once_and_not_followed():
    zeros, before, after = zeros_of(), np.array([pressed()] * 2), np.array([pressed(down=1.5)] * 2)
    feel(zeros, lambda t: before, lambda t: 0.0, 2.0)
    now, end = feel(zeros, lambda t: after, lambda t: 0.0, 0.5, first=2.0)
    assert now.fingers[0].wrench == pytest.approx(tuple(after[0].tolist()), abs=2e-3)
    known = zeros.unseen
    feel(zeros, lambda t: after, lambda t: 0.0, 10.0, first=end)
    assert zeros.unseen == pytest.approx(known)


def test_what_was_not_followed_while_the_hand_moved_is_told_and_forgotten_when_it_lets_go():
    zeros, held, free = zeros_of(), np.array([pressed()] * 2), np.zeros((2, 6))
    assert zeros.reserve(SURFACE) == 0.0
    error = np.array(WANDER.within(1.0))
    _, end = feel(zeros, lambda t: held, lambda t: error * t, 10.0, speed=0.1)
    moved = zeros.reserve(SURFACE)
    assert zeros.unseen == pytest.approx(10.0, abs=0.3)
    assert moved >= WANDER.reserve(SURFACE, TIP, 9.7)
    now, _ = feel(zeros, lambda t: free, lambda t: error * t, 1.0, first=end, forces=())
    assert zeros.unseen == 0.0
    assert zeros.reserve(SURFACE) == 0.0
    assert np.abs([finger.wrench for finger in now.fingers]).max() < 5e-4


def test_what_was_not_followed_while_the_hand_moved_counts_and_is_forgotten_when_it_lets_go():
    """So grasps in a row do not add up."""
    zeros, held, free, end = zeros_of(), np.array([pressed()] * 2), np.zeros((2, 6)), 0.0
    error, unseen = np.array(WANDER.within(1.0)), []
    assert zeros.reserve(SURFACE) == 0.0
    for seconds in (10.0, 1.0, 1.0, 1.0):
        _, end = feel(zeros, lambda t: held, lambda t: error * t, seconds, first=end, speed=0.1)
        unseen.append((zeros.unseen, zeros.reserve(SURFACE)))
        now, end = feel(zeros, lambda t: free, lambda t: error * t, 1.0, first=end, forces=())
        assert zeros.unseen == zeros.reserve(SURFACE) == 0.0
        assert np.abs([finger.wrench for finger in now.fingers]).max() < 5e-4
    assert unseen[0][0] == pytest.approx(10.0, abs=0.3)
    assert unseen[0][1] >= WANDER.reserve(SURFACE, TIP, 9.7)
    assert max(each for each, _ in unseen[1:]) <= unseen[1][0] + 0.41  # a block more or less at either end


def test_at_rest_a_normal_force_that_seems_to_sink_moves_no_command():
    """The same observations find the same zeros again."""
    zeros, rest = zeros_of(), np.array([pressed()] * 2)
    grip = SlipSafeGrip(2, KnownSurface(SURFACE), PERIOD, GripParameters(), zeros=zeros)
    feel(zeros, lambda t: rest, lambda t: 0.0, 2.0)
    assert zeros.resting
    sunk = rest + [[0.3, 0, 0, 0, 0.3 * CENTER[2], 0]] * 2
    commands = [grip.step(sensed(i * PERIOD, rest if i < 500 else sunk)) for i in range(800)]
    assert commands[-1] == pytest.approx(commands[499], rel=0.05)
    wrenches, runs = (
        rest + 0.01 * np.random.default_rng(3).standard_normal((3000, 2, 6)) * [1, 1, 1, 0.01, 0.01, 0.01],
        [],
    )
    for _ in range(2):
        zeros.start()
        runs.append(
            [zeros.step(sensed(i * PERIOD, each), (2.0, 2.0)).fingers[0].wrench for i, each in enumerate(wrenches)]
        )
    assert runs[0] == runs[1]
