"""Emulated force/torque sensors on Ethernet: ATI Net F/T box, and OnRobot HEX on its box.

Records go by UDP to the client that asked last; an ATI box also sends its calibration by TCP.
"""

import contextlib
import math
import socket
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from time import monotonic

from palpate.errors import InvalidValueError, positive
from palpate.hw.emulators.connection import HangUpError, TcpServer
from palpate.hw.emulators.record_stream import ActiveFaults, NetFtFault, RecordStream
from palpate.hw.emulators.server import PlantState, fault_named, whole_number
from palpate.hw.netft.calibration import BoxCalibration
from palpate.hw.netft.rdt import (
    CALIBRATION,
    CALIBRATION_PORT,
    CALIBRATION_REQUEST,
    HEADER,
    RDT_PORT,
    REQUEST,
    OnRobotCommand,
    RdtCommand,
)
from palpate.hw.netft.settings import ONROBOT_FILTERS, ONROBOT_PERIODS, ONROBOT_SCALES, Scales
from palpate.hw.netft.status import NET_BOX, StatusWords
from palpate.spatial import Wrench

__all__ = ["BoxSettings", "NetFtFault", "NetFtServer", "OnRobotServer", "onrobot_box"]

INTERNAL_RATE = 7000.0
"""At which the box samples, and its ft_sequence counts [1/s]."""

PER_DATAGRAM = 40
"""Records in a datagram of the buffered stream: the largest that the manual's "RDT buffer size" allows."""

MOST_IN_FLIGHT = 64
"""Datagrams sent or read in one go, so that the other devices of the loop get their turn."""

LINES = 100
"""Requests remembered."""

BIAS_ON, BIAS_OFF = 255, 0
"""Values of the bias command."""

FIRST_RATE = 100.0
"""Rate of records when it is switched on [1/s]."""

RANGES = (200.0, 200.0, 200.0, 10.0, 6.5, 6.5)
"""Ranges of a HEX-E 70 [N, N m]: about those of its data sheet."""

MOST_CALIBRATIONS = 8
"""Clients of the calibration at a time; the oldest makes room for one more."""

CLIENT_TIMEOUT = 5.0
"""Time without a request after which a client of the calibration is closed [s]."""


class _CalibrationTalk:
    """Client of the calibration (a `Talk`): a reply of 24 bytes for each request of 20.

    Attributes:
        until: Time at which it is closed without a further request [s].
    """

    admitted = False

    def __init__(self, calibration: BoxCalibration, faults: ActiveFaults) -> None:
        self._reply = CALIBRATION.pack(
            HEADER,
            calibration.force_unit,
            calibration.torque_unit,
            calibration.counts_per_force,
            calibration.counts_per_torque,
            *(1,) * 6,
        )
        self._received, self._faults = b"", faults
        self.until = monotonic() + CLIENT_TIMEOUT

    def feed(self, data: bytes, now: float) -> bytes:
        """See `Talk`."""
        self._received += data
        self.until = now + CLIENT_TIMEOUT
        count, size = 0, len(CALIBRATION_REQUEST)
        while len(self._received) >= size:
            request, self._received = self._received[:size], self._received[size:]
            if request != CALIBRATION_REQUEST:
                raise HangUpError("no request for a calibration", count * self._reply)
            count += not self._faults.silent
        return count * self._reply

    def close(self) -> None:
        """See `Talk`."""


