"""A camera's framing, stated as what a picture is: everything within the cone of view, nothing nearer needed."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.errors import InvalidValueError
from palpate.kinematics.framing import framing

ANGLE, ASPECT = math.radians(50.0), 1.3
TURNS = np.random.default_rng(0).normal(size=(2000, 3))
BALL = TURNS / np.linalg.norm(TURNS, axis=1)[:, None]
points = st.lists(st.tuples(*[st.floats(-1.0, 1.0)] * 3), min_size=2, max_size=12).map(np.array)
directions = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: math.hypot(v[0], v[1]) > 0.2)


def in_picture(seen, cloud):
    """Places in a picture, its edges at +-1; by a look-at matrix of its own."""
    forward = np.subtract(seen.looks_at, seen.position)
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    rays = cloud - np.array(seen.position)
    depth = rays @ forward
    assert (depth > 0.0).all()
    height = depth * math.tan(ANGLE / 2.0)
    return np.stack([rays @ right / (height * ASPECT), rays @ up / height], axis=1)


@given(points, directions, st.floats(1.0, 2.0))
def test_everything_is_in_the_picture(cloud, direction, room):
    seen = framing(cloud, direction, ANGLE, ASPECT, room)
    places = np.abs(in_picture(seen, cloud))
    assert places.max() <= 1.0 + 1e-9
    assert seen.distance >= 1e-3 * (1.0 - 1e-12)


@given(directions)
def test_it_is_no_farther_away_than_need_be(direction):
    """A ball of points: one of them lies on the edge."""
    places = in_picture(framing(BALL, direction, ANGLE, ASPECT), BALL)
    assert np.abs(places).max() == pytest.approx(1.0, abs=0.02)


@given(points, directions, st.floats(0.01, 100.0), st.tuples(*[st.floats(-5.0, 5.0)] * 3))
def test_it_moves_and_grows_with_what_is_seen(cloud, direction, scale, shift):
    if np.ptp(cloud, axis=0).max() < 0.2:
        return
    one, other = framing(cloud, direction, ANGLE, ASPECT), framing(scale * cloud + shift, direction, ANGLE, ASPECT)
    assert other.distance == pytest.approx(scale * one.distance, rel=1e-6)
    assert other.looks_at == pytest.approx(scale * np.array(one.looks_at) + shift, abs=1e-9 * (5.0 + scale))


def test_nothing_to_look_at_is_told():
    with pytest.raises(InvalidValueError, match="no points"):
        framing(np.empty((0, 3)), (1.0, 0.0, 0.0), ANGLE, ASPECT)
