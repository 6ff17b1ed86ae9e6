"""An ATI Net F/T box: records by UDP to whoever asked last, the calibration by TCP."""

import contextlib
import math
import socket
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from time import monotonic

from palpate.errors import InvalidValueError, positive
from palpate.hw.emulators.netft.calibration_port import CalibrationPort
from palpate.hw.emulators.netft.faults import ActiveFaults, NetFtFault, fault_named, whole_number
from palpate.hw.emulators.netft.record_stream import RecordStream
from palpate.hw.emulators.plant import PlantState
from palpate.hw.netft.calibration import BoxCalibration
from palpate.hw.netft.rdt import CALIBRATION_PORT, HEADER, RDT_PORT, REQUEST, RdtCommand
from palpate.hw.netft.settings import Scales
from palpate.hw.netft.status import NET_BOX, StatusWords
from palpate.spatial import Wrench

INTERNAL_RATE = 7000.0
"""At which the box samples, and its ft_sequence counts [1/s]."""

PER_DATAGRAM = 40
"""Records in a datagram of the buffered stream: the largest that the manual's "RDT buffer size" allows."""

MOST_IN_FLIGHT = 64
"""Datagrams sent or read in one go, so that the other devices of the loop get their turn."""

LINES = 100
"""Requests remembered."""


@dataclass(frozen=True, slots=True)
class BoxSettings:
    """What is set on the web page of a box.

    Attributes:
        address: It listens there and nowhere else; every emulated box can have its own 127.x.y.z.
        calibration: Units, and counts per unit; Nano17 calibrations often have N and N mm.
        rate: Of records [1/s], up to 7000.
        ranges: Largest load of each axis [N, N m]; beyond, it says so and shows the end of the range.
        status_words: The make, which decides the bits of an overload.
        rdt_port: UDP; 0: any free one.
        calibration_port: TCP; 0: any free one.
    """

    address: str = "127.0.0.1"
    calibration: BoxCalibration = field(default=BoxCalibration(2, 4, 1_000_000, 1_000_000))
    rate: float = 1000.0
    ranges: Wrench = (12.0, 12.0, 17.0, 0.12, 0.12, 0.12)
    status_words: StatusWords = NET_BOX
    rdt_port: int = RDT_PORT
    calibration_port: int = CALIBRATION_PORT

    def __post_init__(self) -> None:
        """Refuse what a box cannot do.

        Raises:
            InvalidValueError: A rate above that of its sampling, or not above 0.
        """
        if positive("rate", self.rate, "1/s") > INTERNAL_RATE:
            raise InvalidValueError(f"rate = {self.rate:g} 1/s: a box samples {INTERNAL_RATE:g} times a second")


