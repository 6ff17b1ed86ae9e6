"""The maker's library with its faults taken out: a port that cannot get stuck, packets that are stuffed rightly.

Of dynamixel_sdk 4.1.0, `PortHandler` takes the time of day for its time-outs, waits 34 ms for a servo that is
silent, spins on one core while it waits, waits for ever on a bus that babbles, and says "port in use" after any
exception. `Protocol2PacketHandler` forgets the stuffing it has put into a packet, takes out too much of what it
receives, and takes a reply that comes too late for the next one.
"""

import contextlib
import os
import select
import time
from pathlib import Path
from typing import Any

import serial
from dynamixel_sdk import COMM_SUCCESS, PortHandler, Protocol2PacketHandler

from palpate.hw.devices import DeviceError, WireError
from palpate.hw.dynamixel.packets import OVERHEAD, Instruction, checksum, stuffed, unstuffed

_PORT_ERRORS: tuple[type[Exception], ...] = (OSError,)
"""What the system and pyserial raise of a port that is gone."""

with contextlib.suppress(ImportError):  # on Windows, where nobody raises its errors
    import termios

    _PORT_ERRORS = (OSError, termios.error)

_NO_PORT: tuple[type[Exception], ...] = (*_PORT_ERRORS, ValueError)
"""Likewise of a rate that it cannot have, or one that is closed."""

LATEST = 1024
"""How much is still read when the time is over [bytes]: the replies of 40 servos."""

ERROR_AT = 8
"""Place of the error byte in a reply; data follow."""

LOST_REMEDY = "plug the adapter in, then `palpate recover`"
"""What to do about a port that is gone."""

USB_SERIAL = Path("/sys/bus/usb-serial/devices")
"""Where Linux keeps the settings of USB adapters."""


class Port(PortHandler):  # type: ignore[misc]  # the library has no types
    """A serial port to a servo bus, for one thread. Anything wrong with it closes it and raises `DeviceError`."""

    def __init__(self, path: str, device: str, baud_rate: int) -> None:
        """Name it; `open` opens it.

        Args:
            path: Of the terminal.
            device: Whose it is, for messages.
            baud_rate: [1/s].
        """
        super().__init__(path)
        self.device, self.wanted_rate = device, baud_rate
        self.reply_timeout = 0.0
        """How long a reply may take to begin, besides its own length [s]; to be set before every request."""
        self._overtime = 0
        self._problem = "the port is closed"

    def open(self) -> None:
        """Open it for nobody else.

        Raises:
            DeviceError: It is not there, in use, forbidden, or cannot have this rate.
        """
        self.is_using = False
        try:
            opened = self.setBaudRate(self.wanted_rate)
        except _NO_PORT as error:
            raise self._refused(error) from None
        if not opened:
            raise DeviceError(
                self.device,
                f"the library knows no baud rate of {self.wanted_rate}",
                "set servos and hand to 57600, 115200, 1000000, 2000000, 3000000 or 4000000",
            )

    def setupPort(self, cflag_baud: int) -> bool:
        """Open the terminal; called by the library."""
        self.closePort()
        # exclusive: another program on the same bus would take our replies
        self.ser = serial.Serial(self.port_name, self.wanted_rate, timeout=0, exclusive=True)
        self.is_open = True
        self.tx_time_per_byte = 1e4 / self.wanted_rate
        return True

    def closePort(self) -> None:
        """Close it, whatever state it is in."""
        self.is_open = self.is_using = False
        if self.ser is not None:
            with contextlib.suppress(*_PORT_ERRORS):
                self.ser.close()
            self.ser = None

    def getCurrentTime(self) -> float:
        """Return the time [ms], of a clock that nobody sets."""
        return 1e3 * time.monotonic()

    def setPacketTimeout(self, packet_length: int) -> None:
        """Start to wait for so many bytes."""
        self.setPacketTimeoutMillis(self.tx_time_per_byte * packet_length + 1e3 * self.reply_timeout)
        self._overtime = LATEST

    def clearPort(self) -> None:
        """Forget what has arrived."""
        port = self._connected()
        try:
            port.reset_input_buffer()
        except _PORT_ERRORS as error:
            raise self._lost(error) from None

    def writePort(self, packet: list[int]) -> int:
        """Send, and return how many bytes went out: fewer, where the system takes no more."""
        port = self._connected()
        try:
            # not pyserial's: without a time-out it may wait for ever, and with one it fails if only we were asleep
            return os.write(port.fd, bytes(packet))
        except BlockingIOError:
            return 0
        except _PORT_ERRORS as error:
            raise self._lost(error) from None

    def readPort(self, length: int) -> bytes:
        """Return up to so many bytes, at the latest when the time for the packet is over.

        Then only what is there already: it was this process that came late. And not for ever: a bus that babbles
        always has more.
        """
        left = self.packet_timeout - self.getTimeSinceStart()
        if length <= 0 or (left <= 0.0 and self._overtime <= 0):
            return b""
        found = self._read(length, max(0.0, 1e-3 * left))
        if left <= 0.0:
            self._overtime -= len(found)
        return found

    def drain(self, quiet: float, longest: float) -> None:
        """Discard what arrives until the line has been quiet for `quiet` [s], at most for `longest` [s]."""
        end = time.monotonic() + longest
        while time.monotonic() < end and self._read(4096, quiet):
            pass

    def _read(self, length: int, wait: float) -> bytes:
        port = self._connected()
        try:
            ready, _, _ = select.select([port.fd], [], [], wait)
            return bytes(port.read(length)) if ready else b""
        except _NO_PORT as error:
            raise self._lost(error) from None

    def _connected(self) -> Any:
        if self.ser is None:
            raise WireError(self.device, self._problem, LOST_REMEDY)
        return self.ser

    def _lost(self, error: Exception) -> DeviceError:
        self.closePort()
        self._problem = f"the port was lost ({error})"
        return WireError(self.device, self._problem, LOST_REMEDY)

    def _refused(self, error: Exception) -> DeviceError:
        self.closePort()
        if not os.path.exists(self.port_name):
            remedy = "plug the adapter in, or give the path that `ls /dev/serial/by-id` shows"
        elif not os.access(self.port_name, os.R_OK | os.W_OK):
            remedy = "add yourself to the group that owns it (`sudo usermod -a -G dialout $USER`) and log in again"
        elif "lock" in str(error):
            remedy = "end the other program that has it open"
        else:
            remedy = "check that it is the adapter's terminal, and that it can have this baud rate"
        return WireError(self.device, f"the port cannot be opened ({error})", remedy)


