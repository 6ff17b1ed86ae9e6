"""A sensor on a pseudo-terminal that sends frames at fixed deadlines, and what can go wrong with its line."""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from enum import StrEnum
from pathlib import Path
from time import monotonic

from palpate.errors import InvalidValueError, positive
from palpate.hw.emulators.plant import PlantState
from palpate.hw.emulators.terminal import Terminal

LATEST = 0.1
"""Behind its deadlines, after which frames are left out [s]."""

MOST_AT_ONCE = 32
"""Frames in one go."""

NOISE = b"\xaa\x00\x5a"
"""What the fault of that name puts in: a false header among it."""


class SerialFault(StrEnum):
    """A fault; its value in brackets. 0 ends it."""

    SILENT = "silent"
    """Sends nothing (1: on)."""
    LOST_BYTE = "lost_byte"
    """Every k-th frame lacks a byte, another one each time (k)."""
    NOISE = "noise"
    """Before every k-th frame there are bytes of nothing (k)."""
    DAMAGED = "damaged"
    """A bit of every k-th frame is turned over, another one each time (k)."""
    PIECES = "pieces"
    """Frames come in pieces of so many bytes (how many)."""
    DROPPED = "dropped"
    """Every k-th frame is not sent (k)."""
    OUT_OF_RANGE = "out_of_range"
    """Shows a load beyond its range (1: on)."""
    DEAF = "deaf"
    """Sends nothing (1: on)."""
    REBOOTED = "rebooted"
    """Once, as if it was switched off and on."""
    UNPLUGGED = "unplugged"
    """The terminal is gone (1); there again (0), at the same `link` but another path."""


class TerminalServer(ABC):
    """A `Server` for one serial sensor; its rate is one of wall time.

    Attributes:
        sent: Frames.
        left_out: Frames that were due while this loop stood still.
        unread: Pieces that the terminal did not take, since nobody reads.
    """

    def __init__(self, name: str, sensor: int, rate: float, link: Path | None) -> None:
        """Open a terminal.

        Args:
            name: For messages and faults.
            sensor: Whose wrench it shows: index into `PlantState.wrenches`.
            rate: Of frames [1/s].
            link: A symbolic link to make to the terminal, as udev does for real ones; None: none.

        Raises:
            InvalidValueError: As `Terminal`.
        """
        self._name, self._sensor, self._link = name, sensor, link
        self._rate = positive("rate", rate, "1/s")
        self._switched_on = self._began = monotonic()
        self._slot = 0
        self._streams = False
        self._wrench: tuple[float, ...] = (0.0,) * 6
        self._faults: dict[SerialFault, int] = dict.fromkeys(SerialFault, 0)
        self._terminal: Terminal | None = None
        self._address = ""
        self.sent = 0
        self.left_out = 0
        self.unread = 0
        self._plug_in()

    @property
    def name(self) -> str:
        """For messages and faults."""
        return self._name

    @property
    def address(self) -> str:
        """The path of the terminal, or of the link to it."""
        return self._address

    def status(self) -> Mapping[str, object]:
        """Return what goes on, for tests."""
        return {"sent": self.sent, "left_out": self.left_out, "unread": self.unread, "streams": self._streams}

    def lines(self) -> list[str]:
        """Return nothing: it hears nothing that is worth a line."""
        return []

    def files(self) -> Sequence[int]:
        """Return the terminal, unless it is unplugged."""
        return () if self._terminal is None else (self._terminal.master,)

    def receive(self, file: int, now: float) -> None:
        """Hear what the client says."""
        data = b"" if self._terminal is None else self._terminal.read()
        if data and not self._faults[SerialFault.DEAF]:
            self._hear(data, now)

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
        if now - self.due() > LATEST:
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
            InvalidValueError: It is unknown, or its value is not a whole number from 0 on.
        """
        try:
            kind = SerialFault(fault)
        except ValueError:
            known = ", ".join(f"{one.value!r}" for one in SerialFault)
            raise InvalidValueError(f"fault {fault!r} is unknown: must be one of {known}") from None
        if not 0 <= value < 2**31 or value != int(value):
            raise InvalidValueError(f"fault {fault!r} = {value!r}: must be a whole number, 0 or above")
        self._faults[kind] = int(value)
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
        """Be as after switching on."""

    @abstractmethod
    def _hear(self, data: bytes, now: float) -> None:
        """Do what a client says."""

    @abstractmethod
    def _frame(self, time: float) -> bytes:
        """Return a frame sampled at this time since switching on [s]."""

    @abstractmethod
    def _idle_due(self) -> float:
        """Return when something is to be sent while it does not stream [s]."""

    @abstractmethod
    def _idle(self, now: float) -> None:
        """Say what is due while it does not stream."""

    def _stream(self, now: float) -> None:
        self._began, self._slot, self._streams = now, 0, True

    def _shown(self, largest: Sequence[float]) -> tuple[float, ...]:
        """Return the load, or the fault's: half as much again as the range."""
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
        self._address = self._terminal.path

    def _unplug(self) -> None:
        if self._terminal is not None:
            self._terminal.close()
            self._terminal = None
