"""Resense HEX12 and HEX21: frames of seven numbers without header and without checksum.

Nothing in a frame says where it begins, and one lost byte would shift all that follow. Three things tell:

- Time. A frame of 28 bytes takes 0.14 ms at 2 Mbit/s, then the line is quiet until the next. What arrives between
  two silences must be whole frames, or all of it is dropped: a stretch that lost or gained a byte is.
- The temperature, the last number, is that of a room or a warm device, and changes slowly. Between 15 and 45 deg C
  no number turns into another one of that range when its bytes are shifted by one, whatever comes in at its end.
- The loads are finite, within a few times the sensor's range, and not tiny numbers either, which random bytes are
  half of the time and noise never.
"""

import math
from collections.abc import Sequence
from struct import Struct

from palpate.errors import positive, vector
from palpate.hw.ft_stream.link import StreamCounts, StreamReading
from palpate.hw.ft_stream.sample_clock import StreamClock
from palpate.hw.ft_stream.succession import ALIKE, MODULUS
from palpate.hw.serial_ft.line import SerialLine
from palpate.spatial import Vector

BAUD = 2_000_000
"""[bit/s]; with 8 data bits, no parity, 1 stop bit."""

FRAME = Struct("<7f")
"""Fx Fy Fz [N], Mx My Mz [N mm], temperature [deg C]."""

MOMENT_UNIT = 1e-3
"""N m per N mm, in which the maker's software shows moments; to be checked on the sensor at hand."""

TEMPERATURES = (15.0, 45.0)
"""Of a sensor in use [deg C]."""

LARGEST_STEP = 1.0
"""Of the temperature from frame to frame [K]."""

BEYOND = 4.0
"""Largest load that is believed, in units of the range: past the range it is a reading, but no good one."""

TINY = 1e-12
"""Least magnitude of a load that is not 0 [N, N mm]: a millionth of a millionth of its noise."""

OUT_OF_RANGE = 1
"""Status of a reading beyond the range; the sensor itself sends none."""


class Resense:
    """A Resense HEX; one for each line. It sends no time: what dates its readings is that it sends them regularly.

    Frames that are lost unseen look like a delay, a period each; the sensor is refused where many are.
    """

    title = "Resense sensor"
    baud = BAUD

    def __init__(self, force_range: Vector, moment_range: Vector, *, period: float = 0.001) -> None:
        """Take what is known of it.

        Args:
            force_range: Largest force of each axis [N].
            moment_range: Largest moment of each axis [N m].
            period: Between frames [s]; half of it without a byte is a silence.

        Raises:
            InvalidValueError: Not above 0.
        """
        ranges = (*vector("force_range", force_range, 3, "N"), *vector("moment_range", moment_range, 3, "N m"))
        self._range = tuple(positive("range", float(value), "N, N m") for value in ranges)
        self._silence = 0.5 * positive("period", period, "s")
        self._rest = bytearray()
        self._arrived = 0.0
        self._temperature = 0.0
        self._alike = 0
        self._began = False
        self._counts = StreamCounts()
        self._clock = StreamClock()
        self._frames = 0

    def begin(self, line: SerialLine, counts: StreamCounts) -> None:
        """Forget all frames: it streams by itself."""
        self._rest.clear()
        self._alike, self._began = 0, False
        self._counts = counts
        self._clock.restart()

    def records(self, data: bytes, arrival: float) -> Sequence[StreamReading]:
        """Return the readings of whole frames, all of them plausible, that arrived between two silences."""
        rest = self._rest
        if rest and arrival - self._arrived > self._silence:
            self._drop(len(rest))
        rest += data
        self._arrived = arrival
        if len(rest) % FRAME.size:
            if len(rest) > 1000 * FRAME.size:  # a line that is never quiet
                self._drop(len(rest))
            return ()
        readings = [self._reading(frame) for frame in FRAME.iter_unpack(rest)]
        found: list[StreamReading] = []
        temperature = self._temperature
        for reading in readings:
            if reading is None or (self._alike and abs(reading[2] - temperature) > LARGEST_STEP):
                self._drop(len(rest))
                self._alike = self._alike if self._began else 0
                return ()
            wrench, status, temperature = reading
            self._alike += 1
            if self._alike >= ALIKE:
                self._frames += 1
                time = self._clock.stamp(self._frames % MODULUS, arrival)
                found.append(StreamReading(arrival, time, wrench, status))
                self._began = True
        self._temperature = temperature
        rest.clear()
        self._counts.records += len(found)
        return found

    def problem(self, status: int) -> str:
        """Return what is wrong with a reading; empty if it is good."""
        return "load out of range, take it off" if status & OUT_OF_RANGE else ""

    def _drop(self, size: int) -> None:
        self._counts.refused += 1
        lost = math.ceil(size / FRAME.size) if self._began else 0
        self._counts.lost += lost
        self._frames += lost
        self._rest.clear()

    def _reading(self, frame: tuple[float, ...]) -> tuple[tuple[float, ...], int, float] | None:
        """Return wrench, status and temperature of a frame; None if it can be none."""
        *loads, temperature = frame
        least, most = TEMPERATURES
        if not least <= temperature <= most:
            return None
        wrench, status = [], 0
        for axis, load in enumerate(loads):
            value = load if axis < 3 else MOMENT_UNIT * load
            if load and not TINY <= abs(load) <= 1.0 / TINY:
                return None
            if abs(value) > self._range[axis]:
                if abs(value) > BEYOND * self._range[axis]:
                    return None
                status = OUT_OF_RANGE
            wrench.append(value)
        return tuple(wrench), status, temperature
