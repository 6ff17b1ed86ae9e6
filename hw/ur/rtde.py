"""Connections of our own to a UR controller over RTDE: its version, and an echo that proves the age of its states.

The client library waits for seconds, with Python's lock held, for a controller that is absent or too old;
`controller_version` reports it at once. The library cannot read an input register back either; `Echo` can.
"""

import random
import socket
import struct
from collections.abc import Iterator
from contextlib import suppress
from time import monotonic

from palpate.hw.devices import DeviceError, WireError
from palpate.hw.round_trip_clock import RoundTrip

Version = tuple[int, int, int, int]
"""Software version of a controller: major, minor, bug fix, build."""

OLDEST = {3: (3, 15, 0, 0), 5: (5, 10, 0, 0), 10: (10, 10, 0, 0)}
"""Oldest supported version by its major number: 3.15 is the last CB3 branch; 5.10 is the oldest that is tested;
the script port that the library uses on PolyScope X begins with 10.10."""

DASHBOARD_BELOW = 10
"""Major version from which there is no dashboard server."""

RTDE_PORT = 30004
"""Fixed by the controller, and in the client library."""

DASHBOARD_PORT = 29999
"""Fixed by the controller, and in the client library."""

REGISTER = "input_int_register_47"
"""Register of the echo: the last of those that the maker's RTDE guide leaves to external clients. ur_rtde uses
those up to 23."""

PERIOD = 7.3e-3
"""[s] between two numbers: no multiple of a controller's cycle, so that some arrive just before one begins."""

REMEMBERED = 1024
"""Numbers that may be under way: 7 s. States of that age have long been refused."""

HEADER = struct.Struct(">HB")

_GREETING_BYTES = 256
"""Limit of a dashboard greeting; it has 43."""

_REPLY_WITHIN = 2.0
"""[s] for each step of the conversation that opens the echo."""

_INTEGERS = 1 << 31

_PROTOCOL, _CONTROLLER_VERSION, _TEXT, _OUTPUTS, _INPUTS, _START, _DATA = b"VvMOISU"
_STATE = struct.Struct(">Bdi")
_NUMBER = struct.Struct(">HBBi")


def cycle_rate(version: Version) -> float:
    """Return the controller's cycles per second: 125 for CB3, 500 for e-Series and later [Hz]."""
    return 125.0 if version[0] <= 3 else 500.0


def has_flange_sensor(version: Version) -> bool:
    """Return whether the arm measures the TCP force with a sensor in its flange: e-Series and later.

    A CB3 infers the force from motor currents, which cannot serve to check a fingertip's sensor.
    """
    return version[0] >= 5


def controller_version(device: str, address: str, timeout: float = 2.0) -> Version:
    """Return the version that a controller reports.

    Args:
        device: Name of the device for messages.
        address: Host name or IP address of the controller.
        timeout: Limit for the whole greeting [s], even if it arrives byte by byte.

    Raises:
        DeviceError: If there is no reply, no such controller, or its version is too old.
    """
    deadline = monotonic() + timeout
    try:
        with socket.create_connection((address, RTDE_PORT), timeout) as stream:
            if _ask(stream, _PROTOCOL, struct.pack(">H", 2), deadline)[:1] != b"\x01":
                raise DeviceError(
                    device, "it does not speak RTDE version 2", f"update PolyScope to {_supported()} or newer"
                )
            major, minor, bug_fix, build = struct.unpack(">4I", _ask(stream, _CONTROLLER_VERSION, b"", deadline))
    except DeviceError:
        raise
    except (OSError, struct.error, ValueError) as error:
        raise WireError(
            device,
            f"no controller replies on port {RTDE_PORT} ({error})",
            "check its address, that it is switched on and started, and that no firewall is in between",
        ) from error
    version = (major, minor, bug_fix, build)
    if major not in OLDEST or version < OLDEST[major]:
        shown = ".".join(map(str, version))
        raise DeviceError(
            device, f"version {shown} is not supported", f"update PolyScope to {_supported()} or newer"
        )
    return version


