"""A network between a rig and its devices: forwards TCP and UDP, as late, as damaged and as rarely as it is told.

It runs in a process of its own, so that nobody's lock holds it up; what it is to do comes over a pipe.
"""

import heapq
import itertools
import multiprocessing
import os
import random
import select
import socket
import time
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Self

CHUNK = 65536
TICK = 0.005
"""[s] that nothing is waited for longer than."""

READY_WITHIN = 30.0
"""[s] for a new interpreter."""


@dataclass(frozen=True, slots=True)
class Weather:
    """What the network does to all that is sent from the devices to the rig.

    Attributes:
        delay: Of each piece [s].
        creep: By which the delay grows [s/s].
        jitter: Largest further delay, drawn for each piece [s].
        loss: Share of datagrams that are lost.
        doubled: Share of datagrams that come twice.
        swapped: Share of datagrams that come 20 ms later than others.
        damaged: Share of pieces with a byte that is another one.
        cut: Share of pieces that lack their second half.
        rate: Bytes per second of each TCP connection; 0: all.
        cut_off: Nothing passes, either way; connections stay.
        back_only: Cut off only from the devices to the rig.
        closed: Connections are closed, and refused.
        reset: Connections are reset once; new ones are taken.
        ports: That are meant; none: all.
    """

    delay: float = 0.0
    creep: float = 0.0
    jitter: float = 0.0
    loss: float = 0.0
    doubled: float = 0.0
    swapped: float = 0.0
    damaged: float = 0.0
    cut: float = 0.0
    rate: float = 0.0
    cut_off: bool = False
    back_only: bool = False
    closed: bool = False
    reset: bool = False
    ports: tuple[int, ...] = ()

    def meant(self, port: int) -> bool:
        """Whether it is for what passes this port."""
        return not self.ports or port in self.ports


class Proxy:
    """Runs as long as a `with` block lasts."""

    def __init__(self, front: str, back: str, tcp: tuple[int, ...], udp: tuple[int, ...]) -> None:
        """Take addresses: listens at `front`, forwards to `back`."""
        context = multiprocessing.get_context("spawn")
        self.front, self.back = front, back
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=_forward, args=(front, back, tcp, udp, theirs), daemon=True)

    def __enter__(self) -> Self:
        self._process.start()
        if not self._pipe.poll(READY_WITHIN):
            raise TimeoutError("the proxy does not start")
        self._pipe.recv()
        return self

    def __exit__(self, *raised: object) -> None:
        with suppress(OSError):
            self._pipe.send(None)
        self._process.join(5.0)
        self._process.kill()

    def turn(self, weather: Weather, seed: int = 0) -> None:
        """Change the weather, and wait until it has changed."""
        self._pipe.send((weather, seed))
        if self._pipe.poll(READY_WITHIN):
            self._pipe.recv()


class _Line:
    """One TCP connection: both ends, and what is on its way to the rig."""

    def __init__(self, port: int, client: socket.socket, device: socket.socket) -> None:
        self.port, self.client, self.device = port, client, device
        self.waiting = bytearray()
        self.free_at = 0.0

    def close(self, *, reset: bool = False) -> None:
        """Close both ends."""
        for end in (self.client, self.device):
            if reset:
                with suppress(OSError):
                    end.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
            end.close()