class NetFtServer:
    """A `Server` that shows the wrench of one sensor of the plant. Its rate is one of wall time."""

    def __init__(self, settings: BoxSettings, sensor: int = 0) -> None:
        """Listen.

        Args:
            settings: Of the box.
            sensor: Whose wrench it shows: index into `PlantState.wrenches`.

        Raises:
            OSError: The address or a port cannot be had.
        """
        self._settings = settings
        self._sensor = sensor
        self._scales = self._scales_of(settings)
        self._faults = ActiveFaults()
        self._wrench: tuple[float, ...] = (0.0,) * 6
        self._bias: tuple[int, ...] = (0,) * 6
        self._ignored = 0
        self._obeyed: deque[str] = deque(maxlen=LINES)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.bind((settings.address, settings.rdt_port))
            self._socket.setblocking(False)
            self._calibration = self._open_calibration(settings)
        except BaseException:
            self._socket.close()
            raise
        self._stream = RecordStream(self._send, self._faults, settings.rate, INTERNAL_RATE, monotonic())
        self._destination: tuple[str, int] | None = None
        self._show()

    @property
    def name(self) -> str:
        """For messages and faults."""
        return f"F/T box {self._sensor}"

    @property
    def address(self) -> str:
        """Its IP address."""
        return self._settings.address

    @property
    def rdt_port(self) -> int:
        """The UDP port that it got."""
        return int(self._socket.getsockname()[1])

    @property
    def calibration_port(self) -> int:
        """The TCP port that it got; 0 if it has none."""
        return 0 if self._calibration is None else self._calibration.port

    @property
    def ignored(self) -> int:
        """Datagrams that were no request."""
        return self._ignored

    @property
    def sent(self) -> int:
        """Records sent since the start."""
        return self._stream.sent

    def status(self) -> Mapping[str, object]:
        """Return what goes on, for tests."""
        return {
            "sent": self._stream.sent,
            "ignored": self._ignored,
            "destination": "" if self._destination is None else f"{self._destination[0]}:{self._destination[1]}",
        }

    def lines(self) -> list[str]:
        """Return the newest requests that were obeyed, oldest first."""
        return list(self._obeyed)

    def files(self) -> Sequence[int]:
        """Return the sockets."""
        extra = () if self._calibration is None else self._calibration.files()
        return (self._socket.fileno(), *extra)

    def receive(self, file: int, now: float) -> None:
        """Reply to what has arrived."""
        if file != self._socket.fileno():
            if self._calibration is not None:
                self._calibration.receive(file, now, silent=self._faults.silent)
            return
        for _ in range(MOST_IN_FLIGHT):
            try:
                datagram, sender = self._socket.recvfrom(REQUEST.size + 1)
            except OSError:
                return
            if len(datagram) != REQUEST.size:
                self._ignored += 1
                continue
            header, command, value = REQUEST.unpack(datagram)
            if header != HEADER or not self._obey(command, value, sender, now):
                self._ignored += 1
                continue
            self._obeyed.append(f"{sender[0]}:{sender[1]} {command:#x} {value}")

    def due(self) -> float:
        """Return when the next record is due [s]."""
        calibration = math.inf if self._calibration is None else self._calibration.due()
        return min(self._stream.due(), calibration)

    def tick(self, now: float) -> None:
        """Send the records that are due."""
        self._stream.send_due(now, MOST_IN_FLIGHT)
        if self._calibration is not None:
            self._calibration.tick(now)

    def take(self, state: PlantState) -> None:
        """Measure the wrench."""
        wrench = state.wrenches[self._sensor].wrench
        if wrench != self._wrench:
            self._wrench = wrench
            self._show()

    def inject(self, fault: str, value: float) -> str:
        """Switch a `NetFtFault` on or off.

        Raises:
            InvalidValueError: It is unknown, or its value cannot be.
        """
        kind, faults = fault_named(fault), self._faults
        number = whole_number(fault, value, 2**32 - 1)
        match kind:
            case NetFtFault.SILENT:
                faults.silent = number > 0
            case NetFtFault.OUT_OF_RANGE:
                faults.out_of_range = number > 0
            case NetFtFault.STATUS:
                faults.status = number
            case NetFtFault.GAP:
                self._stream.skip(number)
            case NetFtFault.RESTARTED:
                self._stream.count_anew(monotonic())
            case NetFtFault.REBOOTED:
                self._stream.count_anew(monotonic())
                self._stop()
            case NetFtFault.DROPPED:
                faults.dropped = number
            case NetFtFault.REORDERED:
                if number == 1:
                    raise InvalidValueError("fault 'reordered' = 1: must be 0, or at least 2")
                faults.reordered = number
            case NetFtFault.REPEATED:
                faults.repeated = number
            case NetFtFault.WRONG_LENGTH:
                faults.wrong_length = number
        self._show()
        return f"{self.name}: {kind.value} = {number}"

    def close(self) -> None:
        """Close all sockets."""
        self._stop()
        self._socket.close()
        if self._calibration is not None:
            self._calibration.close()

    def _scales_of(self, settings: BoxSettings) -> Scales:
        return settings.calibration.scales

    def _open_calibration(self, settings: BoxSettings) -> CalibrationPort | None:
        return CalibrationPort(settings.address, settings.calibration_port, settings.calibration)

    def _obey(self, command: int, value: int, sender: tuple[str, int], now: float) -> bool:
        """Do what was asked; return whether there is such a command."""
        if self._faults.silent:
            return True
        match command:
            case RdtCommand.STOP:
                self._stop()
            case RdtCommand.STREAM | RdtCommand.STREAM_MULTI_UNIT:
                self._start(sender, now, value, 1)
            case RdtCommand.STREAM_BUFFERED:
                self._start(sender, now, value, PER_DATAGRAM)
            case RdtCommand.RESET_LATCH:
                pass  # no monitor conditions here
            case RdtCommand.BIAS:
                self._take_bias()
            case _:
                return False
        return True

    def _take_bias(self, *, on: bool = True) -> None:
        self._bias = self._counts() if on else (0,) * 6
        self._show()

    def _start(self, sender: tuple[str, int], now: float, records: int, per_datagram: int) -> None:
        self._destination = sender
        self._stream.start(now, records, per_datagram)

    def _stop(self) -> None:
        self._stream.stop()
        self._destination = None

    def _send(self, datagram: bytes) -> None:
        if self._destination is not None:
            with contextlib.suppress(OSError):  # a full buffer or a client that has gone: as on any network
                self._socket.sendto(datagram, self._destination)

    def _counts(self) -> tuple[int, ...]:
        """Return the load in counts, cut off at the ends of the ranges."""
        counts = []
        for axis, value in enumerate(self._wrench):
            largest = self._settings.ranges[axis]
            unit = self._scales.force if axis < 3 else self._scales.moment
            counts.append(round(min(max(value, -largest), largest) / unit) if math.isfinite(value) else 0)
        return tuple(counts)

    def _show(self) -> None:
        """Let the stream send the present load and status."""
        beyond = any(not abs(v) <= most for v, most in zip(self._wrench, self._settings.ranges, strict=True))
        status, shown = self._faults.status, self._counts()
        if self._faults.out_of_range:
            beyond = True
            shown = tuple(
                round(most / (self._scales.force if axis < 3 else self._scales.moment))
                for axis, most in enumerate(self._settings.ranges)
            )
        if beyond:
            status |= self._settings.status_words.out_of_range
        self._stream.show(status, tuple(c - zero for c, zero in zip(shown, self._bias, strict=True)))
