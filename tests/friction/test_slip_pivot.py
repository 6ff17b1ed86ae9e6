"""The angle of an object that turns in the fingers, from the torque that it leaves there."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.errors import InvalidValueError
from palpate.friction.slip.pivot_observer import PivotingObject, PivotNoise, PivotObserver

PERIOD = 1e-3
TARGET = PivotingObject(weight_lever=0.1 * 9.81 * 0.03, inertia=1.5e-4)
DEG = math.pi / 180.0


def swing(start, most_torque, seconds, rng=None, noise=None, offset=0.0):
    """True (angle, rate, sticks, torque as read) per period: dry friction against gravity."""
    noise = noise or PivotNoise()
    angle, rate, rows = start, 0.0, []
    for k in range(round(seconds / PERIOD)):
        limit = most_torque(k * PERIOD)
        gravity = -TARGET.weight_lever * math.sin(angle)
        # friction takes what it can: stopping within this period included
        wanted = gravity + TARGET.inertia * rate / PERIOD
        torque = max(-limit, min(limit, wanted))
        rate += PERIOD * (gravity - torque) / TARGET.inertia
        angle += PERIOD * rate
        read = torque + offset + (noise.torque * rng.standard_normal() if rng else 0.0)
        rows.append((angle, rate, abs(rate) < 1e-9, read))
    return rows


def loosened(t):
    """Friction lets go for a while, and holds again."""
    return 0.02 if 0.5 < t < 0.9 else 0.1


@given(st.floats(-1.2, 1.2))
@settings(max_examples=15, deadline=None)
def test_at_rest_the_torque_tells_the_angle(start):
    observer = PivotObserver(TARGET, PERIOD, start + 0.2, 0.3, PivotNoise(offset=0.0))
    for _ in range(3000):
        told = observer.step(-TARGET.weight_lever * math.sin(start), True)
    assert told.angle == pytest.approx(start, abs=5e-3)
    assert abs(told.rate) < 1e-3


@given(st.floats(0.6, 1.4))
@settings(max_examples=10, deadline=None)
def test_left_and_right_are_alike(start):
    left, right = (PivotObserver(TARGET, PERIOD, s * start, 0.05) for s in (1.0, -1.0))
    for _, _, sticks, torque in swing(start, loosened, 1.2):
        a, b = left.step(torque, sticks), right.step(-torque, sticks)
        assert a.angle == pytest.approx(-b.angle, abs=1e-12)
        assert a.rate == pytest.approx(-b.rate, abs=1e-12)


def test_without_noise_a_swing_is_followed_exactly():
    rows = swing(1.2, loosened, 1.2)
    observer = PivotObserver(TARGET, PERIOD, 1.2, 0.0)
    assert abs(rows[-1][0] - 1.2) > 0.2
    for angle, rate, sticks, torque in rows:
        told = observer.step(torque, sticks)
        assert told.angle == pytest.approx(angle, abs=1e-4)
        assert told.rate == pytest.approx(rate, abs=2e-3)


@pytest.mark.parametrize(("sensor", "limit"), [(True, 0.9), (False, 3.0)])
def test_angle_and_deviation_are_honest_under_noise(sensor, limit):
    rng, noise, worst, off = np.random.default_rng(4), PivotNoise(), [], []
    for _ in range(12):
        offset = noise.offset * rng.standard_normal()
        start = 1.0 + 0.02 * rng.standard_normal()
        observer = PivotObserver(TARGET, PERIOD, 1.0, 0.02)
        errors = []
        for angle, _, sticks, torque in swing(start, loosened, 1.2, rng, noise, offset):
            read = angle + noise.angle * rng.standard_normal() if sensor else None
            told = observer.step(torque, sticks, read)
            errors.append(abs(told.angle - angle) / DEG)
            off.append(abs(told.angle - angle) / told.angle_deviation)
        worst.append(max(errors[100:]))
    assert max(worst) < limit
    assert np.mean(np.array(off) < 3.0) > 0.95


def test_towards_the_horizontal_the_torque_alone_says_so():
    flat, steep = (PivotObserver(TARGET, PERIOD, s, 0.2) for s in (1.5, 0.3))
    for _ in range(1000):
        a = flat.step(-TARGET.weight_lever * math.sin(1.5), True)
        b = steep.step(-TARGET.weight_lever * math.sin(0.3), True)
    assert a.angle_deviation > 3.0 * b.angle_deviation


def test_a_missing_torque_does_no_harm():
    observer = PivotObserver(TARGET, PERIOD, 0.5, 0.01)
    for _ in range(100):
        told = observer.step(math.nan, True)
    assert told.angle == pytest.approx(0.5, abs=1e-6)


def test_what_cannot_be_is_refused():
    with pytest.raises(InvalidValueError, match="must"):
        PivotingObject(0.0, 1.0)
    with pytest.raises(InvalidValueError, match="must"):
        PivotObserver(TARGET, PERIOD, math.nan, 0.1)
