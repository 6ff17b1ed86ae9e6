"""A client's connection that never makes anybody wait."""

import contextlib
import socket
import struct

MOST_WAITING = 1_000_000
"""Bytes that may wait for a client that does not read, before it is given up."""

_CHUNK = 65536


class Connection:
    """A socket, and what it has not taken yet."""

    def __init__(self, accepted: socket.socket) -> None:
        """Take over a connection that was just accepted."""
        accepted.setblocking(False)
        accepted.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket = accepted
        self._waiting = bytearray()

    @property
    def file(self) -> int:
        """Its descriptor."""
        return self._socket.fileno()

    @property
    def clear(self) -> bool:
        """Whether everything so far has been taken."""
        return not self._waiting

    def read(self) -> bytes | None:
        """Return what has arrived; None if the client is gone."""
        try:
            return self._socket.recv(_CHUNK) or None
        except BlockingIOError:
            return b""
        except OSError:
            return None

    def send(self, data: bytes = b"") -> bool:
        """Send as much as is taken, keep the rest; return whether the client is still there."""
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
