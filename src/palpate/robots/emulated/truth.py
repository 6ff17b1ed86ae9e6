"""Ground truth of a simulated scene, sent by the process that simulates it to the one that runs the robot.

Rows of numbers in memory that both share, beside all wires: no controller sees them. They carry `time.monotonic`,
which is the same clock in every process, so that a sample's own truth is found whatever its latency. One
message goes back: that the scene may begin.
"""

import mmap
import os
from collections.abc import Sequence
from time import monotonic
from typing import Self

import numpy as np

ROWS = 4096
"""In the memory: four seconds at 1 kHz, against a sample's age of some milliseconds."""

WIDEST = 74
"""Numbers in a row: hand and object, what pulls at it, and three fingers."""

_NUMBERS = WIDEST + 3
_HEADER = 2
_BYTES = 8 * (ROWS * _NUMBERS + _HEADER)


class TruthTrace:
    """One end of it. It has no name and leaves nothing behind, however its processes end."""

    def __init__(self, file: int) -> None:
        """Take an open descriptor of the memory; it stays the caller's."""
        self._memory = mmap.mmap(file, _BYTES)
        numbers = np.frombuffer(self._memory)
        self._header, self._rows = numbers[:_HEADER], numbers[_HEADER:].reshape(ROWS, _NUMBERS)

    @classmethod
    def of_process(cls, process: int, file: int) -> Self:
        """Open what another process of the same user has made, by its process and its descriptor there.

        Raises:
            OSError: It has ended, or has closed it.
        """
        own = os.open(f"/proc/{process}/fd/{file}", os.O_RDWR)
        try:
            return cls(own)
        finally:
            os.close(own)

    @property
    def begun(self) -> bool:
        """Whether the scene may begin."""
        return bool(self._header[1])

    def begin(self) -> None:
        """Let the scene begin."""
        self._header[1] = 1.0

    def write(self, values: Sequence[float], time: float | None = None) -> None:
        """Append a row, at most `WIDEST` numbers, of a time of `time.monotonic` [s]; of now if none is given."""
        count = self._header[0] + 1.0
        row = self._rows[int(count) % ROWS]
        row[0] = 0.0  # nobody takes it before it is whole
        row[1] = monotonic() if time is None else time
        row[2 : 2 + len(values)] = values
        row[-1] = row[0] = count
        self._header[0] = count

    def at(self, time: float) -> tuple[float, ...]:
        """Return the newest row no later than a time [s], the oldest that is left if all are; empty if none is."""
        newest = int(self._header[0])
        found: list[float] = []
        # the last quarter may be written anew while it is read
        for count in range(newest, max(0, newest - 3 * ROWS // 4), -1):
            row = self._rows[count % ROWS].tolist()
            if row[0] == row[-1] == count:
                found = row
                if row[1] <= time:
                    break
        return tuple(found[2:-1])

    def close(self) -> None:
        """Let go of the memory; may be called more than once."""
        if not self._memory.closed:
            del self._header, self._rows
            self._memory.close()


def new_memory() -> int:
    """Return a descriptor of fresh memory for a trace."""
    file = os.memfd_create("palpate-truth")
    os.ftruncate(file, _BYTES)
    return file
