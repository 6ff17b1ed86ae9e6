"""Emulated force/torque sensors on pseudo-terminals: Bota, Resense HEX. They send frames at fixed deadlines."""

import math
import re
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from enum import StrEnum
from pathlib import Path
from time import monotonic

from palpate.errors import positive
from palpate.hw.emulators.server import PlantState, fault_named, whole_number
from palpate.hw.emulators.terminal import Terminal
from palpate.hw.serial_ft.bota import BOOTED, CHECKSUM, DATA, HEADER, SINC_LENGTHS, SINC_TIME
from palpate.hw.serial_ft.crc import crc16_x25
from palpate.hw.serial_ft.resense import FRAME, MOMENT_UNIT
from palpate.spatial import Wrench

MAX_LATENESS = 0.1
"""Lateness from which frames are left out [s]."""

MOST_AT_ONCE = 32
"""Frames that are sent in one call."""

NOISE = b"\xaa\x00\x5a"
"""Bytes of the fault of that name, with a false header among them."""

BOOT_PERIOD = 0.1
"""Time between two reports that it has booted [s]; assumed: the maker's example waits for it at each start."""

TEMPERATURE = 30.0
"""Temperature that it shows [deg C]."""

LONGEST = 64
"""Bytes of an incomplete request that are kept."""

_OUT_OF_RANGE = 0b10
"""Status bit of a load out of range."""

_QUESTION = re.compile(rb"([CR])|c,([01]),([01]),([0-9]),([0-9])|f,([0-9]{1,4}),([01]),([01]),([01])")


class SerialFault(StrEnum):
    """Fault of a serial line; the meaning of its value is in brackets. 0 ends it."""

    SILENT = "silent"
    """Sends nothing (1: on)."""
    LOST_BYTE = "lost_byte"
    """Every k-th frame lacks a byte, another one each time (k)."""
    NOISE = "noise"
    """Before every k-th frame there are meaningless bytes (k)."""
    DAMAGED = "damaged"
    """A bit of every k-th frame is inverted, another one each time (k)."""
    PIECES = "pieces"
    """Frames come in pieces of so many bytes (how many)."""
    DROPPED = "dropped"
    """Every k-th frame is not sent (k)."""
    OUT_OF_RANGE = "out_of_range"
    """Shows a load beyond its range (1: on)."""
    DEAF = "deaf"
    """Ignores its client (1: on)."""
    REBOOTED = "rebooted"
    """Once, as if it were switched off and on."""
    UNPLUGGED = "unplugged"
    """The terminal is removed (1), or there is a new one behind the same link (0)."""


