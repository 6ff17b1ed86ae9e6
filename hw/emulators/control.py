"""Control socket of an emulator: JSON, one line each way, loopback only, for faults, state and log.

Every request carries the token that the emulator printed. A browser's POST may arrive here too, from any page: its
first line is no such request, and the connection ends with it.
"""

import json
import logging
import os
import socket
from collections.abc import Callable, Mapping, Sequence

from palpate.access_token import is_token, new_token
from palpate.errors import InvalidValueError
from palpate.hw.emulators.connection import HangUpError, LineTalk, TcpServer

LOOPBACK = "127.0.0.1"

MOST_CLIENTS = 16
"""Connections; a test has one or two. `select` takes 1024 descriptors, of all devices together."""

TOKEN_FOLLOWS = "?token="
"""Separator of port and token in the address of a control socket."""

_TIMEOUT = 5.0
"""[s] within which a host responds, even one that is held up by a busy machine."""

_log = logging.getLogger("palpate")

Perform = Callable[[Mapping[str, object]], Mapping[str, object]]


class _ControlTalk(LineTalk):
    """Requests of one client; it is admitted when its token has arrived."""

    def __init__(self, control: "ControlSocket") -> None:
        super().__init__()
        self.admitted = False
        self._control = control

    def reply(self, line: bytes) -> bytes:
        """Return the reply to a request.

        Raises:
            HangUpError: If it has no token, or a wrong one.
        """
        try:
            request = json.loads(line)
        except (ValueError, RecursionError):
            request = None
        if not isinstance(request, dict) or not is_token(request.pop("token", None), self._control.token):
            reason = "no token, or a wrong one: take it from the line that the emulator printed"
            raise HangUpError(reason, self._control.refuse(reason))
        self.admitted = True
        return _line(self._control.answer(request))


class ControlSocket:
    """Host's end.

    Attributes:
        token: Token that every request must carry.
        refused: Requests without it, and connections beyond `MOST_CLIENTS`.
    """

    def __init__(self, perform: Perform, port: int = 0, token: str | None = None) -> None:
        """Listen.

        Args:
            perform: Carries out a request; the message of its `InvalidValueError` is the reply.
            port: Port; 0: a free one.
            token: Token that every request must carry; None: a new one.

        Raises:
            InvalidValueError: If the port is not free.
        """
        self._perform, self.refused = perform, 0
        self.token = new_token() if token is None else token
        crowded = f"{MOST_CLIENTS} connections to this emulator's control already: close one"
        try:
            self._server = TcpServer(
                LOOPBACK, {port: lambda _: _ControlTalk(self)}, MOST_CLIENTS, lambda _: self.refuse(crowded)
            )
        except OSError as error:
            reason = os.strerror(error.errno or 0)
            raise InvalidValueError(
                f"control_port = {port}: cannot listen there ({reason}); take another, or 0 for a free one"
            ) from None

    @property
    def port(self) -> int:
        """Port of the socket."""
        return self._server.port

    @property
    def address(self) -> str:
        """Port and token, as `EmulatorControl` takes them; with it, faults can be switched."""
        return f"{self.port}{TOKEN_FOLLOWS}{self.token}"

    def files(self) -> Sequence[int]:
        """Return the descriptors to wait for."""
        return self._server.files()

    def receive(self, file: int) -> None:
        """Accept a connection, or respond to a request."""
        self._server.receive(file, 0.0)

    def flush(self) -> None:
        """Send the bytes that clients have not accepted yet."""
        self._server.flush()

    def close(self) -> None:
        """Close all sockets."""
        self._server.close()

    def answer(self, request: Mapping[str, object]) -> Mapping[str, object]:
        """Return the result of a request with the right token."""
        try:
            return self._perform(request)
        except (InvalidValueError, OverflowError) as error:
            return {"error": str(error)}

    def refuse(self, reason: str) -> bytes:
        """Count a refusal, and return its line."""
        self.refused += 1
        if self.refused == 1:
            _log.warning("the emulator's control refused: %s (further ones are counted, not reported)", reason)
        return _line({"error": reason})


def _line(reply: Mapping[str, object]) -> bytes:
    return json.dumps(reply).encode() + b"\n"


class EmulatorControl:
    """Client's end, for tests and commands."""

    def __init__(self, address: str) -> None:
        """Connect to a host's control socket, and show the token: clients without it make room for others.

        Args:
            address: Port and token, as the host prints them.

        Raises:
            InvalidValueError: If the token is wrong.
            OSError: If there is no host, or it does not respond within 5 s.
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
        """Send a request and return the reply.

        Raises:
            InvalidValueError: If it makes no sense, or the token is wrong.
            OSError: If the host is gone, or does not respond within 5 s.
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
        """Switch a fault of a device and return the confirmation."""
        return str(self.ask(do="fault", device=device, fault=fault, value=value)["done"])

    def state(self) -> dict[str, object]:
        """Return the state of plant and devices."""
        return self.ask(do="state")

    def log(self, device: str) -> list[str]:
        """Return the log of a device, oldest first."""
        lines = self.ask(do="log", device=device)["lines"]
        return [str(line) for line in lines] if isinstance(lines, list) else []

    def close(self) -> None:
        """Close the connection."""
        self._file.close()
        self._socket.close()
