"""Paths known beforehand: how they are spaced, that all is tried, and what is left out is marked."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
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
from palpate.controllers.paths.path_follower import ARRIVED, STEERING
from palpate.errors import InvalidValueError
from support.paths_world import HeightWorld, explore

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
    points = np.array(spiral.corners()) - spiral.center
    r = np.hypot(*points.T)
    assert r[0] == 0.0
    assert r[-1] == pytest.approx(spiral.radius)
    assert r.max() <= spiral.radius * (1 + 1e-9)
    # r = spacing theta / 2 pi: one turn further out is one spacing further out
    turns = np.unwrap(np.arctan2(points[1:, 1], points[1:, 0]))
    if len(points) > 40:  # the angle is followed from chord to chord
        fine = np.abs(np.diff(turns)).max() < 2.5
        if fine:
            assert np.diff(r[1:]) == pytest.approx(spiral.spacing * np.diff(turns) / (2 * np.pi), abs=1e-9)
    # chords are shorter than their arcs, by less than the arc's curvature (2 / pitch in the middle) allows
    chords = np.hypot(*np.diff(points, axis=0).T)
    assert chords.max() <= spiral.length / (len(points) - 1) * (1 + 1e-9)
    assert chords.max() <= spiral.step * (1 + 1e-9)
    # the length of the spiral, by chords ten times finer
    fine_points = np.array(Spiral(spiral.radius, spiral.spacing, step=spiral.spacing / 50).corners())
    assert np.hypot(*np.diff(fine_points, axis=0).T).sum() == pytest.approx(spiral.length, rel=1e-3)


@settings(max_examples=20, deadline=None, derandomize=True)
@given(spirals)
def test_every_place_of_the_disc_lies_within_half_a_spacing_of_the_spiral(spiral):
    a = spiral.spacing / (2 * np.pi)
    rng = np.random.default_rng(0)
    r = (spiral.radius - 0.5 * spiral.spacing) * np.sqrt(rng.uniform(size=50))
    angle = rng.uniform(0, 2 * np.pi, 50)
    for radius, phi in zip(r, angle, strict=False):
        turns = np.arange(0, int(spiral.radius / spiral.spacing) + 2)
        on = a * (phi + 2 * np.pi * turns)
        assert np.abs(on - radius).min() <= 0.5 * spiral.spacing * (1 + 1e-9) or radius < spiral.spacing


def run(corners, speed=0.02, acceleration=0.5, period=1e-3):
    follower = PathFollower(corners, acceleration)
    at = np.array(corners[0], float)
    path, speeds = [at], []
    for _ in range(200_000):
        v = np.array(follower.velocity(tuple(at), 1.0, speed, period))
        if follower.finished:
            return np.array(path), np.array(speeds)
        at = at + period * v
        path.append(at)
        speeds.append(v)
    raise AssertionError("not finished")


def test_a_curve_is_followed_at_constant_speed_without_stops():
    spiral = Spiral(8e-3, 2e-3)
    path, v = run(spiral.corners())
    size = np.hypot(*v.T)
    assert size.max() <= 0.02 * (1 + 1e-9)
    # where the spiral is wider than v^2 / a = 0.8 mm, the speed is the one asked for, but for the end
    wide = np.hypot(*path[:-1].T) > 1.5e-3
    assert size[wide][:-60] == pytest.approx(np.full(wide.sum() - 60, 0.02), rel=1e-6)
    near = np.array(spiral.corners())
    off = np.min(np.hypot(*(path[::20, None] - near[None]).transpose(2, 0, 1)), axis=1)
    assert off.max() < 0.5 * spiral.step + 5e-5
    assert np.hypot(*(path[-1] - near[-1])) < 2e-4


def test_along_a_curve_of_chords_the_heading_turns_evenly():
    """A heading that jumped at every chord would shake what carries the tip."""
    spiral = Spiral(8e-3, 2e-3, step=5e-4)
    path, v = run(spiral.corners())
    radius = np.hypot(*path.T)[: len(v)]
    wide = (radius > 3e-3) & (np.arange(len(v)) < len(v) - 60)
    heading = np.unwrap(np.arctan2(v[wide, 1], v[wide, 0]))
    # a period's turn on the spiral itself is 0.02 m/s * 1 ms / radius; a jump would be 25 times as large
    assert np.diff(heading).max() < 2.5 * 2e-5 / 3e-3


@settings(max_examples=6, deadline=None, derandomize=True)
@given(st.lists(st.tuples(st.floats(-0.02, 0.02), st.floats(-0.02, 0.02)), min_size=2, max_size=6))
def test_whatever_the_path_speed_and_acceleration_are_kept_and_every_corner_reached(corners):
    corners = tuple(c for k, c in enumerate(corners) if k == 0 or math.dist(c, corners[k - 1]) > 1e-3)
    if len(corners) < 2 or any(math.dist(a, b) <= 1e-3 for a, b in itertools.pairwise(corners)):
        return
    path, v = run(corners)
    assert np.hypot(*v.T).max() <= 0.02 * (1 + 1e-9)
    for corner in corners:
        assert np.hypot(*(path - corner).T).min() < 3e-4
    # faster by no more than a, and by what takes back the tenth of a millimetre that a corner leaves
    assert np.diff(np.hypot(*v.T)).max() <= 0.5 * 1e-3 + STEERING * ARRIVED + 1e-9


@settings(max_examples=30, deadline=None, derandomize=True)
@given(st.floats(1e-3, 0.1), st.floats(1e-3, 0.1), st.floats(5e-4, 0.03))
def test_a_grid_of_taps_covers_its_rectangle_and_every_tap_is_tried(width, depth, spacing):
    if (width / spacing + 2) * (depth / spacing + 2) > 2000:
        return
    points = tap_grid(width, depth, spacing)
    world = HeightWorld(level, missing=lambda u, v: u > 0.0)
    taps = Taps(points)
    legs = explore(taps, world)
    assert tuple(leg.at for leg in legs) == points
    steps = [math.dist(a, b) for a, b in itertools.pairwise(points)]
    assert max(steps) <= spacing * (1 + 1e-6)
    low, high = np.min(points, axis=0), np.max(points, axis=0)
    assert high - low == pytest.approx([width, depth])
    missed = [mark for mark in taps.marks if mark.event is PathEvent.UNREACHABLE]
    assert len(missed) == len(taps.marks) == sum(u > 0.0 for u, _ in points)


def test_a_path_is_one_landing_and_one_stroke_through_all_corners():
    raster = Raster(0.02, 0.01, 0.005)
    follow = Follow(raster)
    hop, stroke = explore(follow, HeightWorld(level))
    assert (hop.to, *stroke.corners) == raster.corners()
    assert follow.marks == ()
    # told the same again it asks for the same
    assert explore(follow, HeightWorld(level)) == [hop, stroke]


def test_a_loss_ends_it_with_a_mark():
    follow = Follow(SQUARE)
    legs = explore(follow, HeightWorld(level, lost=lambda u, v: v > 0.01))
    assert len(legs) == 2
    assert [mark.event for mark in follow.marks] == [PathEvent.LOST]
    assert follow.marks[0].position == pytest.approx((0.02, 0.01, 0.0), abs=3e-4)


def test_steep_places_are_marked_left_out_and_passed():
    # a wall across the second side; the third and last corners are beyond it
    def height(u, v):
        return 10.0 * max(v - 0.008, 0.0) if v < 0.012 else 0.04

    follow = Follow(SQUARE)
    world = HeightWorld(height, steep=math.radians(70.0))
    legs = explore(follow, world)
    assert [mark.event for mark in follow.marks] == [PathEvent.STEEP, PathEvent.STEEP]
    assert follow.marks[0].position[1] == pytest.approx(0.008, abs=3e-4)
    # 2 mm on it is still steep; 4 mm further it is not
    assert [type(leg) for leg in legs] == [Hop, Stroke, Hop, Stroke, Hop, Stroke]
    assert [leg.to[1] for leg in legs[2::2]] == pytest.approx([0.010, 0.014], abs=3e-4)
    assert world.at == (0.0, 0.02)


def test_where_nothing_is_met_at_first_it_is_given_up():
    follow = Follow(Raster(0.02, 0.01, 0.005))
    legs = explore(follow, HeightWorld(level, missing=lambda u, v: True))
    assert legs == [Hop((-0.01, -0.005))]
    assert [mark.event for mark in follow.marks] == [PathEvent.UNREACHABLE]


@settings(max_examples=20, deadline=None, derandomize=True)
@given(st.integers(1, 60))
def test_of_what_lies_beside_the_object_the_number_of_tries_grows_with_the_logarithm_of_its_length(rows):
    """The rows behind the first are missed: each try leaves out twice what the last one did."""
    raster = Raster(0.02, 0.001 * rows, 0.001)
    first = raster.corners()[0][1]

    def height(u, v):
        return 10.0 * max(v - first - 4e-4, 0.0)

    follow = Follow(raster)
    world = HeightWorld(height, steep=math.radians(70.0), missing=lambda u, v: v > first + 1e-6)
    legs = explore(follow, world)
    assert [mark.event for mark in follow.marks[:1]] == [PathEvent.STEEP]
    missed = [mark for mark in follow.marks if mark.event is PathEvent.UNREACHABLE]
    assert len(missed) <= 1 + math.log2(1.0 + raster.length / 2e-3)
    assert len(legs) == 2 + len(missed)


def test_after_something_was_met_again_little_is_left_out_again():
    """Two holes far apart: behind the second the path goes on as near as behind the first."""
    points = Waypoints(tuple((1e-3 * k, 0.0) for k in range(60)))
    follow = Follow(points)

    def height(u, v):
        return 10.0 * max(u - 0.0101, 0.0) if u < 0.0105 else 10.0 * max(u - 0.0401, 0.0) if u < 0.0405 else 0.0

    world = HeightWorld(height, steep=math.radians(70.0), missing=lambda u, v: 0.0105 < u < 0.0165)
    hops = [leg.to[0] for leg in explore(follow, world) if isinstance(leg, Hop)]
    assert hops[1:] == pytest.approx([0.0121, 0.0161, 0.0241, 0.0421], abs=3e-4)


def test_after_a_steep_place_a_fine_curve_goes_on_further():
    spiral = Spiral(8e-3, 4e-3)
    follow = Follow(spiral)
    world = HeightWorld(lambda u, v: 10.0 * max(u - 5e-3, 0.0), steep=math.radians(70.0))
    legs = explore(follow, world)
    hops = [leg.to for leg in legs if isinstance(leg, Hop)]
    # at most the part of the length beyond the wall, divided by what is left out each time
    assert 2 < len(hops) < 20
    assert all(mark.event is PathEvent.STEEP for mark in follow.marks)
    assert math.hypot(*world.at) > 7e-3


def test_planes_turn_paths_and_come_back():
    plane = PathPlane((0.1, 0.2, 0.3), ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)))
    assert plane.axis == (1.0, 0.0, 0.0)
    assert plane.flat(plane.base((0.01, 0.02), 0.03)) == pytest.approx((0.01, 0.02, 0.03))
    assert plane.slopes((1.0, 0.0, 0.0)) == (0.0, 0.0)
    assert plane.slopes((0.0, 1.0, 0.0)) is None
    assert plane.steepness((0.0, 1.0, 0.0)) == pytest.approx(math.pi / 2)
    with pytest.raises(InvalidValueError, match="rotation"):
        PathPlane(rotation_base_plane=((2.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)))


def test_paths_that_cannot_be_are_refused():
    with pytest.raises(InvalidValueError, match="spacing"):
        Spiral(0.01, 0.02)
    with pytest.raises(InvalidValueError, match="at least 2"):
        Waypoints(((0.0, 0.0),))
    with pytest.raises(InvalidValueError, match="apart"):
        Waypoints(((0.0, 0.0), (0.0, 0.0)))
    with pytest.raises(InvalidValueError, match="finite"):
        Waypoints(((0.0, 0.0), (math.nan, 0.0)))
    with pytest.raises(InvalidValueError, match="points"):
        Taps(())
    with pytest.raises(InvalidValueError, match="corners"):
        Stroke(())
    with pytest.raises(InvalidValueError, match="direction"):
        PathFollower(((0.0, 0.0), (0.0, 0.0)), 0.5)


def test_the_end_of_a_blocked_leg_is_reported_with_its_reason():
    follow = Follow(SQUARE)
    follow.next(None)
    follow.next(LegResult(LegEnd.REACHED, (0.0, 0.0, 0.0)))
    leg = follow.next(LegResult(LegEnd.BLOCKED, (0.01, 0.0, 0.0)))
    assert isinstance(leg, Hop)
    assert leg.to == pytest.approx((0.012, 0.0))
    # beside the object at the second try: a landing that is blocked is marked where it should have been
    leg = follow.next(LegResult(LegEnd.BLOCKED, (0.01, 0.0, 0.05)))
    assert follow.marks[1].event is PathEvent.UNREACHABLE
    assert follow.marks[1].position == pytest.approx((0.012, 0.0, 0.05))
    assert isinstance(leg, Hop)
    assert leg.to == pytest.approx((0.016, 0.0))
    assert follow.marks[0].event is PathEvent.BLOCKED
    assert "force" in follow.marks[0].reason
