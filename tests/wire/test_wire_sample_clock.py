"""Time stamps from a device's own counter: no drift, hardly any jitter, whatever the transport delays."""

import itertools

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.hw.ft_stream.sample_clock import LEARNING, StreamClock, line_below

LEAST_DELAY = 1e-4


def arrivals(
    rate: float, skew: float, duration: float, seed: int, *, per_count: int = 1, first: int = 0
) -> tuple[npt.NDArray[np.float64], list[int], npt.NDArray[np.float64]]:
    """Return true times of sampling, counters and arrivals: least delay, an exponential one, stalls of 20 ms."""
    g = np.random.default_rng(seed)
    k = np.arange(int(duration * rate / per_count))
    true = 1000.0 + k * per_count / (rate * (1.0 + skew))
    delay = LEAST_DELAY + g.exponential(1e-4, len(k))
    delay += np.where(g.random(len(k)) < 1.0 / (rate / per_count), g.exponential(0.02, len(k)), 0.0)
    # nothing overtakes: what waits behind a stall is read 10 us after the other
    arrived = true + delay
    for i in range(1, len(arrived)):
        arrived[i] = max(arrived[i], arrived[i - 1] + 1e-5)
    return true, [int(c) for c in (first + k * per_count) % 2**32], arrived


def stamps(counters: list[int], arrived: npt.NDArray[np.float64]) -> tuple[npt.NDArray[np.float64], StreamClock]:
    clock = StreamClock()
    return stamps_of(clock, counters, arrived), clock


def stamps_of(
    clock: StreamClock, counters: list[int], arrived: npt.NDArray[np.float64]
) -> npt.NDArray[np.float64]:
    return np.array([clock.stamp(c, a) for c, a in zip(counters, arrived.tolist(), strict=True)])


@pytest.mark.parametrize(
    ("rate", "per_count", "skew", "duration"),
    [(7000.0, 1, 4e-5, 8.0), (7000.0, 7, -1e-4, 20.0), (7000.0, 70, 1e-4, 900.0), (1e6, 9961, 5e-5, 100.0)],
)
def test_stamps_neither_drift_nor_jitter(rate: float, per_count: int, skew: float, duration: float) -> None:
    true, counters, arrived = arrivals(rate, skew, duration, 1, per_count=per_count, first=2**32 - 5000)
    stamped, _ = stamps(counters, arrived)
    error = stamped - true - LEAST_DELAY
    settled = true > true[0] + 2.0
    assert error[settled].std() < 2e-6 < 1e-4 < (arrived - true)[settled].std()
    assert np.abs(error[settled]).max() < 5e-5
    tenth = len(error) // 10
    assert abs(np.median(error[-tenth:]) - np.median(error[2 * tenth : 3 * tenth])) < 2e-6


def test_stamps_are_good_as_soon_as_the_clock_is_learned() -> None:
    for seed in range(10):
        true, counters, arrived = arrivals(7000.0, 1e-4, 2.0, seed, per_count=7)
        stamped, _ = stamps(counters, arrived)
        learned = arrived > arrived[0] + LEARNING
        assert np.abs(stamped - true - LEAST_DELAY)[learned].max() < 2e-4


@settings(max_examples=60, deadline=None)
@given(
    st.integers(1, 2**31),
    st.lists(st.tuples(st.integers(1, 500), st.floats(1e-5, 0.5)), min_size=2, max_size=300),
    st.integers(0, 2**32 - 1),
)
def test_whatever_arrives_stamps_advance_and_are_not_ahead(
    first: int, steps: list[tuple[int, float]], other: int
) -> None:
    clock, arrival, counter, last = StreamClock(), 50.0, first, -np.inf
    for advance, elapsed in steps:
        counter, arrival = (counter + advance) % 2**32, arrival + elapsed
        stamp = clock.stamp(counter, arrival)
        assert last < stamp <= arrival or not clock.learned
        last = stamp
    clock.restart()
    assert clock.stamp(other, arrival + 1.0) <= arrival + 1.0


@pytest.mark.parametrize("seed", [0, 3])
def test_a_device_that_begins_anew_keeps_its_rate_and_loses_no_time(seed: int) -> None:
    _, counters, arrived = arrivals(7000.0, 3e-5, 4.0, seed, per_count=7)
    _, clock = stamps(counters, arrived)
    clock.restart()
    assert clock.learned
    true, counters, arrived = arrivals(7000.0, 3e-5, 4.0, seed + 10, per_count=7)
    error = stamps_of(clock, counters, arrived + 10.0) - 10.0 - true - LEAST_DELAY
    assert np.abs(error[true > true[0] + 0.1]).max() < 5e-5


def test_a_counter_that_jumps_ahead_is_followed() -> None:
    true, counters, arrived = arrivals(7000.0, -5e-5, 6.0, 5, per_count=7)
    half = len(true) // 2
    clock = StreamClock()
    stamps_of(clock, counters[:half], arrived[:half])
    stamped = stamps_of(clock, [c + 700 for c in counters[half:]], arrived[half:])
    error = stamped - true[half:] - LEAST_DELAY
    assert np.abs(error[200:]).max() < 5e-5
    assert np.diff(stamped).min() > 0.0


@pytest.mark.parametrize("rate", [0.005, 0.02, 0.08, 0.2, 0.5])
@pytest.mark.parametrize("per_count", [1, 1000], ids=["frames", "microseconds"])
def test_a_creeping_delay_is_noticed_50_ms_late_at_most(rate: float, per_count: int) -> None:
    """Once the clock is known, on a wire that proves nothing but that its device keeps its rate."""
    true, counters, arrived = arrivals(1000.0 * per_count, 3e-5, 20.0 + 0.06 / rate, 7, per_count=per_count)
    arrived = arrived + rate * np.maximum(true - true[0] - 20.0, 0.0)
    stamped, _ = stamps(counters, arrived)
    limit = 0.025
    crept = LEAST_DELAY + rate * np.maximum(true - true[0] - 20.0, 0.0)
    noticed = true[np.argmax((arrived - stamped > limit) & (crept > 0.001))]
    passed = true[np.argmax(crept > limit)]
    assert noticed < passed + 0.05


@pytest.mark.slow
def test_thirty_minutes_of_jitter_raise_no_alarm() -> None:
    """Delays from 0 to 20 ms, at a limit of 30 ms."""
    true, counters, arrived = arrivals(500.0, 3e-5, 1800.0, 3)
    arrived = np.maximum.accumulate(true + np.random.default_rng(4).uniform(0.0, 0.02, len(true)))
    stamped, _ = stamps(counters, arrived)
    assert (arrived - stamped)[np.isfinite(stamped)].max() < 0.03


@given(
    st.lists(st.tuples(st.floats(0.01, 1.0), st.floats(0.0, 1.0)), min_size=2, max_size=12), st.floats(-2.0, 2.0)
)
def test_no_line_below_the_points_is_nearer(steps: list[tuple[float, float]], tilt: float) -> None:
    x = np.cumsum([dx for dx, _ in steps])
    y = np.array([dy for _, dy in steps]) + tilt * x
    at, line_at, slope = line_below(list(zip(x.tolist(), y.tolist(), strict=True)))
    gaps = y - line_at - slope * (x - at)
    assert gaps.min() > -1e-9
    for i, j in itertools.combinations(range(len(x)), 2):  # the best line passes through two of the points
        other = (y[j] - y[i]) / (x[j] - x[i])
        theirs = y - y[i] - other * (x - x[i])
        if theirs.min() > -1e-12:
            assert gaps.sum() <= theirs.sum() + 1e-9
