"""A row of numbers in memory that two processes share: one writes, the other reads, nobody waits.

Four slots in turn: a row is written to the next one, and then its number is, in one store. A reader copies the
slot of the newest number and looks at the number again: only a writer that went round meanwhile can have touched
the copy. That a number is not seen before its row relies on x86's order of stores; the row's own number at both of
its ends finds it where that does not hold, but for a copy in which both are new and something between is old.
"""

import mmap
import struct
from collections.abc import Sequence

_SLOTS = 4
_TRIES = 8
_BYTES = 8


class SharedRow:
    """One end of it; the writing process and the reading one each have theirs.

    Attributes:
        size: Bytes that a row of so many numbers takes.
    """

    def __init__(self, memory: mmap.mmap, offset: int, width: int) -> None:
        """Take a part of the memory, which must begin as zeros.

        Args:
            memory: Shared.
            offset: Where the row begins, a multiple of 8 [bytes].
            width: Numbers per row.
        """
        self.size = size_of(width)
        self._struct = struct.Struct(f"@q{width}dq")
        self._memory, self._first = memory, offset + _BYTES
        self._newest = memoryview(memory)[offset : offset + _BYTES].cast("q")
        self._count = self._newest[0]

    def write(self, values: Sequence[float]) -> None:
        """Put a row in place of the last one."""
        self._count = count = self._count + 1
        place = self._first + count % _SLOTS * self._struct.size
        self._struct.pack_into(self._memory, place, count, *values, count)
        self._newest[0] = count

    def read(self) -> tuple[float, ...] | None:
        """Return the newest row; None if there never was one, or if the writer always was in between."""
        for _ in range(_TRIES):
            count = self._newest[0]
            if not count:
                return None
            row = self._struct.unpack_from(self._memory, self._first + count % _SLOTS * self._struct.size)
            if row[0] == row[-1] == count and self._newest[0] - count < _SLOTS - 1:
                return row[1:-1]
        return None

    def close(self) -> None:
        """Let go of the memory, so that it can be closed."""
        self._newest.release()


def size_of(width: int) -> int:
    """Return the bytes that a row of `width` numbers takes."""
    return _BYTES + _SLOTS * (width + 2) * _BYTES
