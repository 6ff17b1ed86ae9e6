"""Time stamps from round trips, on clocks that are handed in: never younger than true, and hardly older."""

from collections import deque
from collections.abc import Callable, Iterator
from random import Random
from typing import NamedTuple

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.hw.round_trip_clock import HOLDS, RoundTrip, RoundTripClock

CYCLE = 2e-3
SEND = 7.3e-3
LIMIT = 0.02

Delay = Callable[[float], float]


class Arrived(NamedTuple):
    """A sample here: when it was taken, when it arrived, what the clock made of it."""

    true: float
    seen: float
    stamp: float


def wire(
    duration: float,
    there: Delay,
    back: Delay,
    *,
    drift: float = 0.0,
    echoes_until: float = 1e9,
) -> Iterator[Arrived]:
    """Yield the samples of a device on a line that keeps their order.

    Args:
        duration: Of the device's operation [s].
        there: Delay of what is sent at a time [s].
        back: Delay of what a sample taken at a time carries [s].
        drift: Of the device's clock against true time.
        echoes_until: When the device ceases to send anything back [s].
    """
    clock, on_the_way, heard = RoundTripClock(), deque[tuple[float, float]](), -1.0
    arrived = reached = sent = 0.0
    proven = -1.0
    for i in range(int(duration / CYCLE)):
        true = 1000.0 + CYCLE * i
        while sent <= true:
            reached = max(reached, sent + there(sent - 1000.0)) if sent else 0.0
            if sent and sent < 1000.0 + echoes_until:
                on_the_way.append((reached, sent))
            sent = sent + SEND if sent else 1000.0
        while on_the_way and on_the_way[0][0] <= true:
            heard = on_the_way.popleft()[1]
        arrived = max(arrived, true + back(true - 1000.0))
        count = 5.0 + 7.0 * (true - 1000.0) * (1.0 + drift)
        if heard > proven:
            proven = heard
            clock.prove([RoundTrip(count, heard, arrived)])
        if clock.proven:
            yield Arrived(true, arrived, clock.stamp(count, arrived))


def jitter(most: float, seed: int) -> Delay:
    draw = Random(seed)
    return lambda _: 2e-4 + most * draw.random()


def still(_: float) -> float:
    return 2e-4


@given(st.floats(0.0, 0.05), st.floats(0.0, 0.05), st.floats(-1e-3, 1e-3), st.integers(0, 99))
def test_whatever_the_delays_a_stamp_is_not_younger_than_the_sample(there, back, drift, seed):
    last = -1.0
    for it in wire(1.5, jitter(there, seed), jitter(back, seed + 1), drift=drift):
        assert it.stamp <= it.true + 1e-9
        assert last < it.stamp <= it.seen
        last = it.stamp


@pytest.mark.parametrize("drift", [-1e-4, 0.0, 1e-4])
def test_on_a_quick_line_a_stamp_is_hardly_older_than_the_sample(drift):
    found = [it.true - it.stamp for it in wire(20.0, still, still, drift=drift)][500:]
    assert min(found) >= 0.0
    assert max(found) < 1e-3


@pytest.mark.parametrize("rate", [0.005, 0.02, 0.08, 0.2, 0.5])
@pytest.mark.parametrize("begins", [0.0, 5.0], ids=["from the start", "later"])
@pytest.mark.parametrize("direction", ["back", "there", "both"])
def test_a_creeping_delay_is_never_noticed_late(rate, begins, direction):
    """As soon as the true age passes its limit, the age by the stamp has: whichever direction the delay is in."""

    def creeping(t: float) -> float:
        return 2e-4 + rate * max(0.0, t - begins)

    there, back = (still if direction == other else creeping for other in ("back", "there"))
    noticed = False
    for it in wire(begins + 0.05 / rate, there, back):
        if it.seen - it.true > LIMIT:
            assert it.seen - it.stamp > LIMIT
            noticed = True
    assert noticed is (direction != "there")


@pytest.mark.slow
def test_thirty_minutes_of_jitter_raise_no_alarm():
    """Delays from 0 to 20 ms in both directions: true ages of up to 20 ms, at a limit of 35 ms."""
    samples = wire(1800.0, jitter(0.02, 1), jitter(0.02, 2))
    begun = next(samples).true
    assert max(it.seen - it.stamp for it in samples if it.true > begun + 1.0) < 0.035


def test_without_echoes_nothing_stays_young():
    ages = [it.seen - it.stamp for it in wire(3.0, still, still, echoes_until=1.0)]
    assert max(ages[: int(1.0 / CYCLE)]) < 0.012
    assert ages[-1] == pytest.approx(2.0 - HOLDS, abs=0.02)


def test_a_device_that_counts_anew_is_proven_anew_and_its_stamps_go_on():
    clock = RoundTripClock()
    clock.prove([RoundTrip(100.0, 50.0, 50.001), RoundTrip(101.0, 51.0, 51.001)])
    last = clock.stamp(102.0, 52.001)
    clock.restart()
    assert not clock.proven
    clock.prove([RoundTrip(0.0, 60.0, 60.001)])
    assert last < clock.stamp(0.0, 60.001) == 60.0


def test_a_state_older_than_the_newest_echo_is_stamped_so():
    """States may come by another connection than echoes, and later: each has its own age."""
    clock = RoundTripClock()
    clock.prove(RoundTrip(0.1 * i, 7.0 + 0.1 * i, 7.0 + 0.1 * i + 1e-3) for i in range(50))
    late = clock.stamp(4.7, 12.0)
    assert 11.69 < late <= 11.7
