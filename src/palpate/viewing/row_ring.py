"""Rows in memory that two processes share: the loop writes and never waits, the view reads what it can.

The writer overwrites the oldest row. Every row begins and ends with its number, from 0: a reader copies a row and
then looks whether both ends, and the count of rows, show that it was not written to meanwhile.
"""

import struct
from collections.abc import Sequence
from multiprocessing.context import BaseContext
from typing import Any

import numpy as np

from palpate.errors import FloatArray, InvalidValueError

CAPACITY = 8192
"""Rows: eight seconds at 1 kHz, 1.7 MB with one finger; a quarter of a second of a simulation at thirty times real
time."""

_BYTES = 8


class RowRing:
    """Shared memory for rows; it can be handed to a process that is being started.

    Attributes:
        width: Numbers of a row, its own number at both ends among them.
        capacity: Rows.
    """

    def __init__(self, context: BaseContext, width: int, capacity: int = CAPACITY) -> None:
        """Take the memory.

        Args:
            context: Of `multiprocessing`, with which the other process will be started.
            width: Numbers of a row, its own number at both ends among them.
            capacity: Rows.

        Raises:
            InvalidValueError: Less than two rows.
        """
        # without a lock: nobody waits for anybody. One number more: how many rows there ever were
        self._memory: Any = context.RawArray("d", capacity * width + 1)
        self._divide(width)

    def divided(self, width: int) -> "RowRing":
        """Return the same memory in rows of another width; both processes have to, before the first row.

        Raises:
            InvalidValueError: There is not room for two.
        """
        other = object.__new__(RowRing)
        other._memory = self._memory
        other._divide(width)
        return other

    def _divide(self, width: int) -> None:
        self.width, self.capacity = width, (len(self._memory) - 1) // width
        if self.capacity < 2:
            raise InvalidValueError(f"capacity = {self.capacity}: must be at least 2 rows")


class RingWriter:
    """The loop's end.

    Attributes:
        memory: Where rows go; see `begin`.
    """

    def __init__(self, ring: RowRing) -> None:
        """Take the memory; there may be one writer."""
        self.memory = ring._memory
        self._pack = struct.Struct(f"@{ring.width}d").pack_into
        self._put = struct.Struct("@d").pack_into
        self._capacity, self._row_bytes = ring.capacity, ring.width * _BYTES
        self._count_place = len(ring._memory) - 1
        self._count = 0

    def write(self, values: Sequence[float]) -> None:
        """Add a row.

        Args:
            values: Everything between the row's number at its beginning and the one at its end.
        """
        count = self._count
        place = count % self._capacity * self._row_bytes
        self._pack(self.memory, place, count, *values, count)
        self._count = count = count + 1
        # in one store; struct would clear it first, and a reader see none
        self.memory[self._count_place] = count

    def begin(self) -> int:
        """Return where in the memory the numbers of the next row are to be put [bytes], by whoever packs them."""
        place = self._count % self._capacity * self._row_bytes
        self._put(self.memory, place, self._count)
        return place + _BYTES

    def end(self) -> None:
        """Add the row that was put there."""
        count = self._count
        self._put(self.memory, (count % self._capacity + 1) * self._row_bytes - _BYTES, count)
        self._count = count = count + 1
        self.memory[self._count_place] = count


class RingReader:
    """The view's end.

    Attributes:
        lost: Rows that were written over before they were read.
    """

    def __init__(self, ring: RowRing) -> None:
        """Take the memory; begins with the oldest row that is there."""
        everything = np.frombuffer(ring._memory)
        self._rows: FloatArray = everything[: ring.capacity * ring.width].reshape(ring.capacity, ring.width)
        self._count: FloatArray = everything[-1:]
        self._capacity, self._next = ring.capacity, 0
        self.lost = 0

    def read(self) -> FloatArray:
        """Return what was written since the last time, without what was overwritten or is just being written.

        Returns:
            Shape (n, width), each row with its number at both ends.
        """
        count = int(self._count[0])
        first = max(self._next, count - self._capacity)
        numbers = np.arange(first, count)
        rows = self._rows[numbers % self._capacity]
        # what was overwritten while it was copied: the writer is at most one row beyond its count
        whole = (rows[:, 0] == numbers) & (rows[:, -1] == numbers)
        whole &= numbers > int(self._count[0]) - self._capacity
        self.lost += count - self._next - int(whole.sum())
        self._next = count
        return np.asarray(rows[whole])
