"""A register that the controller sends back: what proves how old its states are.

A connection of its own writes a number into an input register, and receives that register with the controller's
time stamp, cycle by cycle. The client library cannot read the register back. The proof holds for states that come
by other connections, since they carry the same time stamps (`RoundTripClock`).
"""

import random
import socket
import struct
from collections.abc import Iterator
from contextlib import suppress
from time import monotonic

from palpate.hw.round_trip_clock import RoundTrip
from palpate.hw.ur.hello import HEADER, RTDE_PORT, rtde_reply

REGISTER = "input_int_register_47"
"""The last of those that the maker's RTDE guide leaves to external clients; ur_rtde uses those up to 23."""

PERIOD = 7.3e-3
"""[s] from number to number: no multiple of a controller's cycle, so that some arrive just before one begins."""

REMEMBERED = 1024
"""Numbers that may be under way: 7 s. States as old as that have long been refused."""

_REPLY_WITHIN = 2.0
"""[s] for each step of the conversation at the beginning."""

_INTEGERS = 1 << 31

_PROTOCOL, _OUTPUTS, _INPUTS, _START, _DATA = b"VOISU"
_STATE = struct.Struct(">Bdi")
_NUMBER = struct.Struct(">HBBi")


class Echo:
    """The connection; for one thread, which never waits after the beginning."""

    def __init__(self, address: str, rate: float) -> None:
        """Connect, and let states stream.

        Args:
            address: Of the controller.
            rate: States per second of the controller's time [Hz].

        Raises:
            OSError: It cannot be reached, or does not let us have the register.
        """
        self._stream = socket.create_connection((address, RTDE_PORT), _REPLY_WITHIN)
        try:
            self._stream.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            outputs = struct.pack(">d", rate) + f"timestamp,{REGISTER}".encode()
            self._ask(_PROTOCOL, struct.pack(">H", 2))
            self._ask(_OUTPUTS, outputs)
            self._recipe = self._ask(_INPUTS, REGISTER.encode())
            self._ask(_START, b"")
        except BaseException:
            self._stream.close()
            raise
        self._stream.setblocking(False)
        self.connected = True
        self._rest = b""
        # the register may still hold a number of a program before this one: ours are others
        self._number, self._echoed = random.getrandbits(30), -1
        self._sent: dict[int, float] = {}
        self._next = 0.0

    def exchange(self, now: float) -> list[RoundTrip]:
        """Send a number if it is time to, and return what the echoes since the last call prove, oldest first."""
        try:
            if now >= self._next:
                self._send(now)
            with suppress(BlockingIOError):
                data = self._stream.recv(1 << 16)
                self.connected = bool(data)
                self._rest += data
        except OSError:
            self.connected = False
        return list(self._trips(monotonic()))

    def _ask(self, kind: int, payload: bytes) -> int:
        """Return the first byte of the reply, which says what was granted.

        Raises:
            ConnectionError: Nothing was.
        """
        self._stream.sendall(HEADER.pack(HEADER.size + len(payload), kind) + payload)
        reply = rtde_reply(self._stream, kind, monotonic() + _REPLY_WITHIN)
        if not reply[0]:
            why = reply[1:].decode(errors="replace")
            raise ConnectionError(
                f"the controller refuses the echo in {REGISTER} ({why}): end the other program that writes it"
            )
        return reply[0]

    def _send(self, now: float) -> None:
        self._number = (self._number + 1) % _INTEGERS
        with suppress(BlockingIOError):  # it does not read: no echo, no young state
            self._stream.send(_NUMBER.pack(_NUMBER.size, _DATA, self._recipe, self._number))
            self._sent[self._number] = now
            self._next = now + PERIOD
        if len(self._sent) > REMEMBERED:
            del self._sent[next(iter(self._sent))]

    def _trips(self, seen: float) -> Iterator[RoundTrip]:
        rest, at = self._rest, 0
        while len(rest) - at >= HEADER.size:
            size, kind = HEADER.unpack_from(rest, at)
            if size < HEADER.size:
                self.connected = False
                break
            if len(rest) - at < size:
                break
            if kind == _DATA and size == HEADER.size + _STATE.size:
                _, count, number = _STATE.unpack_from(rest, at + HEADER.size)
                sent = self._sent.get(number)
                if number != self._echoed and sent is not None:
                    self._echoed = number
                    yield RoundTrip(count, sent, seen)
            at += size
        self._rest = rest[at:]
