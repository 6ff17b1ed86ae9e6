"""Bota's serial force/torque sensors: binary frames with a checksum, set up by a dialogue in text."""

import math
from collections.abc import Sequence
from struct import Struct
from time import monotonic

from palpate.errors import InvalidValueError
from palpate.hw.ft_stream.link import StreamCounts, StreamReading
from palpate.hw.ft_stream.sample_clock import StreamClock
from palpate.hw.ft_stream.succession import Step, Succession
from palpate.hw.serial_ft.crc import crc16_x25
from palpate.hw.serial_ft.line import SerialLine

BAUD = 460_800
"""[bit/s]; with 8 data bits, no parity, 1 stop bit."""

HEADER = 0xAA
"""First byte of a frame."""

DATA = Struct("<H6fIf")
"""Status, Fx Fy Fz [N] Mx My Mz [N m], time [us], temperature [deg C]."""

CHECKSUM = Struct("<H")
"""CRC-16/X25 of the data, after them."""

FRAME = 1 + DATA.size + CHECKSUM.size
"""Bytes of a frame: 37."""

SINC_TIME = 19.53125e-6
"""Period per sinc length [s]: 512 give 100 readings a second."""

SINC_LENGTHS = (51, 512)
"""Least and largest that the sensor takes; 51 give 1004 readings a second."""

BOOTED = b"App Init"
"""Sent by a sensor that waits to be set up."""

BOOT = 1.5
"""Longest wait for `BOOTED` or a frame [s]."""

REPLY_WITHIN = 0.5
"""Longest wait for a reply [s]."""

FASTEST = 2e6
"""Twice the rate at which its clock of microseconds counts [1/s]."""

PLAUSIBLE = 1e5
"""Beyond any load of such a sensor [N, N m]."""

_MEANING = {1: "load out of range, take it off", 2: "measurements invalid", 3: "measurements raw, not calibrated"}
"""Of the bits of the status that make a reading useless; bit 0 says that it came late."""

_USELESS = 0b1110


class Bota:
    """A Bota sensor; one for each line."""

    title = "Bota sensor"
    baud = BAUD

    def __init__(self, sinc_length: int = 51, *, temperature_compensation: bool = False) -> None:
        """Take its settings.

        Args:
            sinc_length: Of its filter; the period of readings is `SINC_TIME` times this.
            temperature_compensation: Whether it corrects for its temperature.

        Raises:
            InvalidValueError: A length that it does not take.
        """
        least, most = SINC_LENGTHS
        if not least <= sinc_length <= most:
            raise InvalidValueError(f"sinc_length = {sinc_length!r}: must be {least} to {most}")
        self._sinc_length = sinc_length
        self._compensation = temperature_compensation
        self._period_us = 1e6 * SINC_TIME * sinc_length
        self._rest = bytearray()
        self._counts = StreamCounts()
        self._succession = Succession((FASTEST,), self._counts)
        self._clock = StreamClock()

    @property
    def period(self) -> float:
        """Between readings [s]."""
        return 1e-6 * self._period_us

    def begin(self, line: SerialLine, counts: StreamCounts) -> None:
        """Set it up: calibrated readings as binary frames at this baud rate, its filter, then run.

        Raises:
            OSError: It does not reply as it should.
        """
        _wait_for_life(line)
        dialogue = (
            (b"C", b"r,0,C,0"),
            (b"c,%d,1,0,4" % self._compensation, b"r,0,c,0"),
            (b"f,%d,0,0,0" % self._sinc_length, b"r,0,f,0"),
            (b"R", b"r,0,R,0"),
        )
        for question, reply in dialogue:
            if not line.ask(question, reply, REPLY_WITHIN):
                raise OSError(f"no reply {reply.decode()!r} to {question.decode()!r}: is it a Bota sensor?")
        self._rest.clear()
        self._counts = counts
        self._succession = Succession((FASTEST,), counts)
        self._clock.restart()

    def records(self, data: bytes, arrival: float) -> Sequence[StreamReading]:
        """Return the readings of the frames that are complete, have the right checksum, and follow one another."""
        rest = self._rest
        rest += data
        found: list[StreamReading] = []
        at = 0
        while (at := rest.find(HEADER, at)) >= 0 and at + FRAME <= len(rest):
            record = self._reading(rest, at, arrival)
            if record is None:
                at += 1
                continue
            found.extend(record)
            self._skipped(at)
            del rest[: at + FRAME]
            at = 0
        if at < 0:
            self._skipped(len(rest))
            rest.clear()
        elif at:
            self._skipped(at)
            del rest[:at]
        return found

    def problem(self, status: int) -> str:
        """Return what a status word says is wrong; empty if the reading is good."""
        if not status & _USELESS:
            return ""
        return f"status {status:#06x}: " + "; ".join(words for bit, words in _MEANING.items() if status >> bit & 1)

    def _skipped(self, count: int) -> None:
        """Count one stretch of bytes that were in no frame."""
        self._counts.refused += count > 0

    def _reading(self, rest: bytearray, at: int, arrival: float) -> tuple[StreamReading, ...] | None:
        """Return the reading of a frame, nothing if it is old or unproven, None if it is no frame."""
        if not _is_frame(rest, at):
            return None
        status, *loads, time, _ = DATA.unpack_from(rest, at + 1)
        if not all(math.isfinite(load) and abs(load) < PLAUSIBLE for load in loads):
            return None
        step, advance = self._succession.judge((time,), arrival)
        if step is Step.NEXT:
            self._counts.lost += max(round(advance / self._period_us) - 1, 0)
        elif step is Step.ANEW:
            self._clock.restart()
        else:
            return ()
        return (StreamReading(arrival, self._clock.stamp(time, arrival), tuple(loads), status),)


def _is_frame(data: bytearray, at: int) -> bool:
    """Whether a whole frame with the right checksum begins at `at`, where there is a header."""
    end = at + 1 + DATA.size
    return at + FRAME <= len(data) and crc16_x25(data[at + 1 : end]) == CHECKSUM.unpack_from(data, end)[0]


def _wait_for_life(line: SerialLine) -> None:
    """Return when the sensor says that it has booted, or streams; after `BOOT` it may be waiting to be asked."""
    heard = bytearray()
    deadline = monotonic() + BOOT
    while (left := deadline - monotonic()) > 0.0 and BOOTED not in heard:
        heard += line.receive(left)
        if any(_is_frame(heard, at) for at, byte in enumerate(heard) if byte == HEADER):
            return
        del heard[: max(len(heard) - 4 * FRAME, 0)]
