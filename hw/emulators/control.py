"""The socket through which a test asks and does what no device offers: JSON, one line each way, loopback only.

Every request carries the token that the emulator printed. A browser's POST arrives here, too, from whatever page:
its first line is no such request, and the connection ends with it.
"""

import contextlib
import json
import logging
import socket
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from palpate.access_token import is_token, new_token
from palpate.errors import InvalidValueError
from palpate.hw.emulators.connection import Connection

LOOPBACK = "127.0.0.1"

MOST_CLIENTS = 16
"""Connections; a test has one or two. `select` takes 1024 descriptors, of all devices together."""

TOKEN_FOLLOWS = "?token="
"""After the port, in the address of a control socket."""

_LONGEST_LINE = 65536
_TIMEOUT = 5.0
"""[s] within which a host responds, even one that is held up by a busy machine."""

_log = logging.getLogger("palpate")

Perform = Callable[[Mapping[str, object]], Mapping[str, object]]


class _NoTokenError(Exception):
    """Whoever asks may not."""


@dataclass(slots=True, eq=False)
class _Client:
    connection: Connection
    line: bytes = b""
    admitted: bool = False


class ControlSocket:
    """The host's end.

    Attributes:
        token: What every request must carry.
        refused: Requests without it, and connections that were one too many.
    """

    def __init__(self, perform: Perform, port: int = 0, token: str | None = None) -> None:
        """Listen.

        Args:
            perform: Does what a request asks for; an `InvalidValueError` is the reply.
            port: On which; 0: a free one.
            token: What every request must carry; None: a new one.

        Raises:
            InvalidValueError: The port is not free.
        """
        self._perform, self.refused = perform, 0
        self.token = new_token() if token is None else token
        try:
            self._listener = socket.create_server((LOOPBACK, port))
        except OSError as error:
            raise InvalidValueError(
                f"control_port = {port}: cannot listen there ({error.strerror}); take another, or 0 for a free one"
            ) from None
        self._listener.setblocking(False)
        self._clients: dict[int, _Client] = {}

    @property
    def port(self) -> int:
        """Where it listens."""
        port: int = self._listener.getsockname()[1]
        return port

    @property
    def address(self) -> str:
        """Port and token, as `EmulatorControl` takes them; whoever has it may switch faults."""
        return f"{self.port}{TOKEN_FOLLOWS}{self.token}"

    def files(self) -> Sequence[int]:
        """Return the descriptors to wait for."""
        return [self._listener.fileno(), *self._clients]

    def receive(self, file: int) -> None:
        """Accept a connection, or respond to what a client asks."""
        if file == self._listener.fileno():
            self._accept()
        elif file in self._clients:
            client = self._clients[file]
            data = client.connection.read()
            if data is None or not self._respond(client, data):
                self._drop(file)

    def flush(self) -> None:
        """Send on what clients have not taken yet."""
        for file, client in list(self._clients.items()):
            if not client.connection.send():
                self._drop(file)

    def close(self) -> None:
        """Close everything."""
        for file in list(self._clients):
            self._drop(file)
        self._listener.close()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            accepted, _ = self._listener.accept()
            newest = _Client(Connection(accepted))
            self._clients[newest.connection.file] = newest
        if len(self._clients) > MOST_CLIENTS:
            # whoever has shown no token yet makes room, the oldest first; at the latest that is the newest
            file, one = next((file, its) for file, its in self._clients.items() if not its.admitted)
            self._refuse(one, f"{MOST_CLIENTS} connections to this emulator's control already: close one")
            self._drop(file)

    def _respond(self, client: _Client, data: bytes) -> bool:
        """Respond to each line that is complete, and return whether the connection goes on."""
        *lines, client.line = (client.line + data).split(b"\n")
        for line in lines:
            try:
                reply = self._reply(line)
            except _NoTokenError:
                self._refuse(client, "no token, or a wrong one: take it from the line that the emulator printed")
                return False
            client.admitted = True
            if not client.connection.send(_line(reply)):
                return False
        return len(client.line) <= _LONGEST_LINE

    def _reply(self, line: bytes) -> Mapping[str, object]:
        try:
            request = json.loads(line)
        except (ValueError, RecursionError):
            request = None
        if not isinstance(request, dict) or not is_token(request.pop("token", None), self.token):
            raise _NoTokenError
        try:
            return self._perform(request)
        except (InvalidValueError, OverflowError) as error:
            return {"error": str(error)}

    def _refuse(self, client: _Client, reason: str) -> None:
        self.refused += 1
        if self.refused == 1:
            _log.warning("the emulator's control refused: %s (further ones are counted, not reported)", reason)
        client.connection.send(_line({"error": reason}))

    def _drop(self, file: int) -> None:
        self._clients.pop(file).connection.close()


def _line(reply: Mapping[str, object]) -> bytes:
    return json.dumps(reply).encode() + b"\n"


class EmulatorControl:
    """The test's end."""

    def __init__(self, address: str) -> None:
        """Connect to a host's control socket, and show the token: who has not makes room for others.

        Args:
            address: Port and token, as the host has printed them.

        Raises:
            InvalidValueError: The token is wrong.
            OSError: There is no host, or it does not respond within 5 s.
        """
        port, _, self._token = address.partition(TOKEN_FOLLOWS)
        self._socket = socket.create_connection((LOOPBACK, int(port)), timeout=_TIMEOUT)
        self._file = self._socket.makefile("rb")
        try:
            self.state()
        except BaseException:
            self.close()
            raise

    def ask(self, **request: object) -> dict[str, object]:
        """Ask for something and return the reply.

        Raises:
            InvalidValueError: It makes no sense, or the token is wrong.
            OSError: The host is gone, or does not respond within 5 s.
        """
        self._socket.sendall(_line(request | {"token": self._token}))
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
