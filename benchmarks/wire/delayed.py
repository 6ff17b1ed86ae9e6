"""A line between a client and an emulated device that holds back what the device sends, for as long as one likes.

Nothing is lost and nothing overtakes, as in a buffer that fills. Connections, datagrams and terminals alike.
"""

import os
import select
import socket
import threading
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from time import monotonic
from typing import Self

import serial

from palpate.hw.emulators.terminal import Terminal

CHUNK = 1 << 16
LONGEST_WAIT = 0.02
STALL = 0.02
"""[s] without anything from a device that streams every 2 ms."""


@dataclass(slots=True, eq=False)
class Direction:
    """What goes from one end to the other.

    Attributes:
        source: Descriptor that it comes from.
        receive: Returns what has come; None at the end.
        send: Passes it on.
        held: Whether it is held back.
        waiting: When it came, and what.
    """

    source: int
    receive: Callable[[], bytes | None]
    send: Callable[[bytes], object]
    held: bool
    waiting: deque[tuple[float, bytes]] = field(default_factory=deque)


class DelayedLine:
    """Passes everything on from a thread of its own, in a `with` block.

    Attributes:
        released: When the newest that has been passed on from the device came from it [s]: what anybody behind
            this line knows is as old at least.
        stalled: When the device, or this line, had last stood still for longer than `STALL` [s].
    """

    def __init__(self) -> None:
        self.released = self.stalled = self._came = monotonic()
        self._delay: Callable[[float], float] = lambda _: 0.0
        self._listeners: dict[int, tuple[socket.socket, tuple[str, int]]] = {}
        self._directions: dict[int, Direction] = {}
        self._ends: list[Callable[[], object]] = []
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def creep(self, rate: float) -> None:
        """Hold back what comes from now on for a time that grows by `rate` [s/s]; 0: not at all."""
        begun = monotonic()
        self._delay = lambda came: rate * max(0.0, came - begun)

    def vary(self, delay: Callable[[float], float]) -> None:
        """Hold back what comes at a time [s] for `delay` of it [s]."""
        self._delay = delay

    def connections(self, address: str, to: str, ports: Sequence[int]) -> None:
        """Listen at an address for connections to another one."""
        for port in ports:
            listener = socket.create_server((address, port))
            self._listeners[listener.fileno()] = listener, (to, port)
            self._ends.append(listener.close)

    def datagrams(self, to: tuple[str, int]) -> int:
        """Return a port of 127.0.0.1 from which datagrams go to another one."""
        near = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        far = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        near.bind(("127.0.0.1", 0))
        far.connect(to)
        client: list[tuple[str, int]] = []

        def from_client() -> bytes:
            data, sender = near.recvfrom(CHUNK)
            client[:] = [sender]
            return data

        self._join(near.fileno(), from_client, far.send, held=False)
        self._join(far.fileno(), lambda: far.recv(CHUNK), lambda data: near.sendto(data, client[0]), held=True)
        self._ends += [near.close, far.close]
        return int(near.getsockname()[1])

    def terminal(self, to: str, baud: int) -> str:
        """Return the path of a terminal whose bytes go to another one, which runs at so many bits a second."""
        near, far = Terminal(), serial.Serial(to, baud, timeout=0)
        self._join(near.master, near.read, far.write, held=False)
        self._join(far.fileno(), lambda: os.read(far.fileno(), CHUNK), near.write, held=True)
        self._ends += [near.close, far.close]
        return near.path

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ending.set()
        self._thread.join()
        for end in self._ends:
            end()

    def _join(
        self, source: int, receive: Callable[[], bytes | None], send: Callable[[bytes], object], *, held: bool
    ) -> None:
        self._directions[source] = Direction(source, receive, send, held)

    def _run(self) -> None:
        while not self._ending.is_set():
            readable, _, _ = select.select([*self._listeners, *self._directions], [], [], self._wait())
            for source in readable:
                if source in self._listeners:
                    self._accept(*self._listeners[source])
                elif source in self._directions:
                    self._take(self._directions[source])
            for direction in list(self._directions.values()):
                self._release(direction)

    def _wait(self) -> float:
        due = [d.waiting[0][0] + self._delay(d.waiting[0][0]) for d in self._directions.values() if d.waiting]
        return min(LONGEST_WAIT, max(0.0, min(due, default=1e9) - monotonic()))

    def _accept(self, listener: socket.socket, to: tuple[str, int]) -> None:
        near, far = listener.accept()[0], socket.create_connection(to)
        for end, other, held in ((near, far, False), (far, near, True)):
            end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._join(end.fileno(), lambda end=end: end.recv(CHUNK) or None, other.sendall, held=held)
            self._ends.append(end.close)

    def _take(self, direction: Direction) -> None:
        data: bytes | None = None
        with suppress(OSError):
            data = direction.receive()
        if data is None:  # the other direction ends when it is written to
            del self._directions[direction.source]
        elif direction.held:
            now = monotonic()
            if now - self._came > STALL:
                self.stalled = now
            self._came = now
            direction.waiting.append((now, data))
        else:
            with suppress(OSError):
                direction.send(data)

    def _release(self, direction: Direction) -> None:
        waiting = direction.waiting
        while waiting and waiting[0][0] + self._delay(waiting[0][0]) <= monotonic():
            came, data = waiting.popleft()
            self.released = max(self.released, came)  # first: who is behind the line must not know of newer ones
            with suppress(OSError):
                direction.send(data)