def dashboard_greeting(address: str, timeout: float = 2.0) -> str:
    """Return the line with which the dashboard server greets a client.

    Args:
        address: Host name or IP address of the controller.
        timeout: Limit for the whole line [s].

    Raises:
        OSError: If the line is not complete in time; the message has the part that arrived.
    """
    deadline, line = monotonic() + timeout, b""
    with socket.create_connection((address, DASHBOARD_PORT), timeout) as stream:
        while not line.endswith(b"\n") and len(line) < _GREETING_BYTES:
            stream.settimeout(max(1e-3, deadline - monotonic()))
            try:
                part = stream.recv(_GREETING_BYTES - len(line))
            except TimeoutError:
                part = b""
            if not part:
                raise TimeoutError(f"no greeting within {timeout:g} s, received {line!r}")
            line += part
    return line.decode(errors="replace").strip()


class Echo:
    """Connection that proves how old states are. For one thread, which never waits after the beginning.

    It writes a number into an input register, and receives that register with the controller's time stamp, cycle
    by cycle. The proof holds for states that come by other connections, since they carry the same time stamps
    (`RoundTripClock`).
    """

    def __init__(self, address: str, rate: float) -> None:
        """Connect and start the stream.

        Args:
            address: Host name or IP address of the controller.
            rate: States per second of the controller's time [Hz].

        Raises:
            OSError: If the controller cannot be reached, or refuses the register.
        """
        self._stream = socket.create_connection((address, RTDE_PORT), _REPLY_WITHIN)
        try:
            self._stream.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            outputs = struct.pack(">d", rate) + f"timestamp,{REGISTER}".encode()
            self._request(_PROTOCOL, struct.pack(">H", 2))
            self._request(_OUTPUTS, outputs)
            self._recipe = self._request(_INPUTS, REGISTER.encode())
            self._request(_START, b"")
        except BaseException:
            self._stream.close()
            raise
        self._stream.setblocking(False)
        self.connected = True
        self._rest = b""
        # the register may still hold a number of an earlier program: ours begin elsewhere
        self._number, self._echoed = random.getrandbits(30), -1
        self._sent: dict[int, float] = {}
        self._next = 0.0

    def exchange(self, now: float) -> list[RoundTrip]:
        """Send a number if one is due, and return what the echoes since the last call prove, oldest first."""
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

    def _request(self, kind: int, payload: bytes) -> int:
        """Return the first byte of the reply, which says what was granted.

        Raises:
            ConnectionError: If nothing was granted.
        """
        reply = _ask(self._stream, kind, payload, monotonic() + _REPLY_WITHIN)
        if not reply[0]:
            why = reply[1:].decode(errors="replace")
            raise ConnectionError(
                f"the controller refuses the echo in {REGISTER} ({why}): end the other program that writes it"
            )
        return reply[0]

    def _send(self, now: float) -> None:
        self._number = (self._number + 1) % _INTEGERS
        with suppress(BlockingIOError):  # the controller does not read: no echo, no young state
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


def _supported() -> str:
    return ", ".join(f"{v[0]}.{v[1]}" for v in OLDEST.values())


def _ask(stream: socket.socket, kind: int, payload: bytes, deadline: float) -> bytes:
    """Send a package, and return the payload of the reply of its type.

    Raises:
        OSError: If there is no reply by the deadline, or the controller refuses.
        ValueError: If the reply is not one of RTDE.
    """
    stream.sendall(HEADER.pack(HEADER.size + len(payload), kind) + payload)
    size, got = HEADER.unpack(_exactly(stream, HEADER.size, deadline))
    if got not in (kind, _TEXT) or not HEADER.size < size < 256:
        raise ValueError(f"no reply of RTDE: type {got}, {size} bytes")
    reply = _exactly(stream, size - HEADER.size, deadline)
    if got == _TEXT:  # length, text, and its source: a controller that refuses gives the reason
        raise ConnectionError(reply[1 : 1 + reply[0]].decode(errors="replace"))
    return reply


def _exactly(stream: socket.socket, count: int, deadline: float) -> bytes:
    data = b""
    while len(data) < count:
        if (left := deadline - monotonic()) <= 0.0:
            raise TimeoutError(f"its greeting took too long, received {data!r}")
        stream.settimeout(left)
        try:
            part = stream.recv(count - len(data))
        except TimeoutError:
            continue
        if not part:
            raise ConnectionError("it closed the connection")
        data += part
    return data
