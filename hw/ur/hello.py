"""The controller's version, asked over RTDE before the client library is let loose.

The library waits for seconds, with Python's lock held, for a controller that is not there or too old; this says it
at once.
"""

import socket
import struct
from time import monotonic

from palpate.hw.devices import DeviceError, WireError
from palpate.hw.ur.version import OLDEST, Version

RTDE_PORT = 30004
"""Fixed by the controller, and in the client library."""

DASHBOARD_PORT = 29999
"""Likewise."""

_LONGEST_GREETING = 256
"""Bytes; it has 43."""

HEADER = struct.Struct(">HB")
_WANT_PROTOCOL, _WANT_VERSION, _TEXT = ord("V"), ord("v"), ord("M")


def controller_version(device: str, address: str, timeout: float = 2.0) -> Version:
    """Ask for the version.

    Args:
        device: Name for messages.
        address: Of the controller.
        timeout: For all of the greeting [s]; what trickles in byte by byte has no more time.

    Returns:
        Major, minor, bug fix, build.

    Raises:
        DeviceError: There is no reply, it is no such controller, or too old.
    """
    try:
        deadline = monotonic() + timeout
        with socket.create_connection((address, RTDE_PORT), timeout) as stream:
            stream.sendall(HEADER.pack(5, _WANT_PROTOCOL) + struct.pack(">H", 2))
            if rtde_reply(stream, _WANT_PROTOCOL, deadline)[:1] != b"\x01":
                raise DeviceError(
                    device, "it does not speak RTDE version 2", f"update PolyScope to {_wanted()} or newer"
                )
            stream.sendall(HEADER.pack(3, _WANT_VERSION))
            major, minor, bug_fix, build = struct.unpack(">4I", rtde_reply(stream, _WANT_VERSION, deadline))
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
        raise DeviceError(device, f"version {shown} is not supported", f"update PolyScope to {_wanted()} or newer")
    return version


def dashboard_greeting(address: str, timeout: float = 2.0) -> str:
    """Return the line with which the dashboard server greets whoever connects.

    Args:
        address: Of the controller.
        timeout: For all of it [s].

    Raises:
        OSError: It does not come in time; the message has what came.
    """
    deadline, line = monotonic() + timeout, b""
    with socket.create_connection((address, DASHBOARD_PORT), timeout) as stream:
        while not line.endswith(b"\n") and len(line) < _LONGEST_GREETING:
            stream.settimeout(max(1e-3, deadline - monotonic()))
            try:
                part = stream.recv(_LONGEST_GREETING - len(line))
            except TimeoutError:
                part = b""
            if not part:
                raise TimeoutError(f"no greeting within {timeout:g} s, received {line!r}")
            line += part
    return line.decode(errors="replace").strip()


def _wanted() -> str:
    return ", ".join(f"{v[0]}.{v[1]}" for v in OLDEST.values())


def rtde_reply(stream: socket.socket, kind: int, deadline: float) -> bytes:
    """Return the payload of the reply to a package of this type.

    Raises:
        OSError: There is none by the deadline, or the controller refuses.
        ValueError: It is no reply of RTDE.
    """
    size, got = HEADER.unpack(_exactly(stream, HEADER.size, deadline))
    if got not in (kind, _TEXT) or not HEADER.size < size < 256:
        raise ValueError(f"no reply of RTDE: type {got}, {size} bytes")
    payload = _exactly(stream, size - HEADER.size, deadline)
    if got == _TEXT:  # length, text, and who sent it: a controller that refuses says why
        raise ConnectionError(payload[1 : 1 + payload[0]].decode(errors="replace"))
    return payload


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
