"""The ring between loop and view: what comes out is what went in, whole, in order; what is lost is counted."""

import multiprocessing

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.errors import InvalidValueError
from palpate.viewing.row_ring import RingReader, RingWriter, RowRing

CONTEXT = multiprocessing.get_context("spawn")
PLAIN = 28


@given(st.integers(3, 80), st.integers(2, 40), st.lists(st.integers(0, 60), max_size=8))
def test_rows_come_out_whole_and_in_order_and_the_rest_is_counted(width, capacity, bursts):
    ring = RowRing(CONTEXT, width, capacity)
    writer, reader = RingWriter(ring), RingReader(ring)
    written, read = 0, []
    for burst in bursts:
        for _ in range(burst):
            writer.write([written + 0.5] * (width - 2))
            written += 1
        rows = reader.read()
        # a full ring's oldest row may be the next one that is written over
        assert len(rows) >= min(burst, capacity - 1)
        read += rows.tolist()
    numbers = [row[0] for row in read]
    assert numbers == sorted(set(numbers))
    assert all(row[-1] == row[0] and set(row[1:-1]) == {row[0] + 0.5} for row in read)
    assert reader.lost == written - len(read)


def write_many(ring, count):
    writer, width = RingWriter(ring), ring.width
    for i in range(count):
        writer.write([float(i)] * (width - 2))


@pytest.mark.slow
def test_rows_are_never_torn_between_processes():
    """A ring so small that the writer laps the reader all the time."""
    ring, count = RowRing(CONTEXT, PLAIN, 16), 50_000
    reader, process = RingReader(ring), CONTEXT.Process(target=write_many, args=(ring, count))
    process.start()
    read, last = 0, -1.0
    while process.is_alive():
        rows = reader.read()
        if len(rows):
            assert (rows == rows[:, :1]).all(), "a row of two periods"
            assert rows[0, 0] > last
            read, last = read + len(rows), rows[-1, 0]
    process.join()
    read += len(reader.read())
    assert process.exitcode == 0
    assert read + reader.lost == count
    assert read > 0


def test_a_ring_of_one_row_is_refused():
    with pytest.raises(InvalidValueError, match="at least 2"):
        RowRing(CONTEXT, PLAIN, 1)


def test_nothing_written_is_nothing_read():
    reader = RingReader(RowRing(CONTEXT, PLAIN))
    assert len(reader.read()) == 0
    assert reader.read().shape == (0, PLAIN)
    assert np.isfinite(reader.lost)


def filled_ring(capacity):
    """A ring that has just been filled: the next row goes over the oldest one."""
    ring = RowRing(CONTEXT, PLAIN, capacity)
    writer = RingWriter(ring)
    for _ in range(capacity):
        writer.write([7.0] * (PLAIN - 2))
    return ring, RingReader(ring), np.frombuffer(ring._memory)[:-1].reshape(capacity, -1)


def test_a_row_that_is_just_being_written_is_left_out():
    """Its ends may still be the old ones when a reader passes in the middle: only the count of rows tells."""
    _, reader, memory = filled_ring(8)
    memory[0, 5:-1] = -1.0
    rows = reader.read()
    assert rows[:, 0].tolist() == list(range(1, 8))
    assert (rows[:, 1:-1] == 7.0).all()
    assert reader.lost == 1


@pytest.mark.parametrize("end", [0, -1])
def test_a_row_with_two_numbers_is_left_out(end):
    _, reader, memory = filled_ring(8)
    memory[3, end] = 11.0  # what comes next in that place
    assert reader.read()[:, 0].tolist() == [1, 2, 4, 5, 6, 7]
