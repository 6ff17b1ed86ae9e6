"""Which records belong to a stream: gaps, repeats, swaps, restarts, rubbish."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.hw.ft_stream.link import StreamCounts
from palpate.hw.ft_stream.succession import ALIKE, UNDISTURBED, Step, Succession

MODULUS = 2**32
PERIOD = 1e-3


class Stream:
    """A box of 1000 records a second that counts 7 samples to each, and what is made of its records."""

    def __init__(self, sequence: int = 1, sample: int = 0) -> None:
        self.counts = StreamCounts()
        self.judge = Succession((20_000.0, 20_000.0), self.counts)
        self.first = (sequence, sample)
        self.now = 100.0

    def record(self, k: int) -> tuple[int, int]:
        return (self.first[0] + k) % MODULUS, (self.first[1] + 7 * k) % MODULUS

    def hear(self, *records: tuple[int, int]) -> list[Step]:
        steps = []
        for record in records:
            self.now += PERIOD
            steps.append(self.judge.judge(record, self.now)[0])
        return steps

    def begin(self) -> None:
        assert self.hear(*map(self.record, range(ALIKE))) == [Step.UNPROVEN] * (ALIKE - 1) + [Step.ANEW]


@given(st.integers(0, MODULUS - 1), st.integers(0, MODULUS - 1), st.lists(st.integers(1, 50), max_size=40))
def test_gaps_are_counted_across_the_end_of_the_counters(sequence: int, sample: int, gaps: list[int]) -> None:
    stream = Stream(sequence, sample)
    stream.begin()
    k = ALIKE - 1
    for gap in gaps:
        k += gap
        stream.now += gap * PERIOD
        assert stream.judge.judge(stream.record(k), stream.now) == (Step.NEXT, gap)


@settings(deadline=None)
@given(st.permutations(range(ALIKE, ALIKE + 12)))
def test_of_swapped_records_only_newer_ones_count(order: list[int]) -> None:
    stream = Stream()
    stream.begin()
    newest = ALIKE - 1
    for k in order:
        stream.now += 1e-5
        step, _ = stream.judge.judge(stream.record(k), stream.now)
        assert step is (Step.NEXT if k > newest else Step.OLDER)
        newest = max(newest, k)
        stream.now += 1e-5
        assert stream.judge.judge(stream.record(k), stream.now)[0] is Step.OLDER


def test_a_burst_of_late_records_is_not_a_restart() -> None:
    stream = Stream()
    stream.begin()
    stream.hear(stream.record(20))
    assert set(stream.hear(*map(stream.record, range(5, 15)))) == {Step.OLDER}
    assert stream.hear(stream.record(21)) == [Step.NEXT]
    assert stream.counts.restarts == 0


def test_a_restart_is_believed_within_the_time_that_it_is_noticed_in() -> None:
    stream = Stream(sequence=5000, sample=10**6)
    stream.begin()
    stream.first = (1, 0)
    begin = stream.now
    k = 0
    while stream.hear(stream.record(k)) != [Step.ANEW]:
        k += 1
    assert UNDISTURBED <= stream.now - begin <= UNDISTURBED + 2 * PERIOD
    assert stream.hear(stream.record(k + 1)) == [Step.NEXT]
    assert (stream.counts.restarts, stream.counts.refused) == (1, 0)


def test_rubbish_is_never_the_next_and_does_not_disturb() -> None:
    g = np.random.default_rng(0)
    stream = Stream(sequence=77, sample=12345)
    stream.begin()
    for k in range(ALIKE, 20_000):
        rubbish = tuple(int(v) for v in g.integers(0, MODULUS, 2))
        assert stream.hear(rubbish) == [Step.UNPROVEN]
        assert stream.hear(stream.record(k)) == [Step.NEXT]
    assert stream.counts.refused == 20_000 - ALIKE


@given(st.integers(1, 100), st.integers(0, 10_000))
def test_counters_that_part_do_not_follow(records: int, samples: int) -> None:
    stream = Stream()
    stream.begin()
    stream.now += 0.1
    sequence, sample = stream.record(ALIKE - 1 + records)
    expected = 7 * records
    step, _ = stream.judge.judge((sequence, sample - expected + samples), stream.now)
    if samples > 2 * expected + 1 or samples < expected / 2 - 1:
        assert step in (Step.UNPROVEN, Step.OLDER)
    elif samples == expected:
        assert step is Step.NEXT


def test_rubbish_alone_never_becomes_a_stream() -> None:
    g = np.random.default_rng(1)
    stream = Stream()
    for _ in range(20_000):
        assert stream.hear(tuple(int(v) for v in g.integers(0, MODULUS, 2))) == [Step.UNPROVEN]
