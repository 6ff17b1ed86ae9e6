"""Keeping the tip normal: it gets there, as fast as it may, and the contact does not slide by it."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from palpate.controllers import NormalAxis, Orientation
from palpate.controllers.orientation import ACCELERATION_IN_RATES, carried_along
from palpate.errors import InvalidValueError

PERIOD = 1e-3
directions = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1)


def as_rows(rotation):
    return tuple(tuple(row) for row in rotation.as_matrix().tolist())


def turned(axis, normal, seconds=6.0, period=PERIOD, **settings_):
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
@given(directions, directions)
def test_the_axis_becomes_normal_no_faster_than_it_may(axis, normal):
    normal = tuple((np.array(normal) / np.linalg.norm(normal)).tolist())
    period = 4 * PERIOD
    angles, rates = turned(axis, normal, 12.0, period)
    assert angles[-1] < 1e-3
    assert np.linalg.norm(rates, axis=1).max() <= 0.5 * (1 + 1e-9)
    changes = np.linalg.norm(np.diff(rates, axis=0), axis=1)
    assert changes.max() <= ACCELERATION_IN_RATES * 0.5 * period * (1 + 1e-9)


def test_it_does_not_spin_about_the_normal():
    normal = (0.36, 0.48, -0.8)
    _, rates = turned((0.0, 0.0, -1.0), normal)
    # the axis that it turns about is across both directions, all the way
    assert np.abs(rates @ np.array(normal)).max() < 1e-6


@settings(max_examples=50, deadline=None, derandomize=True)
@given(directions, directions)
def test_the_contact_stays_in_place(rate, lever):
    """Velocity of a point: that of the origin plus omega x lever."""
    origin = np.array(carried_along(rate, lever))
    assert origin + np.cross(rate, lever) == pytest.approx(np.zeros(3), abs=1e-12)


def test_it_comes_to_rest_as_gently():
    control = Orientation(NormalAxis(), PERIOD)
    for _ in range(500):
        control.turn(as_rows(Rotation.from_euler("x", 1.0)), (0.0, 0.0, -1.0))
    rates = [np.linalg.norm(control.rest()) for _ in range(200)]
    assert rates[0] > 0.4
    assert rates[-1] == 0.0
    assert np.abs(np.diff(rates)).max() <= ACCELERATION_IN_RATES * 0.5 * PERIOD * (1 + 1e-9)


def test_an_axis_without_direction_is_refused():
    with pytest.raises(InvalidValueError, match="axis"):
        NormalAxis((0.0, 0.0, 0.0))
