"""From samples to observations: compensation, contact, and when a touch begins and ends."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.errors import InvalidValueError
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


def test_a_new_start_forgets_the_touch():
    hand = touch()
    assert hand.sense(sample(wrench=up(0.5))).fingers[0].touching
    hand.start()
    assert not hand.sense(sample(wrench=up(0.15))).fingers[0].touching


def test_each_finger_remembers_its_own_touch():
    hand = touch(2)
    hand.sense(sample(wrenches=(up(0.5), up(0.0))))
    observed = hand.sense(sample(wrenches=(up(0.15), up(0.15))))
    assert [f.touching for f in observed.fingers] == [True, False]


def test_a_force_that_no_contact_explains_is_no_touch():
    """A force whose axis passes the sphere at a distance, and no spin to balance it."""
    observed = touch().sense(sample(wrench=(0.0, 0.0, 2.0, 1.0, 0.0, 0.0))).fingers[0]
    assert observed.contact.status is ContactStatus.NO_CONTACT
    assert not observed.touching


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_what_is_not_finite_is_no_touch_but_passes(bad):
    observed = touch().sense(sample(wrench=(bad, *PUSH[1:]))).fingers[0]
    assert observed.contact.status is ContactStatus.INVALID
    assert not observed.touching


def test_touch_needs_fingers_and_a_wrench_for_each():
    with pytest.raises(InvalidValueError, match="no finger"):
        Touch()
    with pytest.raises(InvalidValueError, match="1 wrenches: there are 2 fingers"):
        touch(2).sense(sample())


def test_a_touch_cannot_end_above_where_it_begins():
    with pytest.raises(InvalidValueError, match="release_force"):
        Finger(Sphere(0.01), touch_force=0.1, release_force=0.2)
    Finger(Sphere(0.01), touch_force=0.2, release_force=0.2)


@settings(max_examples=200, deadline=None, derandomize=True)
@given(st.floats(0, 2), vectors, vectors, vectors, vectors)
def test_compensation_is_newton_and_euler(mass, center, acceleration, force, moment):
    """A payload that does not turn: what it feels from contact and mount together is m a at its centre."""
    payload = SensorPayload(mass, center)
    inertia = mass * np.array(acceleration)
    load = np.array(force) - inertia, np.array(moment) - np.cross(center, inertia)
    found = contact_wrench((*load[0].tolist(), *load[1].tolist()), acceleration, payload)
    assert np.allclose(found, [*force, *moment], atol=1e-10)


def test_a_massless_payload_changes_nothing():
    assert contact_wrench(PUSH, (1.0, 2.0, 3.0), SensorPayload()) == PUSH


@pytest.mark.parametrize("mass", [-0.1, math.nan, math.inf])
def test_a_payload_has_a_mass(mass):
    with pytest.raises(InvalidValueError, match="mass"):
        SensorPayload(mass)


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


def test_a_slow_device_that_repeats_itself_is_not_frozen():
    readings = np.random.default_rng(0).normal(0.0, 1e-3, (5, 6))
    assert verdict_on(NOISY, readings, repeats=10 * FROZEN_SAMPLES) is HealthCheck.HEALTHY


def test_an_ideal_sensor_may_stand_still():
    assert verdict_on(Finger(Sphere(0.01)), np.zeros((2 * STUCK_SAMPLES, 6))) is HealthCheck.HEALTHY
