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
from palpate.viewing.frames import FrameLayout, Frames

CAPACITY = 8192
"""Rows: eight seconds at 1 kHz, 1.7 MB with one finger; a quarter of a second of a simulation at thirty times real
time."""

_BYTES = 8


class FrameRing:
    """Shared memory for frames; it can be handed to a process that is being started.

    Attributes:
        layout: Of a row.
        capacity: Rows.
    """

    def __init__(self, context: BaseContext, layout: FrameLayout, capacity: int = CAPACITY) -> None:
        """Take the memory.

        Args:
            context: Of `multiprocessing`, with which the other process will be started.
            layout: Of a row.
            capacity: Rows.

        Raises:
            InvalidValueError: Less than two rows.
        """
        if capacity < 2:
            raise InvalidValueError(f"capacity = {capacity}: must be at least 2 rows")
        self.layout, self.capacity = layout, capacity
        # without a lock: nobody waits for anybody. One number more: how many rows there ever were
        self._memory: Any = context.RawArray("d", capacity * layout.width + 1)


class RingWriter:
    """The loop's end."""

    def __init__(self, ring: FrameRing) -> None:
        """Take the memory; there may be one writer."""
        width = ring.layout.width
        self._memory = ring._memory
        self._pack = struct.Struct(f"@{width}d").pack_into
        self._capacity, self._row_bytes = ring.capacity, width * _BYTES
        self._count_place = ring.capacity * width
        self._count = 0

    def write(self, values: Sequence[float]) -> None:
        """Add a row.

        Args:
            values: Everything between the row's number at its beginning and the one at its end.
        """
        count = self._count
        place = count % self._capacity * self._row_bytes
        self._pack(self._memory, place, count, *values, count)
        self._count = count = count + 1
        # in one store; struct would clear it first, and a reader see none
        self._memory[self._count_place] = count


class RingReader:
    """The view's end."""

    def __init__(self, ring: FrameRing) -> None:
        """Take the memory; begins with the oldest row that is there."""
        everything = np.frombuffer(ring._memory)
        self._rows: FloatArray = everything[:-1].reshape(ring.capacity, ring.layout.width)
        self._count: FloatArray = everything[-1:]
        self._layout, self._capacity, self._next = ring.layout, ring.capacity, 0
        self.lost = 0

    def read(self) -> Frames:
        """Return what was written since the last time, without what was overwritten or is just being written."""
        count = int(self._count[0])
        first = max(self._next, count - self._capacity)
        numbers = np.arange(first, count)
        rows = self._rows[numbers % self._capacity]
        # what was overwritten while it was copied: the writer is at most one row beyond its count
        whole = (rows[:, 0] == numbers) & (rows[:, -1] == numbers)
        whole &= numbers > int(self._count[0]) - self._capacity
        self.lost += count - self._next - int(whole.sum())
        self._next = count
        return Frames(rows[whole], self._layout)
