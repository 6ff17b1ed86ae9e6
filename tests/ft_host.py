"""Serves emulated sensors in a thread, or step by step, with a loop as small as it can be."""

import select
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from palpate.hw.emulators.plant import PlantState
from palpate.hw.emulators.server import Server
from palpate.runtime.data import ArmSample, WrenchSample
from palpate.spatial import IDENTITY, ZERO

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


@contextmanager
def served(*servers: Server) -> Iterator[None]:
    """Run the loop in a thread; the servers are closed at the end."""
    ending = threading.Event()

    def run() -> None:
        while not ending.is_set():
            serve_once(servers)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ending.set()
        thread.join(5.0)
        for server in servers:
            server.close()
        assert not thread.is_alive()
