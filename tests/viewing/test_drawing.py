"""Drawing of the view: framing by a camera, legend and colours, the map of touched points."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.errors import InvalidValueError
from palpate.kinematics.framing import framing
from palpate.runtime import palette
from palpate.viewing import touch_map
from palpate.viewing.look import LOST, legend, linear_rgb, style_sheet
from palpate.viewing.touch_map import TouchMap

SPACING = 1e-3
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


def test_what_the_style_sheet_needs_is_in_it():
    sheet = style_sheet()
    assert sheet.count("{") == sheet.count("}")
    assert LOST in sheet
    assert palette.GROUND.dark in sheet
    assert '"' not in LOST, "it stands in quotation marks"
    without, with_map = (legend(0.015, has_map=each) for each in (False, True))
    assert "map" in with_map
    assert "still to go" in with_map
    assert "map" not in without
    assert "still to go" not in without


def test_arrows_shine_as_the_felt_force_is_drawn():
    """viser takes them for linear light: back through the curve of sRGB they are what they shall be."""
    shown = [255.0 * (1.055 * (each / 255.0) ** (1 / 2.4) - 0.055 if each > 1 else 12.92 * each / 255.0)
             for each in linear_rgb(palette.FELT)]  # fmt: skip
    assert shown == pytest.approx(palette.rgb(palette.FELT), abs=3.0)


@given(st.integers(0, 2**32 - 1), st.lists(st.integers(0, 50), max_size=6))
def test_one_point_per_cube_and_none_far_from_what_was_touched(seed, sizes):
    points, found, begin = np.random.default_rng(seed).uniform(-0.01, 0.01, (sum(sizes), 3)), TouchMap(SPACING), 0
    for size in sizes:
        found.add(points[begin : begin + size])
        begin += size
    kept = found.points
    cubes = np.floor(kept / SPACING).astype(int)
    assert len(np.unique(cubes, axis=0)) == len(kept) == len(found)
    assert {tuple(p) for p in kept.tolist()} <= {tuple(p) for p in points.tolist()}
    for point in points:
        assert np.abs(kept - point).max(axis=1).min() < SPACING, "every touch has a point of the map in its cube"
    whole = TouchMap(SPACING)
    whole.add(points)
    assert (whole.points == kept).all(), "in parts or at once"


def test_a_map_gets_coarser_rather_than_endless(monkeypatch):
    monkeypatch.setattr(touch_map, "MOST_POINTS", 500)
    found = TouchMap(SPACING)
    for _ in range(5):
        found.add(np.random.default_rng(0).uniform(0.0, 0.05, (2000, 3)))
        assert len(found) <= 500
    assert found.coarsened >= 1
    assert found.spacing == SPACING * 2.0**found.coarsened
    found.clear()
    assert (len(found), found.spacing, found.chunks) == (0, SPACING, 0)


def test_chunks_are_the_map():
    found = TouchMap(1e-4)
    found.add(np.random.default_rng(0).uniform(0.0, 0.1, (4500, 3)))
    assert found.chunks == -(-len(found) // touch_map.CHUNK)
    assert np.concatenate([found.chunk(i) for i in range(found.chunks)]) == pytest.approx(found.points)
