"""The filtered normal without lag or preferred direction, the tip kept normal, and vectors to the bit."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from palpate.controllers import NormalAxis, NormalTracker, Orientation
from palpate.controllers.orientation import ACCELERATION_IN_RATES, carried_along
from palpate.controllers.small_vectors import length, unit
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
@pytest.mark.parametrize(
    ("smoothing", "lead"), [(0.003, 0.0), (0.01, 0.01), (0.01, LEAD), (0.01, 0.05), (0.03, LEAD)]
)
def test_the_prediction_is_the_normal_one_lead_later(rate, smoothing, lead):
    """A steady turn is followed without lag: the error is of third order in the turn per time constant.

    A plain low-pass would lag rate x time constant. The prediction adds the third order of a straight step:
    atan x = x - x^3/3.
    """
    tracker, angle = after_turning(rate, smoothing=smoothing, lead=lead)
    lag = abs(rate * smoothing) ** 3
    assert angle_between(tracker.normal, turned(angle)) < 1e-9 + 2.0 * lag
    if abs(rate) <= 3.0:
        ahead = angle_between(tracker.predicted, turned(angle + rate * lead))
        assert ahead < 1e-9 + abs(rate * lead) ** 3 / 2 + 5.0 * lag


def test_the_transient_is_gone_after_ten_time_constants():
    """A reset forgets the turn."""
    straight, tracker, errors = after_turning(0.0)[0], NormalTracker(PERIOD, SMOOTHING, LEAD), []
    for i in range(100):
        tracker.update(turned(0.3 if i else 0.0))
        errors.append(angle_between(tracker.normal, turned(0.3)))
    assert straight.normal == pytest.approx(turned(0.0))
    assert errors[0] == pytest.approx(0.3)
    assert errors[-1] < 1e-3
    tracker, _ = after_turning(3.0)
    tracker.reset()
    with pytest.raises(ValueError, match="no normal"):
        _ = tracker.normal
    tracker.update(turned(1.0))
    assert tracker.normal == turned(1.0)
    assert tracker.predicted == pytest.approx(turned(1.0))


def test_it_smooths_noise():
    """Variance of a critically damped alpha-beta filter: (2 a^2 + b (2 - 3 a)) / (a (4 - 2 a - b))."""
    noisy, angles = NormalTracker(PERIOD, SMOOTHING, 0.0), []
    for n in (0.0, 0.0, -1.0) + 0.02 * np.random.default_rng(0).normal(size=(4000, 3)):
        noisy.update(tuple((n / np.linalg.norm(n)).tolist()))
        angles.append([angle_between(each, (0.0, 0.0, -1.0)) for each in (n, noisy.normal)])
    r = math.exp(-PERIOD / SMOOTHING)
    a, b = 1 - r * r, (1 - r) ** 2
    expected = (2 * a * a + b * (2 - 3 * a)) / (a * (4 - 2 * a - b))
    raw, smooth = np.mean(np.square(angles[201:]), axis=0)
    assert smooth / raw == pytest.approx(expected, rel=0.15)


directions = (
    st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: norm(v) > 0.1).map(lambda v: tuple(x / norm(v) for x in v))
)

rotations = directions.map(lambda v: Rotation.from_rotvec(3.0 * np.array(v)).as_matrix().tolist())


@settings(max_examples=100, deadline=None, derandomize=True)
@given(rotations, st.floats(-5, 5), directions, st.lists(directions, min_size=1, max_size=20))
def test_turning_the_world_turns_the_result(rotation, rate, wobble, jumps):
    """Normals stay unit vectors whatever is measured."""
    here, there = (NormalTracker(PERIOD, SMOOTHING, LEAD) for _ in range(2))
    steady = [np.array(turned(rate * PERIOD * i)) + 0.1 * math.sin(i) * np.array(wobble) for i in range(30)]
    for n in (*steady, *jumps):
        n = tuple((n / np.linalg.norm(n)).tolist())
        here.update(n)
        there.update(rotate(rotation, n))
        assert there.normal == pytest.approx(rotate(rotation, here.normal), abs=1e-9)
        assert there.predicted == pytest.approx(rotate(rotation, here.predicted), abs=1e-9)
        assert (norm(here.normal), norm(here.predicted)) == pytest.approx((1.0, 1.0), abs=1e-12)


axes = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1)


def as_rows(rotation):
    return tuple(tuple(row) for row in rotation.as_matrix().tolist())


def aligned(axis, normal, seconds=6.0, period=PERIOD, **settings_):
    """Angles to the normal, and rates, of a tip that turns as it is told, from upright."""
    control = Orientation(NormalAxis(axis, **settings_), period)
    rotation, angles, rates = Rotation.identity(), [], []
    for _ in range(round(seconds / period)):
        rate = np.array(control.turn(as_rows(rotation), normal))
        rotation = Rotation.from_rotvec(period * rate) * rotation
        now = rotation.apply(np.array(axis) / np.linalg.norm(axis))
        angles.append(math.atan2(np.linalg.norm(np.cross(now, normal)), now @ normal))
        rates.append(rate)
    return np.array(angles), np.array(rates)


@pytest.mark.slow
@settings(max_examples=15, deadline=None, derandomize=True)
@given(axes, axes)
def test_the_axis_becomes_normal_no_faster_than_it_may(axis, normal):
    normal = tuple((np.array(normal) / np.linalg.norm(normal)).tolist())
    period = 4 * PERIOD
    angles, rates = aligned(axis, normal, 12.0, period)
    assert angles[-1] < 1e-3
    assert np.linalg.norm(rates, axis=1).max() <= 0.5 * (1 + 1e-9)
    changes = np.linalg.norm(np.diff(rates, axis=0), axis=1)
    assert changes.max() <= ACCELERATION_IN_RATES * 0.5 * period * (1 + 1e-9)


def test_it_comes_to_rest_as_gently():
    control = Orientation(NormalAxis(), PERIOD)
    for _ in range(500):
        control.turn(as_rows(Rotation.from_euler("x", 1.0)), (0.0, 0.0, -1.0))
    rates = [np.linalg.norm(control.rest()) for _ in range(200)]
    assert rates[0] > 0.4
    assert rates[-1] == 0.0
    assert np.abs(np.diff(rates)).max() <= ACCELERATION_IN_RATES * 0.5 * PERIOD * (1 + 1e-9)


@pytest.mark.parametrize("size", [1e-100, 1e-6, 1.0, 1e100])
def test_a_length_is_what_python_rounds_it_to(size):
    vectors = size * np.random.default_rng(0).standard_normal((3000, 3))
    vectors[:1000, 1:] *= 1e-6
    assert [length(*each) for each in vectors.tolist()] == [math.hypot(*each) for each in vectors.tolist()]
    assert length(0.0, 0.0, 0.0) == 0.0
    with pytest.raises(ZeroDivisionError):
        unit((0.0, 0.0, 0.0))


@settings(max_examples=50, deadline=None, derandomize=True)
@given(axes, axes)
def test_the_contact_stays_in_place_and_the_tip_does_not_spin_about_the_normal(rate, lever):
    """Velocity of a point: that of the origin plus omega x lever. The tip never turns about it."""
    origin = np.array(carried_along(rate, lever))
    assert origin + np.cross(rate, lever) == pytest.approx(np.zeros(3), abs=1e-12)
    normal = np.array((0.36, 0.48, -0.8))
    _, rates = aligned((0.0, 0.0, -1.0), tuple(normal), 0.05)
    assert np.abs(rates @ normal).max() < 1e-6