class Packets(Protocol2PacketHandler):  # type: ignore[misc]  # the library has no types
    """Instruction packets and replies as the e-manual has them."""

    def updateCRC(self, crc_accum: int, data_blk_ptr: list[int], data_blk_size: int) -> int:
        """Return the checksum; the library builds its table anew at every call."""
        return checksum(data_blk_ptr[:data_blk_size], crc_accum)

    def addStuffing(self, packet: list[int]) -> list[int]:
        """Stuff in place: the library stuffs a copy and sends the original."""
        return self._replace(packet, stuffed(self._content(packet)))

    def removeStuffing(self, packet: list[int]) -> list[int]:
        """Take the stuffing out, in place, and no more than that."""
        return self._replace(packet, unstuffed(self._content(packet)))

    def pingTx(self, port: Port, dxl_id: int) -> int:
        """Send a ping, whose reply `readRx` waits for."""
        result = self.txPacket(port, [0, 0, 0, 0, dxl_id, 3, 0, Instruction.PING, 0, 0])
        if result == COMM_SUCCESS:
            port.setPacketTimeout(14)
        return int(result)

    def readRx(self, port: Port, dxl_id: int, length: int) -> tuple[list[int], int, int]:
        """Wait for a reply of exactly this length; another is a late reply to an earlier request, and ignored.

        Returns:
            Data, result (COMM_SUCCESS or another of the library's), error byte. No data if a servo refuses.
        """
        while True:
            reply, result = self.rxPacket(port, False)
            if result != COMM_SUCCESS:
                return [], result, 0
            if reply[4] != dxl_id:
                continue
            data = reply[ERROR_AT + 1 : OVERHEAD + (reply[5] | reply[6] << 8) - 2]
            if len(data) == length:
                return data, result, reply[ERROR_AT]
            if reply[ERROR_AT] & 0x7F and not data:
                return [], result, reply[ERROR_AT]

    @staticmethod
    def _content(packet: list[int]) -> bytes:
        return bytes(packet[OVERHEAD : OVERHEAD + max(0, (packet[5] | packet[6] << 8) - 2)])

    @staticmethod
    def _replace(packet: list[int], content: bytes) -> list[int]:
        length = len(content) + 2
        packet[OVERHEAD:] = [*content, 0, 0]
        packet[5], packet[6] = length & 0xFF, length >> 8
        return packet


def adapter_latency(path: str, devices: Path = USB_SERIAL) -> tuple[float, Path] | None:
    """Return how long a USB adapter keeps bytes back [s], and the file that sets it; None if it does not tell.

    Args:
        path: Of its terminal, or a link to it.
        devices: Where the system keeps the settings of USB adapters.
    """
    file = devices / Path(path).resolve().name / "latency_timer"
    try:
        return 1e-3 * int(file.read_text()), file
    except (OSError, ValueError):
        return None
