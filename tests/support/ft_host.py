"""Serves emulated sensors in a thread, or step by step, with a loop as small as it can be."""

import select
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from contextlib import contextmanager, suppress

from palpate.hw.devices import DeviceError, SensorDevice, SensorReading
from palpate.hw.emulators.server import PlantState, Server
from palpate.runtime.data import ArmSample, WrenchSample
from palpate.spatial import IDENTITY, ZERO
from support.waiting import WITHIN, until

ZERO_LOAD = (0.0,) * 6
STANDING = ArmSample(0.0, ZERO, IDENTITY, ZERO)


def state(*wrenches: tuple[float, ...], time: float = 0.0) -> PlantState:
    return PlantState(time, STANDING, tuple(WrenchSample(time, w, ZERO) for w in wrenches))


def serve_once(servers: Sequence[Server], longest: float = 0.005) -> None:
    due = min(server.due() for server in servers)
    wait = min(max(due - time.monotonic(), 0.0), longest)
    owners = {file: server for server in servers for file in server.files()}
    readable, _, _ = select.select(list(owners), [], [], wait)
    now = time.monotonic()
    for file in readable:
        owners[file].receive(file, now)
    now = time.monotonic()
    for server in servers:
        if server.due() <= now:
            server.tick(now)


def good(ft: SensorDevice) -> SensorReading:
    """Read until that gives a healthy reading, and return it."""

    def healthy() -> SensorReading | None:
        with suppress(DeviceError):
            reading = ft.read()
            return reading if reading.healthy else None
        return None

    reading = until(healthy)
    assert reading is not None
    return reading


@contextmanager
def served(*servers: Server) -> Iterator[None]:
    """Run the loop in a thread; the servers are closed at the end."""
    ending = threading.Event()
    asked: deque[tuple[Future[object], Callable[..., object], tuple[object, ...]]] = deque()

    def handed_over(inject: Callable[..., object]) -> Callable[..., object]:
        """Switch a fault between two rounds, as a real host does: a line is not unplugged while it is read."""

        def ask(*values: object) -> object:
            done = Future[object]()
            asked.append((done, inject, values))
            return done.result(WITHIN)

        return ask

    def run() -> None:
        while not ending.is_set():
            while asked:
                done, inject, values = asked.popleft()
                try:
                    done.set_result(inject(*values))
                except Exception as error:
                    done.set_exception(error)
            serve_once(servers)

    for server in servers:
        vars(server)["inject"] = handed_over(server.inject)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ending.set()
        thread.join(WITHIN)
        for server in servers:
            del vars(server)["inject"]
            server.close()
        assert not thread.is_alive()
