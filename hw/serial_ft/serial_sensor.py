"""A sensor on a serial line behind the same interface as one on Ethernet."""

from collections.abc import Sequence
from time import monotonic

from palpate.hw.devices import WireError
from palpate.hw.ft_stream.link import StreamCounts, StreamReading
from palpate.hw.ft_stream.streamed_sensor import StreamedSensor, StreamSettings
from palpate.hw.serial_ft.line import Make, SerialLine

WAIT = 0.01
"""For bytes [s]; in between the reading thread looks whether it is to end, or to begin again."""


class SerialLink:
    """The line to a sensor; when it is gone it is opened again, and the sensor set up again."""

    def __init__(self, path: str, make: Make) -> None:
        """Take the path of the terminal; nothing is opened."""
        self._path = path
        self._make = make
        self._line: SerialLine | None = None
        self._fresh = False
        self._closed = "the line is closed"
        self._counts = StreamCounts()

    @property
    def name(self) -> str:
        """For messages."""
        return f"{self._make.title} at {self._path}"

    @property
    def counts(self) -> StreamCounts:
        """What became of the bytes."""
        return self._counts

    def open(self) -> None:
        """Open the line.

        Raises:
            DeviceError: It is not there, or is in use.
        """
        self.close()
        self._counts = StreamCounts()
        try:
            self._line = SerialLine(self._path, self._make.baud)
        except OSError as error:
            raise WireError(
                self.name, error.strerror or str(error), "check the cable, the path, and that nobody else uses it"
            ) from None
        self._fresh = True

    def request(self) -> None:
        """Set the sensor up and let it stream; open the line again if that did not help before.

        Raises:
            OSError: The line is gone, or the sensor does not reply.
        """
        self._counts.requests += 1
        try:
            if not self._fresh:
                self.close()
                self._line = SerialLine(self._path, self._make.baud)
            self._fresh = False
            self._make.begin(self._open_line(), self._counts)
        except OSError as error:
            self._closed = error.strerror or str(error)
            raise

    def receive(self) -> Sequence[StreamReading]:
        """Return the records that have arrived.

        Raises:
            OSError: The line is gone.
        """
        data = self._open_line().receive(WAIT)
        return self._make.records(data, monotonic()) if data else ()

    def problem(self, status: int) -> str:
        """Return what a status word says is wrong; empty if the reading is good."""
        return self._make.problem(status) if status else ""

    def close(self) -> None:
        """Close the line."""
        line, self._line = self._line, None
        if line is not None:
            line.close()

    def _open_line(self) -> SerialLine:
        if self._line is None:
            raise OSError(self._closed)
        return self._line


class SerialSensor(StreamedSensor):
    """A `SensorDevice` on a serial line or USB."""

    def __init__(self, path: str, make: Make, settings: StreamSettings) -> None:
        """Take the path of the terminal; nothing is opened before `start`.

        Args:
            path: Such as /dev/serial/by-id/..., which stays the same when it is plugged in again.
            make: What speaks there; one for each sensor.
            settings: How the stream is watched.
        """
        super().__init__(SerialLink(path, make), settings)