class _Forwarding:
    def __init__(self, front: str, back: str, tcp: tuple[int, ...], udp: tuple[int, ...]) -> None:
        self._back, self._weather, self._random = back, Weather(), random.Random(0)
        self._since = time.monotonic()
        self._listeners = {}
        for port in tcp:
            listener = socket.create_server((front, port))
            listener.setblocking(False)
            self._listeners[listener] = port
        self._lines: dict[socket.socket, _Line] = {}
        self._sent: list[tuple[float, int, object, bytes]] = []
        self._number = itertools.count()
        self._datagrams: dict[socket.socket, int] = {}
        self._device_of: dict[socket.socket, socket.socket] = {}
        self._rig_of: dict[socket.socket, tuple[socket.socket, object]] = {}
        for port in udp:
            outside = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            outside.bind((front, port))
            inside = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            inside.connect((back, port))
            self._datagrams |= {outside: port, inside: port}
            self._device_of[outside] = inside
            self._rig_of[inside] = (outside, None)

    def turn(self, weather: Weather, seed: int) -> None:
        self._weather, self._random, self._since = weather, random.Random(seed), time.monotonic()
        if weather.reset or weather.closed:
            for line in {id(each): each for each in self._lines.values()}.values():
                if weather.meant(line.port):
                    self._drop(line, reset=weather.reset)

    def round(self) -> None:
        """Take what has come, and send on what is due."""
        open_ends = (end for end, line in self._lines.items() if not self._blocked(end, line))
        files = [*self._listeners, *open_ends, *self._datagrams]
        wait = min(TICK, max(0.0, self._sent[0][0] - time.monotonic())) if self._sent else TICK
        for file in select.select(files, [], [], wait)[0]:
            if file in self._listeners:
                self._accept(file)
            elif file in self._datagrams:
                self._datagram(file)
            elif file in self._lines:
                self._read(file)
        now = time.monotonic()
        while self._sent and self._sent[0][0] <= now:
            _, _, to, data = heapq.heappop(self._sent)
            self._deliver(to, data)

    def _accept(self, listener: socket.socket) -> None:
        port, weather = self._listeners[listener], self._weather
        client, _ = listener.accept()
        if weather.closed and weather.meant(port):
            client.close()
            return
        try:
            device = socket.create_connection((self._back, port), 1.0)
        except OSError:
            client.close()
            return
        line = _Line(port, client, device)
        for end in (client, device):
            end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._lines[end] = line

    def _read(self, file: socket.socket) -> None:
        line = self._lines[file]
        weather = self._weather if self._weather.meant(line.port) else Weather()
        try:
            data = file.recv(CHUNK)
        except OSError:
            data = b""
        if not data:
            self._drop(line)
        elif file is line.client:
            with suppress(OSError):
                line.device.sendall(data)
        elif weather.rate:
            for byte in data:
                line.free_at = max(line.free_at, time.monotonic()) + 1.0 / weather.rate
                self._later(line.free_at, line, bytes([byte]))
        else:
            # a stream keeps its order, whatever the jitter
            line.free_at = max(line.free_at, time.monotonic() + self._delay(weather))
            self._later(line.free_at, line, self._harmed(weather, data))

    def _blocked(self, end: socket.socket, line: _Line) -> bool:
        """Whether an end is not read: what it holds comes when the network is there again."""
        weather = self._weather
        return weather.meant(line.port) and (weather.cut_off or (weather.back_only and end is line.device))

    def _datagram(self, file: socket.socket) -> None:
        port = self._datagrams[file]
        weather = self._weather if self._weather.meant(port) else Weather()
        data, sender = file.recvfrom(CHUNK) if file in self._device_of else (_received(file), None)
        if weather.cut_off or weather.closed:
            return
        if file in self._device_of:
            inside = self._device_of[file]
            self._rig_of[inside] = (file, sender)
            with suppress(OSError):
                inside.send(data)
            return
        chance = self._random.random
        if weather.back_only or not data or chance() < weather.loss:
            return
        at = time.monotonic() + self._delay(weather) + (0.02 if chance() < weather.swapped else 0.0)
        for _ in range(2 if chance() < weather.doubled else 1):
            self._later(at, self._rig_of[file], self._harmed(weather, data))

    def _delay(self, weather: Weather) -> float:
        grown = weather.creep * (time.monotonic() - self._since)
        return weather.delay + grown + weather.jitter * self._random.random()

    def _harmed(self, weather: Weather, data: bytes) -> bytes:
        if self._random.random() < weather.damaged:
            at = self._random.randrange(len(data))
            data = data[:at] + bytes([data[at] ^ self._random.randrange(1, 256)]) + data[at + 1 :]
        return data[: len(data) // 2] if self._random.random() < weather.cut else data

    def _later(self, at: float, to: object, data: bytes) -> None:
        heapq.heappush(self._sent, (at, next(self._number), to, data))

    def _deliver(self, to: object, data: bytes) -> None:
        with suppress(OSError):
            if isinstance(to, _Line):
                if to.client in self._lines:
                    to.client.sendall(data)
            else:
                outside, rig = to  # type: ignore[misc]
                if rig is not None:
                    outside.sendto(data, rig)

    def _drop(self, line: _Line, *, reset: bool = False) -> None:
        for end in (line.client, line.device):
            self._lines.pop(end, None)
        line.close(reset=reset)


def _received(file: socket.socket) -> bytes:
    try:
        return file.recv(CHUNK)
    except OSError:
        return b""


def _forward(front: str, back: str, tcp: tuple[int, ...], udp: tuple[int, ...], pipe: Connection) -> None:
    """The child: forwards until its parent is gone."""
    with suppress(OSError):  # as punctual as a network, where it may
        os.setpriority(os.PRIO_PROCESS, 0, -20)
    forwarding = _Forwarding(front, back, tcp, udp)
    pipe.send("listening")
    while True:
        with suppress(EOFError):
            while pipe.poll(0.0):
                asked = pipe.recv()
                if asked is None:
                    return
                forwarding.turn(*asked)
                pipe.send("turned")
            forwarding.round()
            continue
        return
