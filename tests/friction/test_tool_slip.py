"""A place that has moved is told soon, and one that stands still seldom: as seldom as is said."""

import math

import numpy as np
import pytest
from grip.held_pin import END, IN_HAND, NOISE, SIDE, ZERO, touching
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation

from palpate.friction.slip.place_watch import PlaceWatch, StandingPlace
from palpate.friction.slip.tool_slip import BorneLoad, SlipSign, ToolSlip
from palpate.sensing.held import FeltPlace, PlaceFelt

RATE = 500.0
SPREAD = np.diag([2.5e-4, 5e-5, 0.0])
"""As of a place on a pin: along it, around it, and along its normal."""


def rows(matrix):
    return tuple(map(tuple, matrix.tolist()))


def alarms(standing, places):
    """Number of alarms of a watch that is started anew after each."""
    watch, covariance, count = PlaceWatch(1.0 / RATE, standing), rows(SPREAD**2), 0
    for place in places.tolist():
        if watch.step(tuple(place), covariance):
            count += 1
            watch.start()
    return count


def test_false_alarms_are_as_seldom_as_stated():
    standing, rng = StandingPlace(false_alarm_time=2.0, jitter=2e-5), np.random.default_rng(0)
    places = rng.normal(size=(int(60 * RATE), 3)) @ np.sqrt(SPREAD**2 + 4e-10 * np.eye(3))
    places += np.cumsum(standing.wander / math.sqrt(RATE) * rng.normal(size=places.shape), axis=0)
    assert (
        3 <= alarms(standing, places) <= 30
    )  # at most one in 2 s; the bound over windows is within a factor of ten


@pytest.mark.slow
def test_correlated_noise_raises_no_more_alarms():
    """Behind a filter of 5 ms, if its correlation time is stated."""
    alike, keep = 0.005, math.exp(-1.0 / (0.005 * RATE))
    noise = math.sqrt(1 - keep**2) * np.random.default_rng(1).normal(size=(int(40 * RATE), 3))
    places = lfilter([1.0], [1.0, -keep], noise, axis=0) @ SPREAD
    often, stated = (
        alarms(StandingPlace(false_alarm_time=4.0, **more), places) for more in ({}, {"alike": alike})
    )
    assert stated <= 40 / 4.0 < often


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
@pytest.mark.parametrize("seed", range(4))
def test_a_slip_of_a_millimetre_is_noticed_within_a_fifth_of_a_second(touched, by, seed):
    began, felt, slip = 1.5, PlaceFelt(IN_HAND, NOISE, ZERO / 60.0), ToolSlip(1.0 / RATE, fingers=2)
    ramp = np.clip((np.arange(int(2.0 * RATE)) / RATE - began) / 0.2, 0.0, 1.0)  # it takes that time, too
    samples = touching(np.random.default_rng(seed), np.outer(ramp, by), *touched, RATE)
    signs = [slip.step(felt.step(wrench, pose)) for wrench, pose in samples]
    assert 0.0 < signs.index(SlipSign.PLACE) / RATE - began < 0.2


def test_other_signs():
    """The fingers touch it elsewhere; the load that they carry falls, unless the hand lets off."""
    exact = rows(1e-10 * np.eye(3))
    place, still = FeltPlace((0.0, 0.0, 0.01), exact), FeltPlace((0.0, 0.0, 0.0), exact)
    rolls, falls, eases = (ToolSlip(1e-3, fingers=2, every=1) for _ in range(3))
    signs = []
    for i in range(600):
        rolled = FeltPlace((0.0, 1e-5 * max(i - 500, 0), 0.0), exact)
        fell, let_off = (BorneLoad(2.0 if i < 500 else 1.5, 0.01, steady=steady) for steady in (True, i < 490))
        found = rolls.step(place, [still, rolled]), falls.step(place, (), fell), eases.step(place, (), let_off)
        signs.append(found)
    rolling, falling, easing = zip(*signs, strict=True)
    assert signs[499] == (None, None, None)
    assert rolling[-1] is SlipSign.GRIP
    assert SlipSign.LOAD in falling[500:]
    assert set(easing) == {None}
