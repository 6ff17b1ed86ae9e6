"""Edges, steps, holes and grooves under a round tip, seen only through where tip and contact are."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.controllers.paths import ContactPeriod, FeatureLimits, FeatureWatch, PathEvent

R = 4e-3


def trace(profile, noise=0.0, seed=0, ends=(-0.012, 0.012), step=4e-5):
    """A round tip slides along a profile z(x): the highest position at which it touches, contact and normal."""
    x = np.arange(ends[0] - 2 * R, ends[1] + 2 * R, 1e-5)
    z = profile(x)
    rng = np.random.default_rng(seed)
    for u in np.arange(*ends, step):
        near = np.abs(x - u) <= R
        lift = z[near] + np.sqrt(R * R - (x[near] - u) ** 2)
        k = int(lift.argmax())
        cx, cz, h = x[near][k], z[near][k], lift[k]
        angle = math.atan2(u - cx, h - cz) + noise / R * rng.normal()
        normal = (math.sin(angle), 0.0, math.cos(angle))
        yield ContactPeriod(
            (u, 0.0, h), (u - R * normal[0], 0.0, h - R * normal[2] + noise * rng.normal()), normal
        )


def marks(profile, noise=0.0, **rest):
    watch, found = FeatureWatch(), []
    for felt in trace(profile, noise, **rest):
        mark = watch.feel(felt)
        found += [mark] if mark else []
    last = watch.leave()
    return found + ([last] if last else [])


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


@pytest.mark.parametrize("noise", [0.0, 3e-5])
@pytest.mark.parametrize("name", PROFILES)
def test_each_feature_has_its_name_and_place(name, noise):
    profile, expected = PROFILES[name]
    found = marks(profile, noise)
    assert [mark.event for mark in found] == expected
    for mark in found:
        assert abs(mark.position[0]) < 0.8 * R
        assert mark.reason


@pytest.mark.parametrize(("height", "word"), [(1.5e-3, "higher"), (-1.5e-3, "lower")])
def test_a_step_says_how_much_and_in_which_direction(height, word):
    (mark,) = marks(lambda x: np.where(x < 0.0, 0.0, height))
    assert "1.50 mm " + word in mark.reason


def test_the_tighter_concavity_is_distinguished_from_the_one_that_fits():
    def bowl(radius):  # a round groove between shoulders at 45 degrees
        edge = radius * math.sin(math.pi / 4)
        return lambda x: np.where(
            np.abs(x) < edge,
            radius - np.sqrt(np.maximum(radius**2 - x**2, 0.0)),
            radius * (1 - math.cos(math.pi / 4)) + np.abs(x) - edge,
        )

    assert [mark.event for mark in marks(bowl(0.5 * R))] == [PathEvent.TIGHT]
    assert marks(bowl(2.5 * R), ends=(-0.009, 0.009)) == []


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
    watch, found = FeatureWatch(FeatureLimits(together=0.0)), []
    for felt in followed(radius * tip, tip, turn):
        mark = watch.feel(felt)
        found += [mark] if mark else []
    last = watch.leave()
    (mark,) = found + ([last] if last else [])
    assert mark.event is (PathEvent.EDGE if radius > 0.0 else PathEvent.FILLET)
    assert mark.reason.startswith("convex" if radius > 0.0 else "concave")
    assert mark.radius == pytest.approx(radius * tip, rel=0.05, abs=0.1 * tip)


def test_a_corner_sharper_than_the_tip_is_no_edge_and_says_so():
    (mark,) = marks(lambda x: np.abs(x))
    assert (mark.event, mark.radius) == (PathEvent.TIGHT, pytest.approx(-R, rel=0.02))
    assert "touched at two points: a radius of at most 4.0" in mark.reason


def test_a_lift_between_two_places_is_no_jump():
    watch = FeatureWatch()
    n = (0.0, 0.0, 1.0)
    watch.feel(ContactPeriod((0.0, 0.0, R), (0.0, 0.0, 0.0), n))
    assert watch.leave() is None
    side = (1.0, 0.0, 0.0)
    assert watch.feel(ContactPeriod((0.0, 0.0, R), (-R, 0.0, R), side)) is None
    assert watch.leave() is None
