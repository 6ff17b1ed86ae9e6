"""The seam between a wire with its frames and what is done with the records."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol


class StreamReading(NamedTuple):
    """One reading that a link believes.

    Attributes:
        arrival: When it was read from the wire, `time.monotonic` [s].
        time: When it was sampled, as far as the wire proves it; -infinity as long as that proves nothing [s].
        wrench: As the device gives it, without tare [N, N m, or raw].
        status: The device's status word; `Link.problem` puts it in words.
    """

    arrival: float
    time: float
    wrench: tuple[float, ...]
    status: int


@dataclass(slots=True)
class StreamCounts:
    """What became of all that arrived.

    Attributes:
        records: Accepted.
        lost: Missing between accepted ones, by the device's own count.
        older: Dropped because they were repeated, or older than one accepted before.
        refused: Frames or stretches of bytes that were no record of this stream.
        restarts: Times that the device counted anew.
        requests: Times that it was asked to stream, the first included.
    """

    records: int = 0
    lost: int = 0
    older: int = 0
    refused: int = 0
    restarts: int = 0
    requests: int = 0


class Link(Protocol):
    """A device on its wire. `open` and `close` are called by whoever starts it, the rest by one reading thread."""

    @property
    def name(self) -> str:
        """For messages: "Net F/T at 192.168.1.1"."""
        ...

    @property
    def counts(self) -> StreamCounts:
        """Kept up to date by `receive` and `request`."""
        ...

    def open(self) -> None:
        """Connect, and learn what the device must tell before it streams.

        Raises:
            DeviceError: It cannot be reached, or is not fit.
        """
        ...

    def request(self) -> None:
        """Do what makes it stream, now or again.

        Raises:
            OSError: It cannot be done.
        """
        ...

    def receive(self) -> Sequence[StreamReading]:
        """Return what has arrived, oldest first; wait for it for about 10 ms at most, then return nothing.

        Raises:
            OSError: The wire is broken, or nobody listens.
        """
        ...

    def problem(self, status: int) -> str:
        """Return what a status word says is wrong; empty if the reading is good."""
        ...

    def close(self) -> None:
        """Stop the stream and let go of the wire; any number of times."""
        ...
