"""A row of numbers in memory that two processes share: one writes, the other reads, nobody waits.

Four slots in turn: a row is written to the next one with its number and a checksum of both, and then the number of
the newest. A reader copies the slot of that number and checks the copy. Whatever order a processor's stores become
visible in, and however often the writer went round meanwhile: a copy that is not one whole row has another number,
or passes its checksum by a chance of 2^-32.
"""

import mmap
import struct
import zlib
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
        self._row, self._checksum = struct.Struct(f"=q{width}d"), struct.Struct("=Q")
        self._slot = self._row.size + self._checksum.size
        self._memory, self._first = memory, offset + _BYTES
        self._newest = memoryview(memory)[offset : offset + _BYTES].cast("q")
        self._count = self._newest[0]

    def write(self, values: Sequence[float]) -> None:
        """Put a row in place of the last one."""
        self._count = count = self._count + 1
        row = self._row.pack(count, *values)
        place = self._place(count)
        self._memory[place : place + self._slot] = row + self._checksum.pack(zlib.crc32(row))
        self._newest[0] = count

    def read(self) -> tuple[float, ...] | None:
        """Return the newest row; None if there never was one, or if the writer always was in between."""
        for _ in range(_TRIES):
            count = self._newest[0]
            if not count:
                return None
            place = self._place(count)
            copy = self._memory[place : place + self._slot]
            row = self._row.unpack_from(copy)
            (checksum,) = self._checksum.unpack_from(copy, self._row.size)
            if row[0] == count and checksum == zlib.crc32(copy[: self._row.size]):
                return row[1:]
        return None

    def close(self) -> None:
        """Let go of the memory, so that it can be closed."""
        self._newest.release()

    def _place(self, count: int) -> int:
        return self._first + count % _SLOTS * self._slot


def size_of(width: int) -> int:
    """Return the bytes that a row of `width` numbers takes."""
    return _BYTES + _SLOTS * (width + 2) * _BYTES
