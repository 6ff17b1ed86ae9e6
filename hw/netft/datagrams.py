"""Datagrams taken as they lie there, without letting another thread have Python in between.

Every call of a Python socket gives the interpreter away and must win it back: beside a thread that computes it
waits for the switch interval each time, 5 ms outside the control loop. Of a box of 7000 records a second, one such
call per record gets 1400, and its readings grow old without end. Here one call waits; what has come by then is
taken by calls of the system's `recv` that keep the interpreter (`ctypes.PyDLL`), a microsecond each
(`benchmarks/wire_netft.py` measures it).
"""

import ctypes
import errno
import os
import select
import socket

NOTHING = -1
"""Instead of a size: none has come."""


class Datagrams:
    """What a connected UDP socket receives."""

    def __init__(self, wire: socket.socket, longest: int) -> None:
        """Take a connected socket.

        Args:
            wire: Becomes non-blocking.
            longest: That fits [bytes]; the rest of longer ones is lost.
        """
        wire.setblocking(False)
        self._wire = wire
        self._poll = select.poll()
        self._poll.register(wire, select.POLLIN)
        self.data = bytearray(longest)
        self._memory = (ctypes.c_char * longest).from_buffer(self.data)
        # not at import: Windows has none, and who only simulates needs none
        self._recv = ctypes.PyDLL(None, use_errno=True).recv
        self._recv.argtypes = (ctypes.c_int, ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int)
        self._recv.restype = ctypes.c_ssize_t

    def wait(self, patience: float) -> bool:
        """Return whether there is one, or an error to be had, within so long [s]."""
        return bool(self._poll.poll(1e3 * patience))

    def take(self) -> int:
        """Put the next one into `data`, at once; return its size, or `NOTHING`.

        Raises:
            OSError: Nobody listens there (`ConnectionRefusedError`), or there is no route to it.
        """
        size = self._recv(self._wire.fileno(), self._memory, len(self.data), socket.MSG_DONTWAIT)
        if size >= 0:
            return int(size)
        number = ctypes.get_errno()
        if number in (errno.EAGAIN, errno.EINTR):
            return NOTHING
        raise OSError(number, os.strerror(number))
