"""A serial line, and the seam to the makes of sensors on it."""

import contextlib
import select
from collections.abc import Sequence
from os import read
from time import monotonic
from typing import Protocol

import serial

from palpate.hw.ft_stream.link import StreamCounts, StreamReading

MOST = 4096
"""Read in one go [bytes]: what a terminal of the system holds."""


class SerialLine:
    """An open serial port."""

    def __init__(self, path: str, baud: int) -> None:
        """Open it, for this program alone.

        Raises:
            OSError: It is not there, is in use, or cannot run at this rate.
        """
        self._port = serial.Serial(path, baud, timeout=0.0, write_timeout=0.5, exclusive=True)
        with contextlib.suppress(ValueError):  # what is no USB adapter has no such mode
            self._port.set_low_latency_mode(True)  # else an adapter gathers bytes for 16 ms

    def receive(self, wait: float) -> bytes:
        """Return what has arrived; wait for it for at most `wait` [s], then return nothing.

        Raises:
            OSError: It was unplugged.
        """
        file = self._port.fileno()
        if not select.select((file,), (), (), wait)[0]:
            return b""
        data = read(file, MOST)
        if not data:
            raise OSError("the line is gone: is it unplugged?")
        return data

    def send(self, data: bytes) -> None:
        """Send all of it.

        Raises:
            OSError: It was unplugged, or takes nothing.
        """
        self._port.write(data)

    def ask(self, question: bytes, reply: bytes, patience: float) -> bool:
        """Send a question, and return whether its reply came within `patience` [s]; other bytes are skipped.

        Raises:
            OSError: It was unplugged.
        """
        self.send(question)
        heard = bytearray()
        deadline = monotonic() + patience
        while (left := deadline - monotonic()) > 0.0:
            heard += self.receive(left)
            if reply in heard:
                return True
            del heard[: max(len(heard) - MOST, 0)]
        return False

    def close(self) -> None:
        """Close it; any number of times."""
        self._port.close()


class Make(Protocol):
    """What one make of sensor says on its line."""

    @property
    def title(self) -> str:
        """For messages: "Bota sensor"."""
        ...

    @property
    def baud(self) -> int:
        """Of the line [bit/s]."""
        ...

    def begin(self, line: SerialLine, counts: StreamCounts) -> None:
        """Make it stream, and begin to count.

        Raises:
            OSError: It does not reply as it should, or the line is gone.
        """
        ...

    def records(self, data: bytes, arrival: float) -> Sequence[StreamReading]:
        """Return the records that are complete with what has just arrived, oldest first."""
        ...

    def problem(self, status: int) -> str:
        """Return what a status word says is wrong; empty if the reading is good."""
        ...