class TerminalServer(ABC):
    """Serial sensor (a `Server`); its rate is one of wall time.

    Attributes:
        name: Name for messages and faults.
        address: Path of the terminal, or of the link to it.
        sent: Frames sent.
        left_out: Frames that were due while this loop stood still.
        unread: Pieces that the terminal did not accept, since the client does not read.
    """

    def __init__(self, name: str, sensor: int, rate: float, link: Path | None) -> None:
        """Open a terminal.

        Args:
            name: For messages and faults.
            sensor: Index of the wrench that it shows in `PlantState.wrenches`.
            rate: Rate of frames [1/s].
            link: Symbolic link to make to the terminal, as udev does for real ones; None: none.

        Raises:
            InvalidValueError: See `Terminal`.
        """
        self.name, self._sensor, self._link = name, sensor, link
        self._rate = positive("rate", rate, "1/s")
        self._switched_on = self._began = monotonic()
        self._slot = 0
        self._streams = False
        self._wrench: tuple[float, ...] = (0.0,) * 6
        self._faults: dict[SerialFault, int] = dict.fromkeys(SerialFault, 0)
        self._terminal: Terminal | None = None
        self.address = ""
        self.sent = 0
        self.left_out = 0
        self.unread = 0
        self._plug_in()

    def status(self) -> Mapping[str, object]:
        """Return its state, for tests."""
        return {"sent": self.sent, "left_out": self.left_out, "unread": self.unread, "streams": self._streams}

    def lines(self) -> list[str]:
        """Return an empty log."""
        return []

    def files(self) -> Sequence[int]:
        """Return the terminal, unless it is unplugged."""
        return () if self._terminal is None else (self._terminal.master,)

    def receive(self, file: int, now: float) -> None:
        """Take the bytes that have arrived."""
        data = b"" if self._terminal is None else self._terminal.read()
        if data and not self._faults[SerialFault.DEAF]:
            self._obey(data, now)

    def due(self) -> float:
        """Return when the next frame is due [s]."""
        if self._terminal is None:
            return math.inf
        return self._began + (self._slot + 1) / self._rate if self._streams else self._idle_due()

    def tick(self, now: float) -> None:
        """Send the frames that are due."""
        if self._terminal is None:
            return
        if not self._streams:
            self._idle(now)
            return
        if now - self.due() > MAX_LATENESS:
            late = int((now - self.due()) * self._rate)
            self._slot += late
            self.left_out += late
        for _ in range(MOST_AT_ONCE):
            due = self.due()
            if due > now:
                return
            self._slot += 1
            self._send_frame(self._frame(due - self._switched_on))

    def take(self, state: PlantState) -> None:
        """Measure the wrench."""
        self._wrench = state.wrenches[self._sensor].wrench

    def inject(self, fault: str, value: float) -> str:
        """Switch a `SerialFault` on or off.

        Raises:
            InvalidValueError: If there is no such fault, or its value is not a whole number from 0 on.
        """
        kind = fault_named(SerialFault, fault)
        self._faults[kind] = whole_number(fault, value)
        if kind is SerialFault.UNPLUGGED:
            self._unplug()
            if not value:
                self._plug_in()
        if kind in (SerialFault.REBOOTED, SerialFault.UNPLUGGED):
            self._switched_on = monotonic()
            self._boot(self._switched_on)
        return f"{self.name}: {kind.value} = {int(value)}"

    def close(self) -> None:
        """Close the terminal and remove the link."""
        self._unplug()

    @abstractmethod
    def _boot(self, now: float) -> None:
        """Begin as after switching on."""

    def _obey(self, data: bytes, now: float) -> None:  # noqa: B027 -- most sensors ignore their clients
        """Carry out the requests of a client."""

    @abstractmethod
    def _frame(self, time: float) -> bytes:
        """Return a frame sampled at this time since switching on [s]."""

    def _idle_due(self) -> float:
        """Return when something is to be sent while it does not stream [s]."""
        return math.inf

    def _idle(self, now: float) -> None:  # noqa: B027 -- most sensors are silent then
        """Send the report that is due while it does not stream."""

    def _stream(self, now: float) -> None:
        self._began, self._slot, self._streams = now, 0, True

    def _shown(self, largest: Sequence[float]) -> tuple[float, ...]:
        """Return the load; with the fault of that name, 1.5 times the range."""
        return tuple(1.5 * most for most in largest) if self._faults[SerialFault.OUT_OF_RANGE] else self._wrench

    def _every(self, fault: SerialFault) -> bool:
        k = self._faults[fault]
        return k > 0 and self._slot % k == 0

    def _send_frame(self, frame: bytes) -> None:
        if self._faults[SerialFault.SILENT] or self._every(SerialFault.DROPPED):
            return
        self.sent += 1
        if self._every(SerialFault.LOST_BYTE):
            lost = self._slot // self._faults[SerialFault.LOST_BYTE] % len(frame)
            frame = frame[:lost] + frame[lost + 1 :]
        if self._every(SerialFault.DAMAGED):
            turned = bytearray(frame)
            bit = self._slot // self._faults[SerialFault.DAMAGED] % (8 * len(frame))
            turned[bit // 8] ^= 1 << bit % 8
            frame = bytes(turned)
        if self._every(SerialFault.NOISE):
            frame = NOISE + frame
        size = self._faults[SerialFault.PIECES] or len(frame)
        for at in range(0, len(frame), size):
            self._write(frame[at : at + size])

    def _write(self, data: bytes) -> None:
        terminal = self._terminal
        if terminal is not None:
            before = terminal.lost
            terminal.write(data)
            self.unread += terminal.lost > before

    def _plug_in(self) -> None:
        self._terminal = Terminal(self._link)
        self.address = self._terminal.path

    def _unplug(self) -> None:
        if self._terminal is not None:
            self._terminal.close()
            self._terminal = None


class BotaServer(TerminalServer):
    """Bota sensor: reports that it has booted until a dialogue sets it up, then streams frames.

    The only setting with an effect is the sinc length, which sets the rate.
    """

    def __init__(
        self,
        sensor: int = 0,
        *,
        ranges: Wrench = (12.0, 12.0, 17.0, 0.12, 0.12, 0.12),
        link: Path | None = None,
    ) -> None:
        """Open a terminal and wait to be set up; `ranges` [N, N m] are the sensor's."""
        self._ranges = ranges
        self._configures = False
        self._next_report = 0.0
        self._received = bytearray()
        super().__init__(f"Bota sensor {sensor}", sensor, 1.0 / (SINC_TIME * SINC_LENGTHS[1]), link)
        self._boot(self._switched_on)

    def _boot(self, now: float) -> None:
        self._streams = self._configures = False
        self._received.clear()
        self._next_report = now

    def _idle_due(self) -> float:
        return math.inf if self._configures else self._next_report

    def _idle(self, now: float) -> None:
        if not self._faults[SerialFault.SILENT]:
            self._write(BOOTED + b"\r\n")
        self._next_report = now + BOOT_PERIOD

    def _obey(self, data: bytes, now: float) -> None:
        """Reply to each request once it is complete; other bytes are skipped one by one."""
        received = self._received
        received += data
        while received:
            question = _QUESTION.match(bytes(received))  # a copy: groups are cut out later
            if question:
                del received[: question.end()]
                self._reply(question, now)
            elif _may_become_one(received):
                return
            else:
                del received[:1]

    def _reply(self, question: "re.Match[bytes]", now: float) -> None:
        letter = question[0][:1]
        if letter == b"C":
            self._streams, self._configures = False, True
        elif not self._configures:
            return  # it ignores anything else while it streams
        elif letter == b"f":
            length = int(question[6])
            if not SINC_LENGTHS[0] <= length <= SINC_LENGTHS[1]:
                self._write(b"r,1,f,0")
                return
            self._rate = 1.0 / (SINC_TIME * length)
        if not self._faults[SerialFault.SILENT]:
            self._write(b"r,0," + letter + b",0")
        if letter == b"R":
            self._configures = False
            self._stream(now)

    def _frame(self, time: float) -> bytes:
        load = self._shown(self._ranges)
        beyond = any(abs(value) > most for value, most in zip(load, self._ranges, strict=True))
        data = DATA.pack(_OUT_OF_RANGE if beyond else 0, *load, int(1e6 * time) % 2**32, TEMPERATURE)
        return bytes((HEADER,)) + data + CHECKSUM.pack(crc16_x25(data))


def _may_become_one(received: bytearray) -> bool:
    """Return whether it is the beginning of a request with several numbers."""
    return len(received) <= LONGEST and re.fullmatch(rb"[cf](,[0-9]{0,4}){0,4}", received) is not None


class ResenseServer(TerminalServer):
    """Resense HEX: frames of seven numbers, from the moment it is switched on. It ignores its client."""

    def __init__(
        self,
        sensor: int = 0,
        *,
        rate: float = 1000.0,
        ranges: Wrench = (12.0, 12.0, 17.0, 0.12, 0.12, 0.12),
        temperature: float = 27.0,
        link: Path | None = None,
    ) -> None:
        """Open a terminal and stream; `ranges` [N, N m] and `temperature` [deg C] are the sensor's."""
        self._ranges = ranges
        self._temperature = temperature
        super().__init__(f"Resense sensor {sensor}", sensor, rate, link)
        self._boot(self._switched_on)

    def _boot(self, now: float) -> None:
        self._stream(now)

    def _frame(self, time: float) -> bytes:
        load = self._shown(self._ranges)
        return FRAME.pack(*load[:3], *(value / MOMENT_UNIT for value in load[3:]), self._temperature)
