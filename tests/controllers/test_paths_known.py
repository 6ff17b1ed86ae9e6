"""Paths planned before the run: rasters, spirals, taps, the follower along them, and marks where they fail."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from palpate.controllers import Raster
from palpate.controllers.paths import (
    Follow,
    Hop,
    LegEnd,
    LegResult,
    PathEvent,
    PathFollower,
    PathPlane,
    Spiral,
    Stroke,
    Taps,
    Waypoints,
    tap_grid,
)
from palpate.controllers.paths.path_follower import ARRIVAL_DISTANCE, MIN_CORNER_SPEED, STEERING_RATE
from support.paths_world import HeightWorld, explore

PERIOD, SPEED, ACCELERATION = 1e-3, 0.05, 0.5

L_SHAPE = ((0.0, 0.0), (0.03, 0.0), (0.03, 0.02), (0.0, 0.04))


@settings(max_examples=100, deadline=None, derandomize=True)
@given(
    st.floats(1e-3, 0.2), st.floats(1e-3, 0.2), st.floats(0.05, 1.0), st.tuples(st.floats(-1, 1), st.floats(-1, 1))
)
def test_a_raster_fills_its_rectangle_with_rows_no_further_apart_than_asked(width, depth, part, center):
    raster = Raster(width, depth, part * depth, center)
    corners = np.array(raster.corners())
    low, high = corners.min(axis=0), corners.max(axis=0)
    rows, steps = corners[::2, 1], np.abs(np.diff(corners, axis=0))
    assert len(corners) == 2 * raster.rows
    assert high - low == pytest.approx([width, depth])
    assert (high + low) / 2 == pytest.approx(center, abs=1e-12)
    assert np.diff(rows) == pytest.approx(np.full(raster.rows - 1, depth / (raster.rows - 1)))
    assert np.diff(rows).max() <= raster.spacing * (1 + 1e-6)
    # one row fewer would be too few, also where rounding hides that the spacing divides the depth
    assert raster.rows == 2 or depth / (raster.rows - 2) > raster.spacing * (1 - 1e-6)
    assert (Raster(0.04, 0.04, 0.004).rows, Raster(0.03, 0.3, 0.1).rows) == (11, 4)
    assert np.all((steps[:, 0] < 1e-12) != (steps[:, 1] < 1e-12))  # one axis at a time
    assert raster.length == pytest.approx(raster.rows * width + depth)


def follow(corners, lag=0.0, slope=1.0, start=None, drift=(0.0, 0.0), speed=SPEED):
    """Drive an ideal point, or one behind a servo with a lag; positions and commanded velocities."""
    follower = PathFollower(corners, ACCELERATION)
    reference = position = np.array(start or corners[0], dtype=float)
    positions, commands = [position], []
    for _ in range(round(60.0 / PERIOD)):
        v = follower.velocity((float(position[0]), float(position[1])), slope, speed, PERIOD)
        if follower.finished:
            assert follower.velocity((0.0, 0.0), 1.0, SPEED, PERIOD) == (0.0, 0.0)
            return np.array(positions), np.array(commands)
        reference = reference + PERIOD * (np.array(v) + drift)
        position = reference if lag == 0.0 else position + PERIOD / lag * (reference - position)
        positions.append(position)
        commands.append(v)
    raise AssertionError(f"not finished, at {position}")


@pytest.mark.parametrize(("lag", "bound"), [(0.0, 1.1e-4), (0.02, 4e-4)])
def test_the_path_stays_close_to_the_polygon(lag, bound):
    """A drift across the line is held to what the steering allows."""
    positions, _ = follow(L_SHAPE, lag)
    sides = [(a, b - a) for a, b in itertools.pairwise(np.array(L_SHAPE))]
    along = [np.clip((positions - a) @ way / (way @ way), 0.0, 1.0)[:, None] * way for a, way in sides]
    off = [np.linalg.norm(positions - a - to, axis=1) for (a, _), to in zip(sides, along, strict=True)]
    assert np.min(off, axis=0).max() < bound
    drifted, _ = follow(((0.0, 0.0), (0.1, 0.0)), drift=(0.0, 0.002))
    assert np.abs(drifted[:, 1]).max() <= 0.002 / STEERING_RATE * 1.01


@pytest.mark.parametrize("start", [None, (0.0, -0.03)], ids=["on the path", "30 mm beside it"])
def test_speed_and_acceleration_are_bounded_but_for_the_last_millimetre_per_second(start):
    """Only from the slowest speed, 1 mm/s, does the tip stop at once."""
    _, commands = follow(L_SHAPE, start=start)
    speeds = np.linalg.norm(commands, axis=1)
    jumps, stops = np.linalg.norm(np.diff(commands, axis=0), axis=1), speeds[1:] == 0.0
    assert speeds.max() <= SPEED * (1 + 1e-3)
    if start is None:
        assert jumps[stops].max() <= 1.1 * MIN_CORNER_SPEED
        assert jumps[~stops & (speeds[:-1] > 0.0)].max() / PERIOD <= 1.1 * ACCELERATION


@pytest.mark.slow
@settings(max_examples=50, deadline=None, derandomize=True)
@given(st.lists(st.floats(MIN_CORNER_SPEED, 0.1), min_size=1, max_size=8), st.integers(50, 300))
def test_a_speed_that_changes_no_faster_than_the_acceleration_makes_no_jump(targets, hold):
    """While cruising as while braking for a corner; at a corner the tip rests from and to the slowest speed."""
    follower, speed, position, before = PathFollower(L_SHAPE, ACCELERATION), SPEED, np.zeros(2), np.zeros(2)
    most = ACCELERATION * PERIOD
    for target in np.repeat(targets, hold):
        speed += min(max(target - speed, -most), most)
        now = np.array(follower.velocity(tuple(position.tolist()), 1.0, speed, PERIOD))
        if follower.finished:
            break
        assert np.linalg.norm(now - before) <= 1.1 * (most if now.any() and before.any() else MIN_CORNER_SPEED)
        assert np.linalg.norm(now) <= speed * (1 + 1e-9)
        position, before = position + PERIOD * now, now


def test_after_a_stop_the_tip_starts_again_from_rest():
    """On a slope the speed along the surface is kept."""
    follower = PathFollower(((0.0, 0.0), (1.0, 0.0)), ACCELERATION)
    for _ in range(1000):
        follower.velocity((0.5, 0.0), 1.0, SPEED, PERIOD)
    follower.stop()
    assert math.hypot(*follower.velocity((0.5, 0.0), 1.0, SPEED, PERIOD)) == pytest.approx(ACCELERATION * PERIOD)
    for slope in (0.3, 0.7, 1.0):
        _, commands = follow(((0.0, 0.0), (0.05, 0.0)), slope=slope)
        assert np.linalg.norm(commands, axis=1).max() / slope == pytest.approx(SPEED)


SQUARE = Waypoints(((0.0, 0.0), (0.02, 0.0), (0.02, 0.02), (0.0, 0.02)))


def level(u, v):
    return 0.0 * u


spirals = st.builds(
    lambda radius, part, center: Spiral(radius, part * radius, center),
    st.floats(2e-3, 0.05),
    st.floats(0.1, 1.0),
    st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5)),
)


@settings(max_examples=20, deadline=None, derandomize=True)
@given(spirals)
def test_a_spiral_is_evenly_stepped_and_its_turns_evenly_apart(spiral):
    """r = spacing theta / 2 pi: one turn further out is one spacing further out."""
    points = np.array(spiral.corners()) - spiral.center
    r, turns = np.hypot(*points.T), np.unwrap(np.arctan2(points[1:, 1], points[1:, 0]))
    chords = np.hypot(*np.diff(points, axis=0).T)
    fine = np.array(Spiral(spiral.radius, spiral.spacing, step=spiral.spacing / 50).corners())
    assert r[0] == 0.0
    assert r[-1] == r.max() == pytest.approx(spiral.radius)
    if len(points) > 40 and np.abs(np.diff(turns)).max() < 2.5:  # the angle is followed from chord to chord
        assert np.diff(r[1:]) == pytest.approx(spiral.spacing * np.diff(turns) / (2 * np.pi), abs=1e-9)
    # chords are shorter than their arcs
    assert chords.max() <= min(spiral.length / (len(points) - 1), spiral.step) * (1 + 1e-9)
    assert np.hypot(*np.diff(fine, axis=0).T).sum() == pytest.approx(spiral.length, rel=1e-3)


def test_a_curve_is_followed_at_constant_speed_without_stops():
    """The heading turns evenly: one that jumped at every chord would shake the arm."""
    spiral = Spiral(8e-3, 2e-3)
    near = np.array(spiral.corners())
    path, v = follow(spiral.corners(), speed=0.02)
    size = np.hypot(*v.T)
    # where the spiral is wider than v^2 / a = 0.8 mm, the speed is constant, but for the end
    wide = size[np.hypot(*path[:-1].T) > 1.5e-3][:-60]
    off = np.min(np.hypot(*(path[::20, None] - near[None]).transpose(2, 0, 1)), axis=1)
    assert size.max() <= 0.02 * (1 + 1e-9)
    assert wide == pytest.approx(np.full(len(wide), 0.02), rel=1e-6)
    assert off.max() < 0.5 * spiral.step + 5e-5
    assert np.hypot(*(path[-1] - near[-1])) < 2e-4
    path, v = follow(Spiral(8e-3, 2e-3, step=5e-4).corners(), speed=0.02)
    inner = v[:-60][np.hypot(*path.T)[: len(v) - 60] > 3e-3]
    # a period's turn on the spiral itself is 0.02 m/s * 1 ms / radius; a jump would be 25 times as large
    assert np.diff(np.unwrap(np.arctan2(inner[:, 1], inner[:, 0]))).max() < 2.5 * 2e-5 / 3e-3


STEEP = math.radians(70.0)


@settings(max_examples=30, deadline=None, derandomize=True)
@given(st.integers(1, 40), st.integers(1, 40), st.floats(5e-4, 3e-3), st.tuples(*[st.floats(-0.9, 0.0)] * 2))
def test_a_grid_of_taps_covers_its_rectangle_and_every_tap_is_tried(columns, rows, spacing, less):
    width, depth = spacing * (columns + less[0]), spacing * (rows + less[1])
    points = tap_grid(width, depth, spacing)
    taps = Taps(points)
    legs = explore(taps, HeightWorld(level, missing=lambda u, v: u > 0.0))
    assert tuple(leg.at for leg in legs) == points
    assert max(math.dist(a, b) for a, b in itertools.pairwise(points)) <= spacing * (1 + 1e-6)
    assert np.ptp(points, axis=0) == pytest.approx([width, depth])
    assert [mark.event for mark in taps.marks] == [PathEvent.UNREACHABLE] * sum(u > 0.0 for u, _ in points)


def test_a_path_is_one_landing_and_one_stroke_through_all_corners():
    """A second run asks for the same; a loss and a first landing on nothing end the path with a mark."""
    raster = Raster(0.02, 0.01, 0.005)
    path, lost = Follow(raster), Follow(SQUARE)
    hop, stroke = explore(path, HeightWorld(level))
    assert (hop.to, *stroke.corners) == raster.corners()
    assert path.marks == ()
    assert explore(path, HeightWorld(level)) == [hop, stroke]
    assert explore(path, HeightWorld(level, missing=lambda u, v: True)) == [Hop((-0.01, -0.005))]
    assert [mark.event for mark in path.marks] == [PathEvent.UNREACHABLE]
    assert len(explore(lost, HeightWorld(level, lost=lambda u, v: v > 0.01))) == 2
    assert [mark.event for mark in lost.marks] == [PathEvent.LOST]
    assert lost.marks[0].position == pytest.approx((0.02, 0.01, 0.0), abs=3e-4)


def test_steep_places_are_marked_left_out_and_passed():
    """A wall across the second side, beyond which the third and last corners lie; a fine curve goes on further."""
    path = Follow(SQUARE)
    world = HeightWorld(lambda u, v: 10.0 * max(v - 0.008, 0.0) if v < 0.012 else 0.04, steep=STEEP)
    legs = explore(path, world)
    assert [mark.event for mark in path.marks] == [PathEvent.STEEP, PathEvent.STEEP]
    assert path.marks[0].position[1] == pytest.approx(0.008, abs=3e-4)
    # 2 mm on it is still steep; 4 mm further it is not
    assert [type(leg) for leg in legs] == [Hop, Stroke, Hop, Stroke, Hop, Stroke]
    assert [leg.to[1] for leg in legs[2::2]] == pytest.approx([0.010, 0.014], abs=3e-4)
    assert world.at == (0.0, 0.02)
    fine, world = Follow(Spiral(8e-3, 4e-3)), HeightWorld(lambda u, v: 10.0 * max(u - 5e-3, 0.0), steep=STEEP)
    # at most the part of the length beyond the wall, divided by the length left out each time
    assert 2 < sum(isinstance(leg, Hop) for leg in explore(fine, world)) < 20
    assert {mark.event for mark in fine.marks} == {PathEvent.STEEP}
    assert math.hypot(*world.at) > 7e-3


@settings(max_examples=20, deadline=None, derandomize=True)
@given(st.integers(1, 60))
def test_of_what_lies_beside_the_object_the_number_of_tries_grows_with_the_logarithm_of_its_length(rows):
    """The rows behind the first are missed: each try leaves out twice the length of the last one."""
    raster = Raster(0.02, 0.001 * rows, 0.001)
    path, first = Follow(raster), raster.corners()[0][1]
    edge = HeightWorld(
        lambda u, v: 10.0 * max(v - first - 4e-4, 0.0), steep=STEEP, missing=lambda u, v: v > first + 1e-6
    )
    legs = explore(path, edge)
    missed = [mark for mark in path.marks if mark.event is PathEvent.UNREACHABLE]
    assert path.marks[0].event is PathEvent.STEEP
    assert len(missed) <= 1 + math.log2(1.0 + raster.length / 2e-3)
    assert len(legs) == 2 + len(missed)


def test_after_something_was_met_again_little_is_left_out_again():
    """Two holes far apart: behind the second the path goes on as near as behind the first."""
    path = Follow(Waypoints(tuple((1e-3 * k, 0.0) for k in range(60))))

    def height(u, v):
        return 10.0 * max(u - 0.0101, 0.0) if u < 0.0105 else 10.0 * max(u - 0.0401, 0.0) if u < 0.0405 else 0.0

    world = HeightWorld(height, steep=STEEP, missing=lambda u, v: 0.0105 < u < 0.0165)
    hops = [leg.to[0] for leg in explore(path, world) if isinstance(leg, Hop)]
    assert hops[1:] == pytest.approx([0.0121, 0.0161, 0.0241, 0.0421], abs=3e-4)


def test_planes_turn_paths_and_come_back():
    plane = PathPlane((0.1, 0.2, 0.3), ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)))
    assert plane.axis == (1.0, 0.0, 0.0)
    assert plane.flat(plane.base((0.01, 0.02), 0.03)) == pytest.approx((0.01, 0.02, 0.03))
    assert plane.slopes((1.0, 0.0, 0.0)) == (0.0, 0.0)
    assert plane.slopes((0.0, 1.0, 0.0)) is None
    assert plane.steepness((0.0, 1.0, 0.0)) == pytest.approx(math.pi / 2)


def test_the_end_of_a_blocked_leg_is_reported_with_its_reason():
    """A landing that is blocked at the second try is marked where it should have been."""
    path = Follow(SQUARE)
    path.next(None)
    path.next(LegResult(LegEnd.REACHED, (0.0, 0.0, 0.0)))
    first = path.next(LegResult(LegEnd.BLOCKED, (0.01, 0.0, 0.0)))
    second = path.next(LegResult(LegEnd.BLOCKED, (0.01, 0.0, 0.05)))
    assert (*first.to, *second.to) == pytest.approx((0.012, 0.0, 0.016, 0.0))  # pyright: ignore[reportAttributeAccessIssue]
    assert [mark.event for mark in path.marks] == [PathEvent.BLOCKED, PathEvent.UNREACHABLE]
    assert "force" in path.marks[0].reason
    assert path.marks[1].position == pytest.approx((0.012, 0.0, 0.05))


@settings(max_examples=6, deadline=None, derandomize=True)
@given(
    st.lists(st.tuples(st.floats(-0.02, 0.02), st.floats(-0.02, 0.02)), min_size=2, max_size=6),
    st.sampled_from([0.0, 0.02]),
)
@example(L_SHAPE, 0.0)
@example(L_SHAPE, 0.02)
@example(Raster(0.02, 0.008, 0.004).corners(), 0.0)
@example(Raster(0.02, 0.008, 0.004).corners(), 0.02)
def test_every_corner_is_reached_in_order_within_speed_and_acceleration(corners, lag):
    assume(min(math.dist(a, b) for a, b in itertools.pairwise(corners)) > 1e-3)
    positions, commands = follow(tuple(corners), lag, speed=0.02)
    last, speeds = 0, np.linalg.norm(commands, axis=1)
    for corner in corners:
        near = np.flatnonzero(np.linalg.norm(positions[last:] - corner, axis=1) < 3e-4)
        assert near.size, corner
        last += near[0]
    assert speeds.max() <= 0.02 * (1 + 1e-9)
    # faster by no more than a, and by the correction of the tenth of a millimetre that a corner leaves
    assert lag or np.diff(speeds).max() <= ACCELERATION * PERIOD + STEERING_RATE * ARRIVAL_DISTANCE + 1e-9
