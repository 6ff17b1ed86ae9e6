"""Random bytes to an emulated UR controller, and from a controller: neither hangs nor ends the other."""

import contextlib
import itertools
import random
import socket
import socketserver
import struct
import threading
from collections.abc import Callable, Iterator

import pytest

from palpate.hw.devices import DeviceError
from palpate.hw.emulators.ur.rtde import PackageType, package
from palpate.hw.emulators.ur.server import DASHBOARD_PORT, RTDE_PORT, SCRIPT_PORT
from palpate.hw.ur import UrArm, UrSettings
from palpate.hw.ur.rtde import controller_version
from support.served_ur import ServedUr, nearly_right_package
from support.ur_wire_sessions import own_address
from support.waiting import WITHIN

ADDRESS, RUDE = own_address(7), own_address(8)
QUICK, ALL = 3_000, 100_000
COUNT = pytest.mark.parametrize("count", [QUICK, pytest.param(ALL, marks=pytest.mark.slow)])
BURST = 50
"""Packages at a time on one connection."""

VERSION = package(PackageType.VERSION, b"\x01")
CONTROLLER = package(PackageType.CONTROLLER_VERSION, struct.pack(">4I", 5, 14, 0, 1))
"""The two replies by which a controller is recognised."""

WORDS = (
    b"power on", b"stop", b"load ", b"popup", b"unlock protective stop", b"isProgramSaved", b"get serial number",
)  # fmt: skip
PARTS = (
    b"def f():\n", b"end\n", b"  sleep(1)\n", b"\x00\xff", b"sec x():\n", b"RTDE Control Script Loaded",
    b"# int register offset\n", b"p[1,2]\n",
)  # fmt: skip
"""Pieces of programs."""

Say = Callable[[random.Random], bytes]


def any_script(g: random.Random) -> bytes:
    """Return text that resembles a program, or does not."""
    return b"".join(g.choices(PARTS, k=6)) + g.randbytes(g.randrange(20))


def any_line(g: random.Random) -> bytes:
    """Return a line to the dashboard, or a piece of one, or many."""
    word = g.choice(WORDS)
    return g.choice((word, word + b"\n", g.randbytes(30) + b"\n", b"\n\n\n", b"x" * 3000))


def sent(port: int, burst: list[bytes]) -> None:
    """Send all of it on one connection, which the other side may end; read its replies in passing."""
    with contextlib.suppress(OSError), socket.create_connection((ADDRESS, port), timeout=WITHIN) as client:
        for one in burst:
            client.sendall(one)
            client.setblocking(False)
            with contextlib.suppress(BlockingIOError):
                client.recv(65536)
            client.settimeout(WITHIN)


@COUNT
@pytest.mark.parametrize(
    ("port", "some"), [(RTDE_PORT, nearly_right_package), (SCRIPT_PORT, any_script), (DASHBOARD_PORT, any_line)]
)
def test_an_emulated_controller_accepts_anything_and_goes_on(port: int, some: Say, count: int) -> None:
    """The arm stays, connections are released, and the next client is served."""
    g = random.Random(port)
    with ServedUr(ADDRESS) as served:
        before = served.control.state()["position"]
        for _ in range(count // BURST):
            sent(port, [some(g) for _ in range(BURST)])
        assert controller_version("UR arm", ADDRESS)[:2] == (5, 14)
        served.becomes(clients=0)
        assert served.control.state()["position"] == pytest.approx(before, abs=1e-9)


class ReusingServer(socketserver.TCPServer):
    allow_reuse_address = True


@contextlib.contextmanager
def rude_server(say: Say, ports: tuple[int, ...] = (RTDE_PORT,), seed: int = 4) -> Iterator[list[object]]:
    """Accept connections at ports and send any replies; yield the clients so far."""
    g, accepted = random.Random(seed), []

    class Rude(socketserver.BaseRequestHandler):
        def handle(self) -> None:
            accepted.append(self.client_address)
            self.request.settimeout(0.2)
            with contextlib.suppress(OSError):
                for _ in range(3):
                    self.request.recv(4096)
                    self.request.sendall(say(g))

    with contextlib.ExitStack() as servers:
        for port in ports:
            server = servers.enter_context(ReusingServer((RUDE, port), Rude))
            thread = threading.Thread(target=server.serve_forever, args=(0.05,))
            thread.start()
            servers.callback(thread.join)
            servers.callback(server.shutdown)
        yield accepted


@pytest.mark.parametrize("count", [300, pytest.param(ALL, marks=pytest.mark.slow)])
def test_only_a_controller_s_version_is_accepted(count: int) -> None:
    """Anything else is a `DeviceError`: never another exception, never a wait without end."""

    def say(g: random.Random) -> bytes:
        # at half of the times the first step is passed
        return VERSION if g.randrange(2) else nearly_right_package(g)

    with rude_server(say) as accepted:
        versions = set()
        for _ in range(count):
            with contextlib.suppress(DeviceError):
                versions.add(controller_version("UR arm", RUDE, timeout=0.05))
        assert len(accepted) >= count
    # 16 random bytes are no version that there is
    assert not versions


@pytest.mark.parametrize("step", [0.0, 0.3])
def test_a_greeting_that_trickles_in_has_one_deadline(step: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Byte by byte it may come, within the time for all of it; each read takes `step` by the clock."""
    clock = itertools.count()
    monkeypatch.setattr("palpate.hw.ur.rtde.monotonic", lambda: step * next(clock))
    real, reads = socket.socket.recv, []

    def trickle(stream: socket.socket, most: int) -> bytes:
        if stream.getpeername()[1] != RTDE_PORT:  # the controller's end
            return real(stream, most)
        reads.append(1)
        return real(stream, 1)

    monkeypatch.setattr("socket.socket.recv", trickle)
    with rude_server(lambda _: VERSION + CONTROLLER):
        if step:
            with pytest.raises(DeviceError, match="its greeting took too long"):
                controller_version("UR arm", RUDE, timeout=2.0)
            assert len(reads) <= 2.0 / step
        else:
            assert controller_version("UR arm", RUDE, timeout=2.0) == (5, 14, 0, 1)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_a_controller_that_hangs_up_is_reported_and_nothing_is_left(seed: int) -> None:
    """It says that it is a controller, and then nothing that makes sense."""
    greeting = iter((VERSION, CONTROLLER))

    def say(g: random.Random) -> bytes:
        return next(greeting, None) or nearly_right_package(g)

    with rude_server(say, (RTDE_PORT, SCRIPT_PORT, DASHBOARD_PORT), seed):
        arm = UrArm(RUDE, UrSettings(start_within=5.0))
        with pytest.raises(DeviceError, match=RUDE):
            arm.start()
        arm.close()
