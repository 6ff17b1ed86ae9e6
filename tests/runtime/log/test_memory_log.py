"""A run in memory: whole if it is short, a share of a long one, evenly, and bounded."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from palpate.runtime.log import Layout, MemoryLog
from palpate.runtime.log.chunk import PERIOD_CHANNEL, PackedRows
from palpate.runtime.log.heading import Heading
from palpate.runtime.log.period_codec import PeriodCodec

HEADING = Heading(Layout(0, None, (1,), 2), 1e-3, 0.0, 0, "")
CODEC = PeriodCodec(HEADING, PERIOD_CHANNEL)
MOST = 64


def rows_of(first, count):
    rows = np.zeros((count, CODEC.width))
    rows[:, 0] = np.arange(first, first + count)
    rows[:, 1:] = rows[:, :1] ** 2 % 3  # small: codes among them have names
    return PackedRows(first, memoryview(rows.tobytes()))


@given(st.lists(st.integers(1, 30), max_size=60), st.lists(st.integers(0, 59), max_size=3))
def test_what_is_kept_is_even_in_time_bounded_and_as_it_came(sizes, looks):
    memory, count = MemoryLog(MOST), 0
    memory.start(HEADING)
    for index, size in enumerate(sizes):
        memory.rows(rows_of(count, size))
        count += size
        if index in looks:
            memory.record()
    time = memory.record().time
    np.testing.assert_array_equal(time, np.arange(0, count, memory.stride))
    assert memory.close().rows_written == count
    assert memory.stride == 1 or count > MOST
    assert len(time) <= 2 * MOST + 30
    assert len(time) >= min(count, MOST // 2)
