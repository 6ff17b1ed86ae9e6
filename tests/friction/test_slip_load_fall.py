"""A load that hangs on friction falls where it slips: what is heard of it, and what is not."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.friction.slip.load_fall import FALL, SLIGHT_FALL, LoadFall

PERIOD = 1e-3
NOISE = 0.014
"""[N] Of the net force of two fingers of 10 mN each."""


def heard(loads, deviation, parameters=FALL):
    """Index at which the fall is heard; None: never."""
    fall = LoadFall(PERIOD, parameters)
    return next((k for k, load in enumerate(loads) if fall.step(load, deviation)), None)


def felt(loads, seed, scale=1.0):
    return np.asarray(loads) + scale * NOISE * np.random.default_rng(seed).standard_normal(len(loads))


@given(st.integers(0, 10**6), st.floats(0.7, 5.0), st.floats(0.08, 0.5))
@settings(max_examples=30, deadline=None)
def test_a_fall_is_heard_within_ten_milliseconds_whatever_hangs(seed, load, share):
    k = heard(felt([load] * 500 + [(1.0 - share) * load] * 50, seed), NOISE)
    assert k is not None
    assert 500 <= k <= 510


@given(st.integers(0, 10**6), st.floats(0.5, 5.0), st.floats(1.0, 3.0))
@settings(max_examples=20, deadline=None)
def test_what_hangs_still_or_grows_does_not_fall_at_any_noise(seed, load, scale):
    grows = np.concatenate([np.full(1000, load), np.linspace(load, 2.0 * load, 500), np.full(1500, 2.0 * load)])
    assert heard(felt(grows, seed, scale), scale * NOISE) is None


@pytest.mark.parametrize("frequency", [2.0, 5.0, 10.0])
def test_a_load_that_swings_evenly_does_not_fall_again_and_again(frequency):
    """Its first swings pass for a fall; once these are refuted and the swing is known, the others do not."""
    loads = felt(2.0 + 0.6 * np.sin(2.0 * np.pi * frequency * PERIOD * np.arange(10_000)), 3)
    fall, alarms = LoadFall(PERIOD), []
    for k, load in enumerate(loads):
        if fall.step(load, NOISE):
            alarms.append(k)
            fall.refuted()
    assert len(alarms) <= 6
    assert max(alarms, default=0) < 5000


def test_a_refuted_fall_takes_a_deeper_one_and_only_for_a_while():
    fall, loads = LoadFall(PERIOD), [2.0] * 200 + [1.97] * 40

    def alarms(loads):
        return sum(fall.step(load, NOISE) for load in loads)

    assert alarms(loads)
    fall.refuted()
    assert not alarms(loads)
    alarms([2.0] * 5000)
    assert alarms(loads)


def test_less_is_enough_to_look_into_it():
    loads = [2.0] * 500 + [1.94] * 2 + [2.0] * 100
    assert heard(loads, 1e-3) is None
    assert heard(loads, 1e-3, SLIGHT_FALL) == 501


@given(st.floats(0.02, 0.3), st.floats(1.0, 5.0))
def test_what_slides_is_heard_by_the_speed_that_it_gains(share, load):
    """Where noise is no matter: 0.5 mm/s, of what is missing beyond the least that is a fall."""
    k = heard([load] * 500 + [(1.0 - share) * load] * 200, 1e-3)
    counted = 9.81 * (share - 0.6 * FALL.share) * PERIOD
    assert 500 + 5e-4 / counted - 2.0 <= k <= 500 + 1.1 * 5e-4 / counted + 4.0
