"""The raster and the way along it: every corner, close to the line, within speed and acceleration."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.controllers import PathFollower, Raster
from palpate.controllers.paths.path_follower import SLOWEST, STEERING
from palpate.errors import InvalidValueError

PERIOD, SPEED, ACCELERATION = 1e-3, 0.05, 0.5
L_SHAPE = ((0.0, 0.0), (0.03, 0.0), (0.03, 0.02), (0.0, 0.04))

lengths = st.floats(1e-3, 0.2)


@settings(max_examples=100, deadline=None, derandomize=True)
@given(lengths, lengths, st.floats(0.05, 1.0), st.tuples(st.floats(-1, 1), st.floats(-1, 1)))
def test_a_raster_fills_its_rectangle_with_rows_no_further_apart_than_asked(width, depth, part, center):
    raster = Raster(width, depth, part * depth, center)
    corners = np.array(raster.corners())
    assert len(corners) == 2 * raster.rows
    low, high = corners.min(axis=0), corners.max(axis=0)
    assert high - low == pytest.approx([width, depth])
    assert (high + low) / 2 == pytest.approx(center, abs=1e-12)
    rows = corners[::2, 1]
    assert np.diff(rows) == pytest.approx(np.full(raster.rows - 1, depth / (raster.rows - 1)))
    assert np.diff(rows).max() <= raster.spacing * (1 + 1e-6)
    # one row fewer would be too few
    assert raster.rows == 2 or depth / (raster.rows - 2) > raster.spacing * (1 - 1e-6)
    steps = np.abs(np.diff(corners, axis=0))
    assert np.all((steps[:, 0] < 1e-12) != (steps[:, 1] < 1e-12))  # one axis at a time
    assert raster.length == pytest.approx(raster.rows * width + depth)


def test_a_spacing_that_divides_the_depth_is_kept_in_spite_of_rounding():
    assert Raster(0.04, 0.04, 0.004).rows == 11
    assert Raster(0.03, 0.3, 0.1).rows == 4


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan, math.inf])
def test_rasters_that_cannot_be_are_refused(bad):
    with pytest.raises(InvalidValueError, match="width"):
        Raster(bad, 0.04, 0.004)
    with pytest.raises(InvalidValueError, match="depth"):
        Raster(0.04, bad, 0.004)
    with pytest.raises(InvalidValueError, match="spacing"):
        Raster(0.04, 0.04, bad)
    with pytest.raises(InvalidValueError, match="must not exceed"):
        Raster(0.04, 0.04, 0.05)


def follow(corners, lag=0.0, slope=1.0, start=None, seconds=60.0, drift=(0.0, 0.0)):
    """Drive an ideal point, or one behind a servo with a lag; positions and commanded velocities."""
    follower = PathFollower(corners, ACCELERATION)
    reference = position = np.array(start or corners[0], dtype=float)
    positions, commands = [position], []
    for _ in range(round(seconds / PERIOD)):
        v = follower.velocity((float(position[0]), float(position[1])), slope, SPEED, PERIOD)
        if follower.finished:
            return np.array(positions), np.array(commands), follower
        reference = reference + PERIOD * (np.array(v) + drift)
        position = reference if lag == 0.0 else position + PERIOD / lag * (reference - position)
        positions.append(position)
        commands.append(v)
    raise AssertionError(f"not finished, at {position}")


@pytest.mark.parametrize("lag", [0.0, 0.02])
@pytest.mark.parametrize("corners", [L_SHAPE, Raster(0.02, 0.008, 0.004).corners()], ids=["L", "raster"])
def test_every_corner_is_reached_in_order(corners, lag):
    positions, _, follower = follow(corners, lag)
    last = 0
    for corner in corners:
        near = np.flatnonzero(np.linalg.norm(positions[last:] - corner, axis=1) < 3e-4)
        assert near.size, corner
        last += near[0]
    assert follower.finished
    assert follower.velocity((0.0, 0.0), 1.0, SPEED, PERIOD) == (0.0, 0.0)


@pytest.mark.parametrize(("lag", "bound"), [(0.0, 1.1e-4), (0.02, 4e-4)])
def test_the_path_stays_close_to_the_polygon(lag, bound):
    positions, _, _ = follow(L_SHAPE, lag)
    distance = np.full(len(positions), np.inf)
    for a, b in itertools.pairwise(np.array(L_SHAPE)):
        t = np.clip((positions - a) @ (b - a) / np.dot(b - a, b - a), 0.0, 1.0)
        distance = np.minimum(distance, np.linalg.norm(positions - a - t[:, None] * (b - a), axis=1))
    assert distance.max() < bound


def test_speed_and_acceleration_are_bounded_but_for_the_last_millimetre_per_second():
    """Only from the slowest speed, 1 mm/s, does the tip stop at once."""
    _, commands, _ = follow(L_SHAPE)
    speeds = np.linalg.norm(commands, axis=1)
    assert speeds.max() <= SPEED * (1 + 1e-3)
    jumps = np.linalg.norm(np.diff(commands, axis=0), axis=1)
    stops = speeds[1:] == 0.0
    assert np.all(jumps[stops] <= 1.1 * SLOWEST)
    steady = ~stops & (speeds[:-1] > 0.0)
    assert jumps[steady].max() / PERIOD <= 1.1 * ACCELERATION


def test_an_offset_from_the_line_is_taken_back_within_the_speed():
    """Started 30 mm beside the first leg, the tip still keeps to the speed it was given."""
    _, commands, _ = follow(L_SHAPE, start=(0.0, -0.03))
    assert np.linalg.norm(commands, axis=1).max() <= SPEED * (1 + 1e-3)


def test_a_drift_across_the_line_is_held_to_what_the_steering_allows():
    positions, _, _ = follow(((0.0, 0.0), (0.1, 0.0)), drift=(0.0, 0.002))
    assert np.abs(positions[:, 1]).max() <= 0.002 / STEERING * 1.01


@pytest.mark.parametrize("slope", [0.3, 0.7, 1.0])
def test_on_a_slope_the_speed_along_the_surface_is_kept(slope):
    _, commands, _ = follow(((0.0, 0.0), (0.05, 0.0)), slope=slope)
    along = np.linalg.norm(commands, axis=1) / slope
    assert along.max() == pytest.approx(SPEED)


@pytest.mark.slow
@settings(max_examples=50, deadline=None, derandomize=True)
@given(st.lists(st.floats(SLOWEST, 0.1), min_size=1, max_size=8), st.integers(50, 300))
def test_a_speed_that_changes_no_faster_than_the_acceleration_makes_no_jump(targets, hold):
    """While cruising as while braking for a corner; at a corner the tip rests from and to the slowest speed."""
    follower, speed, position, before = PathFollower(L_SHAPE, ACCELERATION), SPEED, np.zeros(2), np.zeros(2)
    most = ACCELERATION * PERIOD
    for i in range(hold * len(targets)):
        speed += min(max(targets[i // hold] - speed, -most), most)
        x, y = position.tolist()
        now = np.array(follower.velocity((x, y), 1.0, speed, PERIOD))
        if follower.finished:
            break
        change = np.linalg.norm(now - before)
        assert change <= 1.1 * (most if now.any() and before.any() else SLOWEST)
        assert np.linalg.norm(now) <= speed * (1 + 1e-9)
        position, before = position + PERIOD * now, now


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan, math.inf])
def test_followers_that_cannot_be_are_refused(bad):
    with pytest.raises(InvalidValueError, match="at least 2"):
        PathFollower(((0.0, 0.0),), ACCELERATION)
    with pytest.raises(InvalidValueError, match="acceleration"):
        PathFollower(L_SHAPE, bad)


def test_two_equal_corners_in_a_row_are_refused():
    with pytest.raises(InvalidValueError, match="corner"):
        PathFollower(((0.0, 0.0), (0.0, 0.0), (0.1, 0.0)), ACCELERATION)


def test_after_a_stop_the_tip_starts_again_from_rest():
    follower = PathFollower(((0.0, 0.0), (1.0, 0.0)), ACCELERATION)
    for _ in range(1000):
        follower.velocity((0.5, 0.0), 1.0, SPEED, PERIOD)
    follower.stop()
    speed = math.hypot(*follower.velocity((0.5, 0.0), 1.0, SPEED, PERIOD))
    assert speed == pytest.approx(ACCELERATION * PERIOD)
