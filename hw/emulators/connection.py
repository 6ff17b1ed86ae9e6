"""TCP servers of emulated devices: connections that never block, and a conversation with each client."""

import contextlib
import os
import socket
import struct
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from palpate.errors import InvalidValueError

MOST_WAITING = 1_000_000
"""Bytes that may wait for a client that does not read, before it is given up."""

_CHUNK = 65536


class Connection:
    """Socket, and the bytes that it has not accepted yet."""

    def __init__(self, accepted: socket.socket) -> None:
        """Take over a connection that was just accepted."""
        accepted.setblocking(False)
        accepted.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket = accepted
        self._waiting = bytearray()

    @property
    def file(self) -> int:
        """Descriptor of the socket."""
        return self._socket.fileno()

    @property
    def clear(self) -> bool:
        """Whether all bytes so far were accepted."""
        return not self._waiting

    def read(self) -> bytes | None:
        """Return the bytes that have arrived; None if the client is gone."""
        try:
            return self._socket.recv(_CHUNK) or None
        except BlockingIOError:
            return b""
        except OSError:
            return None

    def send(self, data: bytes = b"") -> bool:
        """Send as much as is accepted, keep the rest; return whether the client is still there."""
        waiting = self._waiting
        waiting += data
        if not waiting:
            return True
        try:
            sent = self._socket.send(waiting)
        except BlockingIOError:
            sent = 0
        except OSError:
            return False
        del waiting[:sent]
        return len(waiting) <= MOST_WAITING

    def close(self, *, reset: bool = False) -> None:
        """Close in good order, or break off."""
        with contextlib.suppress(OSError):
            if reset:
                # lingering for no time sends a reset
                self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            self._socket.close()


class HangUpError(InvalidValueError):
    """A conversation cannot go on.

    Attributes:
        last: Bytes to send before the connection is closed.
    """

    def __init__(self, reason: str, last: bytes = b"") -> None:
        """Take the reason, and the last bytes."""
        super().__init__(reason)
        self.last = last


class Talk(Protocol):
    """Conversation with one client.

    Attributes:
        admitted: Whether it keeps its place when clients are too many.
    """

    admitted: bool

    def feed(self, data: bytes, now: float) -> bytes:
        """Take bytes of the client at a time [s], and return the replies.

        Raises:
            HangUpError: If the connection is to be closed.
        """
        ...

    def close(self) -> None:
        """Release the resources of the conversation."""
        ...


class LineTalk(ABC):
    """Conversation in lines (a `Talk`): one reply for each."""

    admitted = True
    LONGEST = 65536
    """Bytes without an end of line after which the client is given up."""

    def __init__(self) -> None:
        """Begin between two lines."""
        self._line = b""

    @abstractmethod
    def reply(self, line: bytes) -> bytes:
        """Return the reply to a line.

        Raises:
            HangUpError: If the connection is to be closed.
        """

    def feed(self, data: bytes, now: float) -> bytes:
        """See `Talk`."""
        *lines, self._line = (self._line + data).split(b"\n")
        replies = b""
        for line in lines:
            try:
                replies += self.reply(line)
            except HangUpError as end:
                raise HangUpError(str(end), replies + end.last) from end
        if len(self._line) > self.LONGEST:
            raise HangUpError(f"a line of more than {self.LONGEST} bytes", replies)
        return replies

    def close(self) -> None:  # noqa: B027 -- nothing to release
        """See `Talk`."""


@dataclass(slots=True, eq=False)
class TcpClient:
    """Client of a `TcpServer`."""

    connection: Connection
    talk: Talk


class TcpServer:
    """TCP ports at one address. Where clients are too many, one makes room: the oldest that is not admitted.

    Attributes:
        clients: Clients by descriptor, the oldest first.
    """

    def __init__(
        self,
        address: str,
        ports: Mapping[int, Callable[[Connection], Talk]],
        most_clients: int,
        refusal: Callable[[Talk], bytes] = lambda talk: b"",
    ) -> None:
        """Listen.

        Args:
            address: IP address of this machine.
            ports: Beginning of a conversation by port; port 0 is any free one.
            most_clients: Largest number of clients.
            refusal: Last bytes for a client that makes room.

        Raises:
            OSError: If a port is taken; its message names the port.
        """
        self._most, self._refusal = most_clients, refusal
        self.clients: dict[int, TcpClient] = {}
        self._listeners: dict[int, tuple[socket.socket, Callable[[Connection], Talk]]] = {}
        for port, begin in ports.items():
            try:
                listener = socket.create_server((address, port))
            except OSError as error:
                self.close()
                reason = os.strerror(error.errno or 0)
                raise OSError(error.errno, f"cannot listen on port {port} ({reason})") from error
            listener.setblocking(False)
            self._listeners[listener.fileno()] = (listener, begin)

    @property
    def port(self) -> int:
        """First port; 0 if there is none."""
        return next((int(listener.getsockname()[1]) for listener, _ in self._listeners.values()), 0)

    def files(self) -> Sequence[int]:
        """Return listeners and connections."""
        return [*self._listeners, *self.clients]

    def receive(self, file: int, now: float) -> None:
        """Accept a connection, or reply to a client."""
        if file in self._listeners:
            with contextlib.suppress(OSError):
                self._accept(*self._listeners[file])
        elif file in self.clients:
            client = self.clients[file]
            data = client.connection.read()
            try:
                alive = data is not None and client.connection.send(client.talk.feed(data, now) if data else b"")
            except HangUpError as end:
                client.connection.send(end.last)
                alive = False
            if not alive:
                self.drop(file)

    def flush(self) -> None:
        """Send the bytes that clients have not accepted yet."""
        for file, client in list(self.clients.items()):
            if not client.connection.send():
                self.drop(file)

    def drop(self, file: int, *, reset: bool = False) -> None:
        """Close the connection of a client."""
        client = self.clients.pop(file)
        client.talk.close()
        client.connection.close(reset=reset)

    def close(self) -> None:
        """Close all sockets."""
        for file in list(self.clients):
            self.drop(file)
        for listener, _ in self._listeners.values():
            listener.close()
        self._listeners.clear()

    def _accept(self, listener: socket.socket, begin: Callable[[Connection], Talk]) -> None:
        accepted, _ = listener.accept()
        newest = Connection(accepted)
        self.clients[newest.file] = TcpClient(newest, begin(newest))
        if len(self.clients) > self._most:
            file = next((file for file, client in self.clients.items() if not client.talk.admitted), newest.file)
            leaving = self.clients[file]
            leaving.connection.send(self._refusal(leaving.talk))
            self.drop(file)
