"""The normal's filter: no lag on a steady turn, a true lead, and no preferred direction."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.controllers import NormalTracker
from palpate.errors import InvalidValueError
from palpate.spatial import norm, rotate

PERIOD, SMOOTHING, LEAD = 1e-3, 0.01, 0.0215


def turned(angle):
    return (math.sin(angle), 0.0, -math.cos(angle))


def angle_between(a, b):
    return math.atan2(np.linalg.norm(np.cross(a, b)), np.dot(a, b))


def after_turning(rate, steps=800, smoothing=SMOOTHING, lead=LEAD, period=PERIOD):
    tracker = NormalTracker(period, smoothing, lead)
    for i in range(steps):
        tracker.update(turned(rate * period * i))
    return tracker, rate * period * (steps - 1)


@pytest.mark.parametrize("rate", [0.1, 1.0, -3.0, 10.0])
@pytest.mark.parametrize("smoothing", [0.003, 0.01, 0.03])
def test_a_steady_turn_is_followed_without_lag(rate, smoothing):
    """Error of third order in the turn per time constant, where a plain low-pass lags rate x time constant."""
    tracker, angle = after_turning(rate, smoothing=smoothing)
    assert angle_between(tracker.normal, turned(angle)) < 1e-9 + 2.0 * abs(rate * smoothing) ** 3


@pytest.mark.parametrize("rate", [0.1, 1.0, -3.0])
@pytest.mark.parametrize("lead", [0.0, 0.01, LEAD, 0.05])
def test_the_prediction_is_the_normal_one_lead_later(rate, lead):
    """Up to the third order that a straight step and its renormalisation leave: atan x = x - x^3/3."""
    tracker, angle = after_turning(rate, lead=lead)
    bound = 1e-9 + abs(rate * lead) ** 3 / 2 + 5.0 * abs(rate * SMOOTHING) ** 3
    assert angle_between(tracker.predicted, turned(angle + rate * lead)) < bound


def test_the_transient_is_gone_after_ten_time_constants():
    straight, _ = after_turning(0.0)
    assert straight.normal == pytest.approx(turned(0.0))
    tracker = NormalTracker(PERIOD, SMOOTHING, LEAD)
    errors = []
    for i in range(100):
        tracker.update(turned(0.3 if i else 0.0))
        errors.append(angle_between(tracker.normal, turned(0.3)))
    assert errors[0] == pytest.approx(0.3)
    assert errors[-1] < 1e-3


def test_it_smooths_noise():
    rng = np.random.default_rng(0)
    tracker = NormalTracker(PERIOD, SMOOTHING, 0.0)
    raw, smooth = [], []
    for i in range(4000):
        n = np.array([0.0, 0.0, -1.0]) + 0.02 * rng.normal(size=3)
        n /= np.linalg.norm(n)
        tracker.update(tuple(n.tolist()))
        if i > 200:
            raw.append(angle_between(n, (0.0, 0.0, -1.0)))
            smooth.append(angle_between(tracker.normal, (0.0, 0.0, -1.0)))
    # variance of a critically damped alpha-beta filter: (2 a^2 + b (2 - 3 a)) / (a (4 - 2 a - b))
    r = math.exp(-PERIOD / SMOOTHING)
    a, b = 1 - r * r, (1 - r) ** 2
    expected = (2 * a * a + b * (2 - 3 * a)) / (a * (4 - 2 * a - b))
    assert np.mean(np.square(smooth)) / np.mean(np.square(raw)) == pytest.approx(expected, rel=0.15)


directions = (
    st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: norm(v) > 0.1).map(lambda v: tuple(x / norm(v) for x in v))
)


@st.composite
def rotations(draw):
    w, x, y, z = draw(st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: sum(c * c for c in q) > 0.1))
    s = 2.0 / (w * w + x * x + y * y + z * z)
    return (
        (1 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)),
        (s * (x * y + z * w), 1 - s * (x * x + z * z), s * (y * z - x * w)),
        (s * (x * z - y * w), s * (y * z + x * w), 1 - s * (x * x + y * y)),
    )


@settings(max_examples=100, deadline=None, derandomize=True)
@given(st.lists(directions, min_size=1, max_size=20))
def test_normals_stay_unit_vectors_whatever_is_measured(measured):
    tracker = NormalTracker(PERIOD, SMOOTHING, LEAD)
    for n in measured:
        tracker.update(n)
        assert norm(tracker.normal) == pytest.approx(1.0, abs=1e-12)
        assert norm(tracker.predicted) == pytest.approx(1.0, abs=1e-12)


@settings(max_examples=100, deadline=None, derandomize=True)
@given(rotations(), st.floats(-5, 5), directions)
def test_turning_the_world_turns_the_result(rotation, rate, wobble):
    here, there = (NormalTracker(PERIOD, SMOOTHING, LEAD) for _ in range(2))
    for i in range(30):
        n = np.array(turned(rate * PERIOD * i)) + 0.1 * math.sin(i) * np.array(wobble)
        n = tuple((n / np.linalg.norm(n)).tolist())
        here.update(n)
        there.update(rotate(rotation, n))
    assert there.normal == pytest.approx(rotate(rotation, here.normal), abs=1e-9)
    assert there.predicted == pytest.approx(rotate(rotation, here.predicted), abs=1e-9)


def test_a_reset_forgets_the_turn():
    tracker, _ = after_turning(3.0)
    tracker.reset()
    with pytest.raises(ValueError, match="no normal"):
        _ = tracker.normal
    tracker.update(turned(1.0))
    assert tracker.normal == turned(1.0)
    assert tracker.predicted == pytest.approx(turned(1.0))


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan, math.inf])
def test_times_that_cannot_be_are_refused(bad):
    with pytest.raises(InvalidValueError, match="period"):
        NormalTracker(bad, SMOOTHING, LEAD)
    with pytest.raises(InvalidValueError, match="time_constant"):
        NormalTracker(PERIOD, bad, LEAD)
