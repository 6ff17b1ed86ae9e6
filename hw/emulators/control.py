"""The control socket of an emulator, for tests: one line of JSON per request and reply, loopback only."""

import contextlib
import json
import socket
from collections.abc import Callable, Mapping, Sequence

from palpate.errors import InvalidValueError

LOOPBACK = "127.0.0.1"

_LONGEST_LINE = 65536
_TIMEOUT = 5.0
"""[s] within which a host replies, even on a busy machine."""

Handler = Callable[[Mapping[str, object]], Mapping[str, object]]


class ControlSocket:
    """The host's end."""

    def __init__(self, handler: Handler, port: int = 0) -> None:
        """Listen.

        Args:
            handler: Carries out a request; its `InvalidValueError` is sent back to the client.
            port: On which; 0: a free one.

        Raises:
            InvalidValueError: The port is not free.
        """
        self._handler = handler
        try:
            self._listener = socket.create_server((LOOPBACK, port))
        except OSError as error:
            raise InvalidValueError(
                f"control_port = {port}: cannot listen there ({error.strerror}); take another, or 0 for a free one"
            ) from None
        self._listener.setblocking(False)
        self._lines: dict[int, bytes] = {}
        self._sockets: dict[int, socket.socket] = {}

    @property
    def port(self) -> int:
        """Where it listens."""
        port: int = self._listener.getsockname()[1]
        return port

    def files(self) -> Sequence[int]:
        """Return the descriptors to wait for."""
        return [self._listener.fileno(), *self._sockets]

    def receive(self, file: int) -> None:
        """Accept a client, or reply to one."""
        if file == self._listener.fileno():
            with contextlib.suppress(OSError):
                accepted, _ = self._listener.accept()
                accepted.settimeout(_TIMEOUT)
                self._sockets[accepted.fileno()], self._lines[accepted.fileno()] = accepted, b""
            return
        if file not in self._sockets:
            return
        try:
            data = self._sockets[file].recv(_LONGEST_LINE)
            *lines, rest = (self._lines[file] + data).split(b"\n")
            for line in lines:
                self._sockets[file].sendall(self._said(line))
        except OSError:
            data, rest = b"", b""
        if not data or len(rest) > _LONGEST_LINE:
            self._sockets.pop(file).close()
            self._lines.pop(file)
        else:
            self._lines[file] = rest

    def close(self) -> None:
        """Close everything."""
        for one in self._sockets.values():
            one.close()
        self._sockets.clear()
        self._listener.close()

    def _said(self, line: bytes) -> bytes:
        try:
            request = json.loads(line)
            if not isinstance(request, dict):
                raise InvalidValueError(f"request = {request!r}: must be an object")
            reply = self._handler(request)
        except (ValueError, RecursionError) as error:
            reply = {"error": str(error)}
        return json.dumps(reply).encode() + b"\n"


class EmulatorControl:
    """The test's end."""

    def __init__(self, port: int) -> None:
        """Connect to a host's control socket."""
        self._socket = socket.create_connection((LOOPBACK, port), timeout=_TIMEOUT)
        self._file = self._socket.makefile("rb")

    def ask(self, **request: object) -> dict[str, object]:
        """Ask for something and return the reply.

        Raises:
            InvalidValueError: The host says that it makes no sense.
            OSError: It is gone, or does not reply within 5 s.
        """
        self._socket.sendall(json.dumps(request).encode() + b"\n")
        line = self._file.readline()
        if not line:
            raise ConnectionResetError("the emulator's host is gone: start it again")
        reply: dict[str, object] = json.loads(line)
        if "error" in reply:
            raise InvalidValueError(str(reply["error"]))
        return reply

    def fault(self, device: str, fault: str, value: float = 1.0) -> str:
        """Switch a fault of a device and return what was done."""
        return str(self.ask(do="fault", device=device, fault=fault, value=value)["done"])

    def state(self) -> dict[str, object]:
        """Return what plant and devices are like."""
        return self.ask(do="state")

    def log(self, device: str) -> list[str]:
        """Return what has happened in a device, oldest first."""
        lines = self.ask(do="log", device=device)["lines"]
        return [str(line) for line in lines] if isinstance(lines, list) else []

    def close(self) -> None:
        """Hang up."""
        self._file.close()
        self._socket.close()
