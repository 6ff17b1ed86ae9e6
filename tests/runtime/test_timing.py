"""How a run kept time: order statistics that occurred, and words that say so."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.runtime.times import MOST_TIMES, Times
from palpate.runtime.timing import Distribution, RunTiming

times = st.lists(st.floats(0.0, 10.0), min_size=1, max_size=300).map(np.array)


@given(times)
def test_each_figure_is_a_time_that_occurred_and_bounds_its_share(given_times):
    found = Distribution.of(given_times)
    for share, bound in ((0.5, found.p50), (0.99, found.p99), (1.0, found.largest)):
        assert bound in given_times
        assert np.mean(given_times <= bound) >= share - 1e-12
    assert found.p50 <= found.p99 <= found.largest
    assert found.count == len(given_times)


@given(times, st.randoms(use_true_random=False), st.integers(-10, 10))
def test_order_does_not_matter_and_units_scale(given_times, random, exponent):
    factor = 2.0**exponent  # exact
    shuffled = given_times.tolist()
    random.shuffle(shuffled)
    one, other = Distribution.of(given_times), Distribution.of(factor * np.array(shuffled))
    assert (other.p50, other.p99, other.largest) == (factor * one.p50, factor * one.p99, factor * one.largest)


def test_a_percentile_is_not_taken_between_an_ordinary_time_and_a_stall():
    assert Distribution.of(np.array([1e-5] * 50 + [1.0])).p99 == 1.0
    assert Distribution.of(np.array([1e-5] * 150 + [1.0])).p99 == 1e-5


def test_of_nothing_there_is_no_figure():
    found = Distribution.of(np.empty(0))
    assert found.count == 0
    assert all(math.isnan(value) for value in (found.p50, found.p99, found.largest))
    assert str(found) == "none"


def timing(compute, lateness=(), age=(), overruns=0, note=""):
    return RunTiming(
        compute=Times(np.array(compute)),
        period_time=Times(np.full(max(0, len(compute) - 1), 1e-3)),
        lateness=Times(np.array(lateness, dtype=float)),
        age=Times(np.array(age, dtype=float)),
        overruns=overruns,
        note=note,
        period=1e-3,
    )


def test_in_words_with_units():
    assert str(Distribution.of(np.array([3e-5, 4e-5, 2e-3]))) == "median 40 µs, 99 % 2000 µs, max 2000 µs (3)"
    text = str(timing([4e-5, 2e-3], [1e-4, 2e-4], [4e-3], 1, "real-time priority 50 (SCHED_FIFO)"))
    assert text == (
        "period 1 ms; compute median 2000 µs, 99 % 2000 µs, max 2000 µs (2); "
        "start to start median 1000 µs, 99 % 1000 µs, max 1000 µs (1); "
        "lateness median 200 µs, 99 % 200 µs, max 200 µs (2); overruns 1; "
        "age of samples median 4000 µs, 99 % 4000 µs, max 4000 µs (1); real-time priority 50 (SCHED_FIFO)"
    )


@pytest.mark.parametrize(("compute", "slow"), [([], 0), ([1e-3], 0), ([1.001e-3, 1e-4, 2e-3], 2)])
def test_simulated_time_has_slow_periods_but_no_deadlines(compute, slow):
    found = timing(compute)
    assert found.slow_periods == slow
    assert "lateness" not in str(found)
    assert "overruns" not in str(found)
    assert (f"slower than real time {slow}" in str(found)) == bool(slow)


@given(st.integers(0, 2**32 - 1), st.integers(1, 5))
@settings(max_examples=10, deadline=None)
def test_of_more_times_than_are_kept_all_is_known_to_a_part_in_8192(seed, stalls):
    rng = np.random.default_rng(seed)
    given_times = np.concatenate([np.exp(rng.normal(-10.0, 1.0, MOST_TIMES + 5000)), np.zeros(7)])
    given_times[rng.integers(0, MOST_TIMES, stalls)] = rng.uniform(0.5, 2.0, stalls)
    bounded = Times()
    for some in np.array_split(given_times, 1000):
        bounded.extend(some)
    exact, found = Distribution.of(given_times), Distribution.of(bounded)
    assert (found.count, found.largest) == (exact.count, exact.largest)
    np.testing.assert_allclose([found.p50, found.p99], [exact.p50, exact.p99], rtol=2.0**-13)
    assert bounded.counts[0] == 7
    assert len(bounded.values) < len(given_times)
    assert bounded.counts.sum() == len(bounded) == len(given_times)