@dataclass(frozen=True, slots=True)
class BoxSettings:
    """Settings on the web page of a box.

    Attributes:
        address: Only address at which it listens; every emulated box can have its own 127.x.y.z.
        calibration: Units, and counts per unit; Nano17 calibrations often have N and N mm.
        rate: Rate of records [1/s], up to 7000.
        ranges: Largest load of each axis [N, N m]; beyond, it reports so and shows the end of the range.
        status_words: Status bits of an overload, by make.
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
        """Check the settings.

        Raises:
            InvalidValueError: If the rate is above that of its sampling, or not above 0.
        """
        if positive("rate", self.rate, "1/s") > INTERNAL_RATE:
            raise InvalidValueError(f"rate = {self.rate:g} 1/s: a box samples {INTERNAL_RATE:g} times a second")


class NetFtServer:
    """Box that shows the wrench of one sensor of the plant (a `Server`). Its rate is one of wall time.

    Attributes:
        name: Name for messages and faults.
        address: IP address of the box.
        ignored: Datagrams that were no request.
    """

    HAS_CALIBRATION = True

    def __init__(self, settings: BoxSettings, sensor: int = 0) -> None:
        """Listen.

        Args:
            settings: Settings of the box.
            sensor: Index of the wrench that it shows in `PlantState.wrenches`.

        Raises:
            OSError: If the address or a port is taken.
        """
        self.name, self.address, self.ignored = f"F/T box {sensor}", settings.address, 0
        self._settings = settings
        self._sensor = sensor
        self._scales = self._scales_of(settings)
        self._faults = ActiveFaults()
        self._wrench: tuple[float, ...] = (0.0,) * 6
        self._bias: tuple[int, ...] = (0,) * 6
        self._obeyed: deque[str] = deque(maxlen=LINES)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.bind((settings.address, settings.rdt_port))
            self._socket.setblocking(False)
            talk = lambda _: _CalibrationTalk(settings.calibration, self._faults)  # noqa: E731
            ports = {settings.calibration_port: talk} if self.HAS_CALIBRATION else {}
            self._calibration = TcpServer(settings.address, ports, MOST_CALIBRATIONS)
        except BaseException:
            self._socket.close()
            raise
        self._stream = RecordStream(self._send, self._faults, settings.rate, INTERNAL_RATE, monotonic())
        self._destination: tuple[str, int] | None = None
        self._show()

    @property
    def rdt_port(self) -> int:
        """UDP port of the records."""
        return int(self._socket.getsockname()[1])

    @property
    def calibration_port(self) -> int:
        """TCP port of the calibration; 0 if it has none."""
        return self._calibration.port

    @property
    def sent(self) -> int:
        """Records sent since the start."""
        return self._stream.sent

    def status(self) -> Mapping[str, object]:
        """Return its state, for tests."""
        return {
            "sent": self._stream.sent,
            "ignored": self.ignored,
            "destination": "" if self._destination is None else f"{self._destination[0]}:{self._destination[1]}",
        }

    def lines(self) -> list[str]:
        """Return the newest requests that were obeyed, oldest first."""
        return list(self._obeyed)

    def files(self) -> Sequence[int]:
        """Return the sockets."""
        return (self._socket.fileno(), *self._calibration.files())

    def receive(self, file: int, now: float) -> None:
        """Reply to the requests that have arrived."""
        if file != self._socket.fileno():
            self._calibration.receive(file, now)
            return
        for _ in range(MOST_IN_FLIGHT):
            try:
                datagram, sender = self._socket.recvfrom(REQUEST.size + 1)
            except OSError:
                return
            if len(datagram) != REQUEST.size:
                self.ignored += 1
                continue
            header, command, value = REQUEST.unpack(datagram)
            if header != HEADER or not self._obey(command, value, sender, now):
                self.ignored += 1
                continue
            self._obeyed.append(f"{sender[0]}:{sender[1]} {command:#x} {value}")

    def due(self) -> float:
        """Return when the next record, or a client without a request, is due [s]."""
        return min(self._stream.due(), *self._closing().values(), math.inf)

    def tick(self, now: float) -> None:
        """Send the records that are due, and close clients without a request."""
        self._stream.send_due(now, MOST_IN_FLIGHT)
        for file, until in self._closing().items():
            if until <= now:
                self._calibration.drop(file)

    def take(self, state: PlantState) -> None:
        """Measure the wrench."""
        wrench = state.wrenches[self._sensor].wrench
        if wrench != self._wrench:
            self._wrench = wrench
            self._show()

    def inject(self, fault: str, value: float) -> str:
        """Switch a `NetFtFault` on or off.

        Raises:
            InvalidValueError: If there is no such fault, or its value is impossible.
        """
        kind, faults = fault_named(NetFtFault, fault), self._faults
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
                    raise InvalidValueError("fault reordered = 1: must be 0, or at least 2")
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
        self._calibration.close()

    def _scales_of(self, settings: BoxSettings) -> Scales:
        return settings.calibration.scales

    def _closing(self) -> dict[int, float]:
        """Return when each client of the calibration is to be closed [s]."""
        talks = {file: client.talk for file, client in self._calibration.clients.items()}
        return {file: talk.until for file, talk in talks.items() if isinstance(talk, _CalibrationTalk)}

    def _obey(self, command: int, value: int, sender: tuple[str, int], now: float) -> bool:
        """Carry out a command; return whether there is such a command."""
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
            with contextlib.suppress(OSError):  # a full buffer, or a client that is gone: as on any network
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
        """Set the present load and status in the stream."""
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


def onrobot_box(address: str = "127.0.0.1", rdt_port: int = RDT_PORT) -> BoxSettings:
    """Return the settings of a box when it is switched on."""
    return BoxSettings(address, rate=FIRST_RATE, ranges=RANGES, rdt_port=rdt_port)


class OnRobotServer(NetFtServer):
    """OnRobot HEX on its Ethernet box: ATI's records with other scales, and commands of its own.

    Its calibration is fixed: there is no TCP port.
    """

    HAS_CALIBRATION = False

    def _scales_of(self, settings: BoxSettings) -> Scales:
        return ONROBOT_SCALES

    def _obey(self, command: int, value: int, sender: tuple[str, int], now: float) -> bool:
        if self._faults.silent:
            return True
        match command:
            case OnRobotCommand.PERIOD:
                least, most = ONROBOT_PERIODS
                if not least <= 1e-3 * value <= most:
                    return False
                self._stream.set_rate(1e3 / value, now)
            case OnRobotCommand.FILTER:
                return 0 <= value < len(ONROBOT_FILTERS)  # the plant's wrench has no noise to filter
            case RdtCommand.BIAS:
                if value not in (BIAS_ON, BIAS_OFF):
                    return False
                self._take_bias(on=value == BIAS_ON)
            case _:
                return super()._obey(command, value, sender, now)
        return True
