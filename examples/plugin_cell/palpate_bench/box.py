"""What the sensor sends on its line: `FX,FY,FZ,MX,MY,MZ`, forces in N, moments in N mm, 500 lines a second."""

from palpate.hw.ft_stream.link import StreamCounts, StreamReading
from palpate.hw.ft_stream.sample_clock import StreamClock
from palpate.hw.serial_ft.line import SerialLine

RATE = 500.0
"""[1/s]"""


class BenchLines:
    """What its lines mean: see `palpate.hw.serial_ft.line.Make`."""

    title, baud = "bench box", 115_200

    def begin(self, line: SerialLine, counts: StreamCounts) -> None:
        """It streams by itself."""
        self.rest, self.counts, self.count, self.clock = b"", counts, 0, StreamClock()

    def records(self, data: bytes, arrival: float) -> list[StreamReading]:
        """Return the readings in what has arrived."""
        *lines, self.rest = (self.rest + data).split(b"\n")
        readings = []
        for line in lines:
            try:
                fx, fy, fz, mx, my, mz = map(float, line.split(b","))
            except ValueError:  # cut off, or garbled
                self.counts.refused += 1
                continue
            self.count += 1  # it sends no number
            wrench = (fx, fy, fz, 1e-3 * mx, 1e-3 * my, 1e-3 * mz)
            readings.append(StreamReading(arrival, self.clock.stamp(self.count, arrival), wrench, 0))
        self.counts.records += len(readings)
        return readings

    def problem(self, status: int) -> str:
        """It reports none."""
        return ""
