"""Contours that close on their level or edge, and features under a round tip: edges, steps, holes and grooves."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.controllers.paths import (
    ContactPeriod,
    Contour,
    EdgeSteering,
    FeatureLimits,
    FeatureWatch,
    LegEnd,
    LegResult,
    LevelSteering,
    PathEvent,
    PathPlane,
    Turn,
)
from support.paths_world import STEP, LevelSet, circle_round

R = 4e-3


def rounded_box(half, rounding):
    def distance(p):
        q = [abs(a) - (h - rounding) for a, h in zip(p, half, strict=False)]
        return math.hypot(*[max(a, 0.0) for a in q]) + min(max(q), 0.0) - rounding

    return distance


def sphere(radius):
    return lambda p: math.hypot(*p) - radius


def elliptic_cylinder(a, b):
    """A vertical cylinder on an ellipse: its distance by Newton's iteration."""

    def distance(p):
        x, y = abs(p[0]), abs(p[1])
        t = math.atan2(a * y, b * x)
        for _ in range(30):
            f = (a * a - b * b) * math.cos(t) * math.sin(t) - x * a * math.sin(t) + y * b * math.cos(t)
            d = (a * a - b * b) * math.cos(2 * t) - x * a * math.cos(t) - y * b * math.sin(t)
            t = min(max(t - f / d, 0.0), math.pi / 2)
        return math.copysign(
            math.hypot(x - a * math.cos(t), y - b * math.sin(t)), (x / a) ** 2 + (y / b) ** 2 - 1.0
        )

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
        (elliptic_cylinder(0.02, 0.012), None, None),
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
    ball, flat = LevelSet(sphere(0.02), R), LevelSet(lambda p: p[2], R)
    for at, world, event in (
        ((0.02, 0.0), ball, PathEvent.OPEN),
        ((0.0, 0.0), flat, PathEvent.BLOCKED),
        ((0.05, 0.0), ball, PathEvent.UNREACHABLE),
    ):
        contour = Contour(at, LevelSteering(LEVEL), LEVEL, 0.05)
        circle_round(contour, world)
        assert not contour.closed
        assert [mark.event for mark in contour.marks] == [event]
    assert contour.beginning is None


def test_passing_close_to_the_beginning_is_not_closing():
    # a hairpin: the way back runs 0.8 mm beside the way out, within the tolerance
    contour = Contour((0.0, 0.0), LevelSteering(PathPlane()), PathPlane(), 1.0)
    contour.next(None)
    contour.next(LegResult(LegEnd.REACHED, (0.0, 0.0, 0.0)))
    out = [(x, 0.0, 0.0) for x in np.arange(0.0, 0.03, STEP)]
    back = [(x, 8e-4, 0.0) for x in np.arange(0.03, -0.02, -STEP)]
    assert not any(contour.feel(ContactPeriod(p, p, (0.0, 1.0, 0.0))) for p in out + back)


PROFILES = {
    "step down": (lambda x: np.where(x < 0.0, 0.0, -1.5e-3), [PathEvent.STEP]),
    "step up": (lambda x: np.where(x < 0.0, 0.0, 1.5e-3), [PathEvent.STEP]),
    "slot": (lambda x: np.where(np.abs(x) < 1.5e-3, -5e-3, 0.0), [PathEvent.HOLE]),
    "V groove": (lambda x: 0.5 * np.abs(x), [PathEvent.TIGHT]),
    "roof": (lambda x: -0.5 * np.abs(x), [PathEvent.EDGE]),
    "flat": (lambda x: 0.0 * x, []),
    "slope": (lambda x: 0.7 * x, []),
    "wave wider than the tip": (lambda x: 1e-3 * np.sin(x / 3.5e-3), []),
}


def watched(contacts, limits=None):
    """Marks of the contacts, one after the other."""
    watch = FeatureWatch(limits or FeatureLimits())
    found = [watch.feel(contact) for contact in contacts]
    return [mark for mark in (*found, watch.leave()) if mark]


