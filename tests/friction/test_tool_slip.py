"""A place that has moved is told soon, and one that stands still seldom: as seldom as is said."""

import math

import numpy as np
import pytest
from grip.held_pin import END, IN_HAND, NOISE, SIDE, ZERO, touching
from scipy.spatial.transform import Rotation

from palpate.friction.slip.place_watch import PlaceWatch, StandingPlace
from palpate.friction.slip.tool_slip import BorneLoad, SlipSign, ToolSlip
from palpate.sensing.held import FeltPlace, PlaceFelt

RATE = 500.0
SPREAD = np.diag([2.5e-4, 5e-5, 0.0])
"""As of a place on a pin: along it, around it, and along its normal."""


def rows(matrix):
    return tuple(map(tuple, matrix.tolist()))


def steps(watch, places, covariance):
    """Periods after which the watch raises its alarm, begun anew each time."""
    alarms = []
    for i, place in enumerate(places.tolist()):
        if watch.step(tuple(place), covariance):
            alarms.append(i)
            watch.start()
    return alarms


def test_false_alarms_are_as_seldom_as_is_said():
    standing = StandingPlace(false_alarm_time=2.0, jitter=2e-5)
    rng, seconds = np.random.default_rng(0), 60
    places = rng.normal(size=(int(seconds * RATE), 3)) @ np.sqrt(SPREAD**2 + 4e-10 * np.eye(3))
    places += np.cumsum(standing.wander / math.sqrt(RATE) * rng.normal(size=places.shape), axis=0)
    alarms = steps(PlaceWatch(1.0 / RATE, standing), places, rows(SPREAD**2))
    assert 3 <= len(alarms) <= 30  # at most one in 2 s; the bound over windows is within a factor of ten


@pytest.mark.slow
def test_noise_that_is_alike_raises_no_more():
    """Behind a filter of 5 ms, as long as it is said."""
    rng, seconds, alike = np.random.default_rng(1), 40, 0.005
    keep = math.exp(-1.0 / (alike * RATE))
    places = np.empty((int(seconds * RATE), 3))
    now = np.zeros(3)
    for i in range(len(places)):
        now = keep * now + math.sqrt(1 - keep**2) * rng.normal(size=3)
        places[i] = now
    places = places @ SPREAD
    often = steps(PlaceWatch(1.0 / RATE, StandingPlace(false_alarm_time=4.0)), places, rows(SPREAD**2))
    told = steps(PlaceWatch(1.0 / RATE, StandingPlace(false_alarm_time=4.0, alike=alike)), places, rows(SPREAD**2))
    assert len(told) <= seconds / 4.0 < len(often)


def test_the_base_frame_does_not_matter():
    rng = np.random.default_rng(2)
    places = rng.normal(size=(600, 3)) @ SPREAD
    places[300:] += [3e-4, 0.0, 5e-5]
    R, p = Rotation.random(rng=rng).as_matrix(), rng.normal(size=3)
    here, there = PlaceWatch(1.0 / RATE), PlaceWatch(1.0 / RATE)
    for one, other in zip(places, places @ R.T + p, strict=True):
        here.step(tuple(one), rows(SPREAD**2))
        there.step(tuple(other), rows(R @ SPREAD**2 @ R.T))
    assert here.alarm
    np.testing.assert_allclose(R @ here.moved, there.moved, atol=1e-9)


def test_only_where_the_thing_holds_it():
    watch, along = PlaceWatch(1.0 / RATE), PlaceWatch(1.0 / RATE)
    along.start([(0.0, 0.0, 1.0)])  # a plate
    for i in range(400):
        place = (0.0 if i < 200 else 2e-3, 0.0, 0.0)
        watch.step(place, rows(SPREAD**2))
        along.step(place, rows(SPREAD**2))
    assert watch.alarm
    assert not along.alarm
    assert math.dist(watch.moved, (2e-3, 0, 0)) < 2e-4
    along.step((math.nan, 0.0, 0.0), rows(SPREAD**2))
    assert not along.alarm


@pytest.mark.parametrize(("touched", "by"), [(SIDE, [-1e-3, 0, 0, 0, 0, 0]), (END, [0, 0, -1e-3, 0, 0, 0])])
def test_a_slip_of_a_millimetre_is_noticed_within_a_fifth_of_a_second(touched, by):
    n, began = int(2.0 * RATE), 1.5
    ramp = np.clip((np.arange(n) / RATE - began) / 0.2, 0.0, 1.0)  # it takes that time, too
    for seed in range(4):
        felt, slip = PlaceFelt(IN_HAND, NOISE, ZERO / 60.0), ToolSlip(1.0 / RATE, fingers=2)
        told = None
        for i, (wrench, pose) in enumerate(
            touching(np.random.default_rng(seed), np.outer(ramp, by), *touched, RATE)
        ):
            if slip.step(felt.step(wrench, pose)) is SlipSign.PLACE:
                told = i / RATE - began
                break
        assert told is not None
        assert 0.0 < told < 0.2


def test_other_signs():
    """The fingers touch it elsewhere; what they bear falls, unless the hand lets off."""
    place, still = (
        FeltPlace((0.0, 0.0, 0.01), rows(1e-10 * np.eye(3))),
        FeltPlace((0.0, 0.0, 0.0), rows(1e-10 * np.eye(3))),
    )
    rolls, falls, eases = (ToolSlip(1e-3, fingers=2, every=1) for _ in range(3))
    signs = []
    for i in range(600):
        fell = BorneLoad(2.0 if i < 500 else 1.5, 0.01)
        signs.append(
            (
                rolls.step(place, [still, FeltPlace((0.0, 1e-6 * max(i - 500, 0) * 10, 0.0), still.covariance)]),
                falls.step(place, (), fell),
                eases.step(place, (), BorneLoad(fell.size, fell.deviation, steady=i < 490)),
            )
        )
    assert signs[499] == (None, None, None)
    assert signs[-1][0] is SlipSign.GRIP
    assert SlipSign.LOAD in [each[1] for each in signs[500:]]
    assert all(each[2] is None for each in signs)
