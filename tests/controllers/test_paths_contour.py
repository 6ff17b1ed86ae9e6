"""Round an object once: the way closes, keeps its level or its lean, and says so where it does not."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.controllers.paths import (
    ContactPeriod,
    Contour,
    EdgeSteering,
    LegEnd,
    LegResult,
    LevelSteering,
    PathEvent,
    PathPlane,
    Turn,
)
from palpate.errors import InvalidValueError
from support.paths_world import STEP, LevelSet, circle_round

R = 4e-3


def rounded_box(half, rounding):
    def distance(p):
        q = [abs(a) - (h - rounding) for a, h in zip(p, half, strict=False)]
        outside = math.hypot(*[max(a, 0.0) for a in q])
        return outside + min(max(q), 0.0) - rounding

    return distance


def sphere(radius):
    return lambda p: math.hypot(*p) - radius


def tilted_ellipse_cylinder(a, b):
    """A vertical elliptic cylinder with a round top edge would do; here its distance by Newton's iteration."""

    def distance(p):
        x, y = abs(p[0]), abs(p[1])
        t = math.atan2(a * y, b * x)
        for _ in range(30):
            f = (a * a - b * b) * math.cos(t) * math.sin(t) - x * a * math.sin(t) + y * b * math.cos(t)
            d = (a * a - b * b) * math.cos(2 * t) - x * a * math.cos(t) - y * b * math.sin(t)
            t = min(max(t - f / d, 0.0), math.pi / 2)
        away = math.hypot(x - a * math.cos(t), y - b * math.sin(t))
        outside = (x / a) ** 2 + (y / b) ** 2 > 1.0
        return away if outside else -away

    return distance


LEVEL = PathPlane((0.0, 0.0, -5e-3))


@settings(max_examples=5, deadline=None, derandomize=True)
@given(st.floats(0.015, 0.03), st.sampled_from(Turn))
def test_on_a_sphere_it_closes_on_the_circle_of_its_level(radius, turn):
    world = LevelSet(sphere(radius), R)
    wanted = math.sqrt((radius + R) ** 2 - 5e-3**2)
    contour = Contour((0.8 * (radius + R), 0.0), LevelSteering(LEVEL, turn), LEVEL, 0.5)
    path = circle_round(contour, world)
    assert contour.closed
    assert contour.marks == ()
    assert contour.gone == pytest.approx(2 * math.pi * wanted, abs=2.5e-3)
    on = path[np.abs(path[:, 2] + 5e-3) < 2e-4]
    assert np.hypot(on[:, 0], on[:, 1]) == pytest.approx(np.full(len(on), wanted), abs=2e-4)
    turned = np.unwrap(np.arctan2(on[:, 1], on[:, 0]))
    assert np.sign(turned[-1] - turned[0]) == turn


@pytest.mark.slow
@pytest.mark.parametrize(
    ("distance", "at", "round_trip"),
    [
        # a box 40 x 24 mm, corners of the tip's way rounded by rounding + R
        (rounded_box((0.02, 0.012, 0.03), 2e-3), (0.0225, 0.0), 4 * (0.018 + 0.010) + 2 * math.pi * 6e-3),
        (tilted_ellipse_cylinder(0.02, 0.012), None, None),
    ],
    ids=["rounded box", "ellipse"],
)
def test_round_other_sections_it_closes_too(distance, at, round_trip):
    world = LevelSet(distance, R)
    contour = Contour(at or (0.0, 0.0), LevelSteering(LEVEL), LEVEL, 0.5)
    if at is None:  # no top to land on: begin on the side
        world.land = lambda point: (0.0, 0.016, -5e-3)
        t = np.linspace(0, 2 * np.pi, 20001)
        ellipse = np.sum(np.hypot(0.02 * np.sin(t), 0.012 * np.cos(t))) * (t[1] - t[0])
        round_trip = ellipse + 2 * math.pi * R  # of a parallel curve (Steiner)
    path = circle_round(contour, world)
    assert contour.closed
    assert contour.gone == pytest.approx(round_trip, abs=2.5e-3)
    off = [abs(distance(tuple(p)) - R) for p in path]
    assert max(off) < 1e-6


@settings(max_examples=5, deadline=None, derandomize=True)
@given(st.floats(0.2, 0.9))
def test_an_edge_is_followed_at_the_offset_asked_for(part):
    world = LevelSet(rounded_box((0.02, 0.015, 0.01), 1e-5), R)
    steering = EdgeSteering.at_offset(PathPlane(), part * R, R, (1.0, 0.2, 0.0))
    contour = Contour((0.01, 0.0), steering, PathPlane(), 0.5)
    path = circle_round(contour, world)
    assert contour.closed
    x, y = np.abs(path[len(path) // 4 :, :2]).T
    outside = np.hypot(np.maximum(x - 0.02, 0.0), np.maximum(y - 0.015, 0.0))
    assert np.quantile(np.abs(outside - part * R), 0.95) < 0.05 * R
    # straight sides and a quarter circle of the offset at each corner
    assert contour.gone == pytest.approx(0.14 + 2 * math.pi * part * R, abs=3e-3)


def test_what_does_not_close_is_marked_and_so_is_what_cannot_be_followed():
    world = LevelSet(sphere(0.02), R)
    short = Contour((0.02, 0.0), LevelSteering(LEVEL), LEVEL, 0.05)
    circle_round(short, world)
    assert not short.closed
    assert [mark.event for mark in short.marks] == [PathEvent.OPEN]
    flat = LevelSet(lambda p: p[2], R)
    stuck = Contour((0.0, 0.0), LevelSteering(LEVEL), LEVEL, 0.05)
    circle_round(stuck, flat)
    assert [mark.event for mark in stuck.marks] == [PathEvent.BLOCKED]
    missed = Contour((0.05, 0.0), LevelSteering(LEVEL), LEVEL, 0.05)
    circle_round(missed, world)
    assert [mark.event for mark in missed.marks] == [PathEvent.UNREACHABLE]
    assert missed.beginning is None


def test_passing_close_to_the_beginning_is_not_closing():
    # a hairpin: the way back runs 0.8 mm beside the way out, within the tolerance
    contour = Contour((0.0, 0.0), LevelSteering(PathPlane()), PathPlane(), 1.0)
    contour.next(None)
    contour.next(LegResult(LegEnd.REACHED, (0.0, 0.0, 0.0)))
    out = [(x, 0.0, 0.0) for x in np.arange(0.0, 0.03, STEP)]
    back = [(x, 8e-4, 0.0) for x in np.arange(0.03, -0.02, -STEP)]
    assert not any(contour.feel(ContactPeriod(p, p, (0.0, 1.0, 0.0))) for p in out + back)


def test_steering_that_cannot_be_is_refused():
    with pytest.raises(InvalidValueError, match="lean"):
        EdgeSteering(PathPlane(), math.radians(89.0), R, (1.0, 0.0, 0.0))
    with pytest.raises(InvalidValueError, match="offset"):
        EdgeSteering.at_offset(PathPlane(), 1.1 * R, R, (1.0, 0.0, 0.0))
    with pytest.raises(InvalidValueError, match="outward"):
        EdgeSteering(PathPlane(), 0.5, R, (0.0, 0.0, 1.0))
    with pytest.raises(InvalidValueError, match="lookahead"):
        LevelSteering(PathPlane(), lookahead=0.0)