def marks(profile, noise=0.0, ends=(-0.012, 0.012), step=4e-5):
    """Marks of a round tip that slides along a profile z(x): at the highest position at which it touches."""
    x, contacts, rng = np.arange(ends[0] - 2 * R, ends[1] + 2 * R, 1e-5), [], np.random.default_rng(0)
    z = profile(x)
    for u in np.arange(*ends, step):
        near = np.abs(x - u) <= R
        lift = z[near] + np.sqrt(R * R - (x[near] - u) ** 2)
        k = int(lift.argmax())
        angle = math.atan2(u - x[near][k], lift[k] - z[near][k]) + noise / R * rng.normal()
        normal = (math.sin(angle), 0.0, math.cos(angle))
        point = (u - R * normal[0], 0.0, lift[k] - R * normal[2] + noise * rng.normal())
        contacts.append(ContactPeriod((u, 0.0, lift[k]), point, normal))
    return watched(contacts)


@pytest.mark.parametrize("noise", [0.0, 3e-5])
@pytest.mark.parametrize("name", PROFILES)
def test_each_feature_has_its_name_and_place(name, noise):
    """A step has its height and direction."""
    profile, expected = PROFILES[name]
    found = marks(profile, noise)
    assert [mark.event for mark in found] == expected
    assert all(abs(mark.position[0]) < 0.8 * R and mark.reason for mark in found)
    if name in ("step down", "step up") and not noise:
        assert f"1.50 mm {'higher' if name == 'step up' else 'lower'}" in found[0].reason


def test_the_tighter_concavity_is_distinguished_from_the_one_that_fits():
    """A corner sharper than the tip is no edge; a lift between two places is no jump."""

    def bowl(radius):  # a round groove between shoulders at 45 degrees
        edge = radius * math.sin(math.pi / 4)
        return lambda x: np.where(
            np.abs(x) < edge,
            radius - np.sqrt(np.maximum(radius**2 - x**2, 0.0)),
            radius * (1 - math.cos(math.pi / 4)) + np.abs(x) - edge,
        )

    assert [mark.event for mark in marks(bowl(0.5 * R))] == [PathEvent.TIGHT]
    assert marks(bowl(2.5 * R), ends=(-0.009, 0.009)) == []
    (mark,) = marks(np.abs)
    assert (mark.event, mark.radius) == (PathEvent.TIGHT, pytest.approx(-R, rel=0.02))
    assert "touched at two points: a radius of at most 4.0" in mark.reason
    watch, tip = FeatureWatch(), (0.0, 0.0, R)
    assert watch.feel(ContactPeriod(tip, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))) is watch.leave() is None
    assert watch.feel(ContactPeriod(tip, (-R, 0.0, R), (1.0, 0.0, 0.0))) is watch.leave() is None


def followed(radius, tip, turn):
    """A tip rolls along a line, an arc of a radius (positive: convex) and another line."""
    for s in np.arange(-3e-3, abs(radius) * turn + 3e-3, 2e-5):
        angle = math.copysign(min(max(s / max(abs(radius), 1e-9), 0.0), turn), radius)
        along = min(s, 0.0) + max(s - abs(radius) * turn, 0.0)
        out = np.array([math.sin(angle), 0.0, math.cos(angle)])
        contact = radius * (out - [0.0, 0.0, 1.0]) + along * np.array([out[2], 0.0, -out[0]])
        yield ContactPeriod(tuple(contact + tip * out), tuple(contact), tuple(out))


@given(
    radius=st.one_of(st.floats(2e-4, 0.6), st.floats(-1.6, -1.15)),
    turn=st.floats(0.7, 2.5),
    tip=st.floats(2e-3, 1e-2),
)
def test_a_mark_has_sign_and_radius_of_what_was_passed(radius, turn, tip):
    (mark,) = watched(followed(radius * tip, tip, turn), FeatureLimits(together=0.0))
    assert mark.event is (PathEvent.EDGE if radius > 0.0 else PathEvent.FILLET)
    assert mark.reason.startswith("convex" if radius > 0.0 else "concave")
    assert mark.radius == pytest.approx(radius * tip, rel=0.05, abs=0.1 * tip)
