"""Requests and replies on a servo bus, each with its outcome."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from dynamixel_sdk import COMM_RX_TIMEOUT, COMM_SUCCESS

from palpate.hw.devices import DeviceError, WireError
from palpate.hw.dynamixel.packets import ALERT, DynamixelRefusal
from palpate.hw.dynamixel.port import Packets, Port
from palpate.hw.dynamixel.registers import MODEL_NUMBER, Register

SET_UP_TIME = 0.03
"""How long a reply may take to begin outside of the loop [s]."""

QUIET = 1.5e-3
"""Silence on the bus after which no reply is taken to be still arriving [s]: a USB frame and a half."""

LONGEST_DRAIN = 0.01
"""For how long bytes that keep arriving are discarded [s]."""

PING_LENGTH = 3
"""Of a ping's reply [bytes]: model number and firmware. No other reply expected here has this length."""

TRIES = 4
"""How often a request is repeated before a servo is given up: while setting up, never in the loop."""


class MissedError(Exception):
    """No valid reply from one servo; the next exchange may succeed."""

    def __init__(self, servo_id: int, silent: bool) -> None:
        """Take the servo that failed, and whether nothing arrived at all."""
        super().__init__(f"servo {servo_id} {'does not reply' if silent else 'sends damaged replies'}")
        self.servo_id, self.silent = servo_id, silent


@dataclass(frozen=True, slots=True)
class RegisterSpan:
    """Bytes of one servo's control table.

    Attributes:
        servo_id: Whose.
        address: Of the first.
        length: How many.
    """

    servo_id: int
    address: int
    length: int


class Bus:
    """Servos on one port, for one thread. All of it may raise `DeviceError`: the port is lost."""

    def __init__(self, port: Port, reply_timeout: float) -> None:
        """Take a port that is open, and how long a reply may take to begin within the loop [s]."""
        self._port, self._packets, self._reply_timeout = port, Packets(), reply_timeout

    def ping(self, servo_id: int) -> int | None:
        """Return the model number of a servo; None if it does not reply."""
        for _ in range(TRIES):
            self._ready(SET_UP_TIME)
            # not the library's: it takes any reply of this servo, even a late one, for the reply to a ping
            if self._packets.pingTx(self._port, servo_id) == COMM_SUCCESS:
                data, result, _ = self._packets.readRx(self._port, servo_id, PING_LENGTH)
                if result == COMM_SUCCESS and data:
                    return MODEL_NUMBER.value(bytes(data[: MODEL_NUMBER.size]))
            self._settle(SET_UP_TIME)
        return None

    def exchange(self, spans: Sequence[RegisterSpan]) -> list[bytes]:
        """Read from several servos in one transaction.

        Raises:
            MissedError: One sent no valid reply; those of the others are discarded.
        """
        port, packets = self._port, self._packets
        parameters: list[int] = []
        for span in spans:
            address, length = span.address, span.length
            parameters += (span.servo_id, address & 0xFF, address >> 8, length & 0xFF, length >> 8)
        self._ready(self._reply_timeout)
        result = packets.bulkReadTx(port, parameters, len(parameters), False)
        found = []
        for span in spans:
            data: list[int] = []
            error = 0
            if result == COMM_SUCCESS:
                data, result, error = packets.readRx(port, span.servo_id, span.length)
            if result != COMM_SUCCESS or error & ~ALERT:
                self._settle(QUIET)
                raise MissedError(span.servo_id, silent=result == COMM_RX_TIMEOUT)
            found.append(bytes(data))
        return found

    def read(self, servo_id: int, register: Register) -> int:
        """Return one value, repeating the request if need be.

        Raises:
            DeviceError: The servo does not reply, or refuses.
        """
        return register.value(self.read_bytes(RegisterSpan(servo_id, register.address, register.size)))

    def read_bytes(self, span: RegisterSpan) -> bytes:
        """Return bytes of one servo, repeating the request if need be.

        Raises:
            DeviceError: The servo does not reply, or refuses.
        """
        port, packets = self._port, self._packets
        result = COMM_RX_TIMEOUT
        for _ in range(TRIES):
            self._ready(SET_UP_TIME)
            result = packets.readTx(port, span.servo_id, span.address, span.length)
            if result == COMM_SUCCESS:
                data, result, error = packets.readRx(port, span.servo_id, span.length)
                if result == COMM_SUCCESS and error & ~ALERT:
                    raise self._refused(span.servo_id, f"reading address {span.address}", error)
                if result == COMM_SUCCESS:
                    return bytes(data)
            self._settle(SET_UP_TIME)
        raise WireError(
            port.device,
            str(MissedError(span.servo_id, result == COMM_RX_TIMEOUT)),
            "check its cable and its power",
        )

    def write(self, servo_id: int, register: Register, value: int) -> None:
        """Write one value and read it back: a damaged reply leaves open whether the write was received.

        Raises:
            DeviceError: The servo does not reply, or does not take the value.
        """
        self.write_bytes(servo_id, register.address, register.bytes_of(value))

    def write_bytes(self, servo_id: int, address: int, data: bytes) -> None:
        """Write bytes of one servo and read them back.

        Raises:
            DeviceError: The servo does not reply, or does not take them.
        """
        port, error, kept = self._port, 0, b""
        for _ in range(TRIES):
            self._ready(SET_UP_TIME)
            result, error = self._packets.writeTxRx(port, servo_id, address, len(data), list(data))
            if result != COMM_SUCCESS:
                self._settle(SET_UP_TIME)
            kept = self.read_bytes(RegisterSpan(servo_id, address, len(data)))
            if kept == data:
                return
        if error & ~ALERT:
            raise self._refused(servo_id, f"writing {list(data)} to address {address}", error)
        raise DeviceError(
            port.device,
            f"servo {servo_id} keeps {list(kept)} at address {address} instead of {list(data)}",
            "check that no other program uses the bus",
        )

    def write_together(self, first: Register, data: Mapping[int, bytes]) -> None:
        """Write as many bytes to each of several servos from one register on; there is no reply."""
        port = self._port
        length = len(next(iter(data.values())))
        parameters = [byte for servo_id, its in data.items() for byte in (servo_id, *its)]
        self._ready(self._reply_timeout)
        self._packets.syncWriteTxOnly(port, first.address, length, parameters, len(parameters))

    def reboot(self, servo_id: int) -> None:
        """Reboot a servo. Whether it received this, later requests show."""
        self._ready(SET_UP_TIME)
        self._packets.reboot(self._port, servo_id)

    def close(self) -> None:
        """Close the port."""
        self._port.closePort()

    def _ready(self, reply_timeout: float) -> None:
        self._port.is_using = False  # an exception may have left it set
        self._port.reply_timeout = reply_timeout

    def _settle(self, quiet: float) -> None:
        """Read and discard what is still arriving."""
        self._port.is_using = False
        self._port.drain(quiet, LONGEST_DRAIN + quiet)

    def _refused(self, servo_id: int, what: str, error: int) -> DeviceError:
        code = error & ~ALERT
        reason = DynamixelRefusal(code).name.lower() if code in set(DynamixelRefusal) else str(code)
        return DeviceError(
            self._port.device,
            f"servo {servo_id} refuses {what} ({reason} error)",
            "check its model and firmware against its e-manual",
        )
