"""From samples to observations: compensation, contact, and when a touch begins and ends."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.runtime.touch import Finger, Touch
from palpate.sensing.compensation import SensorPayload, contact_wrench
from palpate.sensing.contact import ContactStatus
from palpate.sensing.ft.health import FROZEN_SAMPLES, STUCK_SAMPLES, HealthCheck
from palpate.surfaces import Sphere
from runtime.puppets import PUSH, sample, touch

small = st.floats(-10, 10)
vectors = st.tuples(small, small, small)


def up(force):
    return (0.0, 0.0, force, 0.0, 0.0, 0.0)


def test_a_touch_begins_above_one_threshold_and_ends_below_a_lower_one():
    hand = touch()
    forces = [0.0, 0.15, 0.199, 0.201, 0.15, 0.101, 0.099, 0.15, 0.3]
    touching = [hand.sense(sample(wrench=up(f))).fingers[0].touching for f in forces]
    assert touching == [False, False, False, True, True, True, False, False, True]
    hand.start()
    assert not hand.sense(sample(wrench=up(0.15))).fingers[0].touching, "a new start forgets the touch"
    both = touch(2)
    both.sense(sample(wrenches=(up(0.5), up(0.0))))
    observed = both.sense(sample(wrenches=(up(0.15), up(0.15))))
    assert [f.touching for f in observed.fingers] == [True, False], "each finger remembers its own touch"


@pytest.mark.parametrize(
    ("wrench", "status"),
    [
        ((math.nan, *PUSH[1:]), ContactStatus.INVALID),
        ((math.inf, *PUSH[1:]), ContactStatus.INVALID),
        # the axis of the force passes the sphere at a distance, and no spin balances it
        ((0.0, 0.0, 2.0, 1.0, 0.0, 0.0), ContactStatus.NO_CONTACT),
    ],
)
def test_a_wrench_that_no_contact_explains_is_no_touch_but_passes(wrench, status):
    observed = touch().sense(sample(wrench=wrench)).fingers[0]
    assert (observed.contact.status, observed.touching) == (status, False)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.floats(0, 2), vectors, vectors, vectors, vectors)
def test_compensation_is_newton_and_euler(mass, center, acceleration, force, moment):
    """A payload that does not turn: what it feels from contact and mount together is m a at its centre."""
    payload = SensorPayload(mass, center)
    inertia = mass * np.array(acceleration)
    load = np.array(force) - inertia, np.array(moment) - np.cross(center, inertia)
    found = contact_wrench((*load[0].tolist(), *load[1].tolist()), acceleration, payload)
    assert np.allclose(found, [*force, *moment], atol=1e-10)
    assert contact_wrench(PUSH, acceleration, SensorPayload()) == PUSH


def test_the_observation_carries_the_compensated_wrench():
    hand = Touch(Finger(Sphere(0.01), SensorPayload(0.1, (0.0, 0.0, 0.02))))
    weight = 0.1 * 9.81
    observed = hand.sense(sample(wrench=(0.0, 0.0, 2.0 - weight, 0.0, 0.0, 0.0)))
    assert observed.fingers[0].wrench == pytest.approx((0.0, 0.0, 2.0, 0.0, 0.0, 0.0), abs=1e-12)
    assert observed.fingers[0].contact.normal_force == pytest.approx(2.0)
    assert observed.fingers[0].contact.centroid == pytest.approx([0.0, 0.0, -0.01])


NOISY = Finger(Sphere(0.01), noise=(1e-3,) * 6)


def verdict_on(finger, readings, repeats=1):
    """Return the verdict on the last of some readings, a millisecond apart, each read several times."""
    hand = Touch(finger)
    for i, reading in enumerate(readings):
        for _ in range(repeats):
            now = hand.sense(sample(1e-3 * i, tuple(reading)))
    return now.fingers[0].health.measure


@settings(max_examples=20)
@given(st.lists(st.integers(0, 5), max_size=5, unique=True), st.floats(-5.0, 5.0))
def test_channels_of_a_noisy_sensor_that_stand_still_are_found_without_a_file(alive, value):
    readings = np.full((STUCK_SAMPLES, 6), value)
    readings[:, alive] += np.random.default_rng(0).normal(0.0, 1e-3, (STUCK_SAMPLES, len(alive)))
    assert verdict_on(NOISY, readings) is (HealthCheck.STUCK if alive else HealthCheck.FROZEN)
    assert verdict_on(NOISY, readings[: STUCK_SAMPLES - 1]) is (
        HealthCheck.HEALTHY if alive else HealthCheck.FROZEN
    )


@pytest.mark.parametrize(
    ("finger", "readings", "repeats"),
    [
        (NOISY, np.random.default_rng(0).normal(0.0, 1e-3, (5, 6)), 10 * FROZEN_SAMPLES),
        (Finger(Sphere(0.01)), np.zeros((2 * STUCK_SAMPLES, 6)), 1),
    ],
    ids=["slow device that repeats itself", "ideal sensor that stands still"],
)
def test_repetition_alone_is_no_fault(finger, readings, repeats):
    assert verdict_on(finger, readings, repeats) is HealthCheck.HEALTHY
