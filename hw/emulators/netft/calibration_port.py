"""The TCP side of a Net F/T box: a request of 20 bytes for the calibration, a reply of 24."""

import contextlib
import math
import socket
from collections.abc import Sequence

from palpate.hw.netft.calibration import BoxCalibration
from palpate.hw.netft.rdt import CALIBRATION, CALIBRATION_REQUEST, HEADER

MOST_CLIENTS = 8
"""At a time; the oldest goes when one more comes."""

CLIENT_TIMEOUT = 5.0
"""Without a request after which a client is sent away [s]."""


class CalibrationPort:
    """Replies to any number of requests of each client."""

    def __init__(self, address: str, port: int, calibration: BoxCalibration) -> None:
        """Listen.

        Raises:
            OSError: The port cannot be had.
        """
        self._reply = CALIBRATION.pack(
            HEADER,
            calibration.force_unit,
            calibration.torque_unit,
            calibration.counts_per_force,
            calibration.counts_per_torque,
            *(1,) * 6,
        )
        self._listener = socket.create_server((address, port))
        self._listener.setblocking(False)
        self._clients: dict[int, tuple[socket.socket, bytearray, float]] = {}

    @property
    def port(self) -> int:
        """The port that it got."""
        return int(self._listener.getsockname()[1])

    def files(self) -> Sequence[int]:
        """Return the listener and the clients."""
        return (self._listener.fileno(), *self._clients)

    def receive(self, file: int, now: float, *, silent: bool) -> None:
        """Accept a client, or reply to one."""
        if file == self._listener.fileno():
            with contextlib.suppress(OSError):
                client, _ = self._listener.accept()
                client.setblocking(False)
                if len(self._clients) >= MOST_CLIENTS:
                    self._drop(next(iter(self._clients)))
                self._clients[client.fileno()] = (client, bytearray(), now + CLIENT_TIMEOUT)
            return
        if file in self._clients:
            self._serve(file, now, silent=silent)

    def due(self) -> float:
        """Return when the first client is to be sent away [s]."""
        return min((until for _, _, until in self._clients.values()), default=math.inf)

    def tick(self, now: float) -> None:
        """Send away those that have not asked for anything for long."""
        for file in [file for file, (_, _, until) in self._clients.items() if until <= now]:
            self._drop(file)

    def close(self) -> None:
        """Close all."""
        for file in list(self._clients):
            self._drop(file)
        self._listener.close()

    def _serve(self, file: int, now: float, *, silent: bool) -> None:
        client, heard, _ = self._clients[file]
        try:
            more = client.recv(4096)
        except BlockingIOError:
            return
        except OSError:
            more = b""
        if not more:
            self._drop(file)
            return
        heard += more
        while len(heard) >= len(CALIBRATION_REQUEST):
            asked = bytes(heard[: len(CALIBRATION_REQUEST)])
            del heard[: len(CALIBRATION_REQUEST)]
            if asked != CALIBRATION_REQUEST:
                self._drop(file)
                return
            if not silent:
                with contextlib.suppress(OSError):
                    client.send(self._reply)
        self._clients[file] = (client, heard, now + CLIENT_TIMEOUT)

    def _drop(self, file: int) -> None:
        self._clients.pop(file)[0].close()
