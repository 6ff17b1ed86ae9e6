"""The loop that serves emulated devices, in a thread and in processes of its own."""

import contextlib
import itertools
import os
import select
import socket
import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import psutil
import pytest

from palpate.errors import InvalidValueError
from palpate.hw.devices import DeviceError
from palpate.hw.emulators.control import MOST_CLIENTS, EmulatorControl
from palpate.hw.emulators.host import Host
from palpate.hw.emulators.process import EmulatorProcess
from palpate.hw.emulators.server import PlantState
from palpate.hw.emulators.simple_plant import SimplePlant
from palpate.hw.emulators.ur import UrServer
from palpate.spatial import ZERO, Vector
from support.emulator_parents import no_robot_today, stand_behind
from support.ur_wire_sessions import ClientProcess, own_address
from support.waiting import WITHIN, until

ADDRESS = own_address(3)


@dataclass(eq=False)
class Mover:
    """A device without a wire that moves the arm and counts."""

    name: str = "mover"
    address: str = "nowhere"
    velocity_: Vector = (0.01, 0.0, 0.0)
    states: list[PlantState] = field(default_factory=list)
    ticks: list[float] = field(default_factory=list)
    next_tick: float = float("inf")
    closed: bool = False
    faults: int = 0

    def files(self) -> Sequence[int]:
        return ()

    def receive(self, file: int, now: float) -> None:
        raise AssertionError

    def due(self) -> float:
        return self.next_tick

    def tick(self, now: float) -> None:
        self.ticks.append(now)
        self.next_tick = float("inf")

    def take(self, state: PlantState) -> None:
        self.states.append(state)

    def inject(self, fault: str, value: float) -> str:
        if fault != "slow":
            raise InvalidValueError("fault: there is slow")
        self.faults += 1
        return "slow"

    def close(self) -> None:
        self.closed = True

    def velocity(self) -> tuple[Vector, Vector]:
        return self.velocity_, ZERO


class Running:
    """A host in a thread."""

    def __init__(self) -> None:
        self.mover = Mover()
        self.host = Host(SimplePlant(), [self.mover])
        self.thread = threading.Thread(target=self.host.run)
        self.thread.start()
        self.control = EmulatorControl(self.host.control_address)

    def close(self) -> None:
        self.control.close()
        self.host.stop()
        self.thread.join(WITHIN)
        assert not self.thread.is_alive()


class MadeUpTime:
    """A clock that goes on while the host waits, in the place of the modules `time` and `select`.

    Attributes:
        now: [s]
        steps: When the plant was stepped [s], and what it was like then.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch, scale: float = 1.0) -> None:
        for name in ("time", "select"):
            monkeypatch.setattr(f"palpate.hw.emulators.host.{name}", self)
        self.now, self.steps = 100.0, list[tuple[float, PlantState]]()
        self.mover = Mover()
        self.host = Host(SimplePlant(), [self.mover], scale=scale)

    def monotonic(self) -> float:
        return self.now

    def select(self, *given: object) -> tuple[list[int], ...]:
        self.now += float(str(given[-1]))
        return [], [], []

    def run(self, steps: int, stall: tuple[int, float] = (0, 0.0)) -> None:
        """Make so many steps; one of them may take long [s]."""

        def take(state: PlantState) -> None:
            self.steps.append((self.now, state))
            if len(self.steps) == stall[0]:
                self.now += stall[1]
            if len(self.steps) == steps:
                self.host.stop()

        vars(self.mover)["take"] = take
        self.host.run()


@pytest.fixture
def running() -> Iterator[Running]:
    one = Running()
    yield one
    one.close()
    assert one.mover.closed


def test_every_step_is_handed_to_every_device_in_order(running: Running) -> None:
    until(lambda: len(running.mover.states) > 100)
    states = list(running.mover.states)
    steps = [b.time - a.time for a, b in itertools.pairwise(states)]
    assert steps == pytest.approx([0.002] * len(steps), abs=1e-9)
    assert states[-1].arm.velocity_base_tip == pytest.approx((0.01, 0.0, 0.0), abs=1e-6)
    assert running.control.state()["steps"]


@pytest.mark.slow
@pytest.mark.parametrize("scale", [0.5, 1.0, 2.0])
def test_the_plant_keeps_its_pace(scale: float, monkeypatch: pytest.MonkeyPatch) -> None:
    time = MadeUpTime(monkeypatch, scale)
    time.run(500)
    (begin, first), *_, (end, last) = time.steps
    assert last.time - first.time == pytest.approx(499 * 0.002)
    assert end - begin == pytest.approx(499 * 0.002 / scale)


@pytest.mark.parametrize(("stall", "caught_up_with"), [(0.04, 20), (0.4, 0)])
def test_a_long_stall_is_given_up_and_a_short_one_caught_up_with(
    stall: float, caught_up_with: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    time = MadeUpTime(monkeypatch)
    time.run(300, (100, stall))
    after = time.steps[99][0] + stall
    steps = sum(after <= now < after + 0.1 for now, _ in time.steps)
    assert steps == pytest.approx(0.1 / 0.002 + caught_up_with, abs=1)
    assert time.host._status()["given_up"] == pytest.approx(0.0 if caught_up_with else stall, abs=0.003)


def test_a_device_is_woken_when_it_wants(monkeypatch: pytest.MonkeyPatch) -> None:
    time = MadeUpTime(monkeypatch)
    time.mover.next_tick = wanted = time.now + 0.0991
    time.run(100)
    assert time.mover.ticks == [pytest.approx(wanted, abs=1e-9)]


REFUSED: list[tuple[dict[str, object], str | None]] = [
    ({}, None),
    ({"do": "fault", "device": "nobody", "fault": "slow", "value": 1}, "there are mover"),
    ({"do": "fault", "device": "mover", "fault": "melt", "value": 1}, "there is slow"),
    ({"do": "fault", "device": "mover", "fault": "slow", "value": "1"}, None),
    ({"do": "fault", "device": "mover", "fault": "slow", "value": 10**400}, None),
    ({"do": "log", "device": 3}, None),
]


def test_senseless_requests_get_an_error(running: Running) -> None:
    for request, message in REFUSED:
        with pytest.raises(InvalidValueError, match=message):
            running.control.ask(**request)
        assert running.control.state()["steps"]


POST = b"POST / HTTP/1.1\r\nHost: evil.example\r\nOrigin: http://evil.example\r\n\r\n"
FAULT = b'{"do": "fault", "device": "mover", "fault": "slow", "value": 1'


WITHOUT_TOKEN = [
    b"{}",
    b"[]",
    b"nonsense",
    b"\xff\xfe",
    b"[" * 50_000,
    POST + FAULT + b"}",
    FAULT + b"}",
    FAULT + b', "token": "wrong"}',
    FAULT + b', "token": "\\ud800"}',
    FAULT + b', "token": 1}',
]


def test_without_the_token_a_connection_ends_and_nothing_is_switched(running: Running) -> None:
    for count, sent in enumerate(WITHOUT_TOKEN, start=1):
        with socket.create_connection(("127.0.0.1", running.host.control_port), timeout=WITHIN) as client:
            client.sendall(sent + b"\n")
            replies = client.makefile("rb")
            with contextlib.suppress(ConnectionResetError):  # where more was sent than was read
                assert b"no token" in replies.readline()
                assert replies.readline() == b""
        until(lambda number=count: running.control.state()["refused"] == number)
        assert running.mover.faults == 0


@pytest.mark.slow
def test_connections_without_the_token_make_room_and_one_too_many_is_refused(running: Running) -> None:
    """`select` takes 1024 descriptors; of 1020 connections an emulator once died. Here they are one process."""
    where = ("127.0.0.1", running.host.control_port)
    strangers, clients = [socket.create_connection(where, timeout=WITHIN) for _ in range(200)], [running.control]
    try:
        until(lambda: running.control.state()["refused"] == 200 - MOST_CLIENTS + 1)
        while len(clients) < MOST_CLIENTS:
            clients.append(EmulatorControl(running.host.control_address))
            assert clients[-1].state()["steps"]
        with socket.create_connection(where, timeout=WITHIN) as one_too_many:
            assert b"close one" in one_too_many.makefile("rb").readline()
    finally:
        for one in (*strangers, *clients[1:]):
            one.close()


def test_two_devices_of_one_name_are_refused() -> None:
    with pytest.raises(InvalidValueError, match="mover, mover"):
        Host(SimplePlant(), [Mover(), Mover()])


@contextlib.contextmanager
def controller() -> Iterator[None]:
    """Serve a UR controller in a thread, which ends with the block."""
    host = Host(SimplePlant(), [UrServer(ADDRESS)])
    thread = threading.Thread(target=host.run)
    thread.start()
    try:
        yield
    finally:
        host.stop()
        thread.join(WITHIN)
        assert not thread.is_alive()


def connected(port: int = 30004) -> socket.socket:
    return socket.create_connection((ADDRESS, port), timeout=WITHIN)


def check_reply() -> None:
    """Ask the controller for its protocol version, and check the reply."""
    with connected() as client:
        client.sendall(bytes.fromhex("0005 56 0002"))
        assert client.recv(4) == bytes.fromhex("0004 56 01")


def test_clients_beyond_a_hundred_or_with_rubbish_do_no_harm_and_nothing_stays_open() -> None:
    before, ports = psutil.Process().num_fds(), (30004, 30003, 29999)
    with controller(), contextlib.ExitStack() as clients:
        for i in range(60):
            clients.enter_context(connected(ports[i % 3])).sendall(os.urandom(1 + 37 * i))
        check_reply()
    for port in ports:
        with controller(), contextlib.ExitStack() as clients:
            # the backlog of the system may bring another one than the last to be the hundred-and-first
            received = {clients.enter_context(connected(port)): b"" for _ in range(101)}

            def refused(received: dict[socket.socket, bytes] = received) -> list[bytes]:
                for client in select.select(list(received), [], [], 0.0)[0]:
                    received[client] += client.recv(1000)
                return [text for text in received.values() if b"100 connections to this controller" in text]

            (refusal,) = until(refused, what="a refusal")
            assert b"already: close one" in refusal
    assert psutil.Process().num_fds() == before


@pytest.mark.slow
def test_a_factory_that_fails_says_why() -> None:
    with pytest.raises(DeviceError, match="no robot today"), EmulatorProcess(no_robot_today):
        pass


@pytest.mark.slow
def test_an_emulator_dies_with_its_parent() -> None:
    parent = ClientProcess(stand_behind, ADDRESS)
    try:
        (child,) = parent.result()
        parent.process.kill()
        until(lambda: not psutil.pid_exists(child) or psutil.Process(child).status() == psutil.STATUS_ZOMBIE)
    finally:
        parent.end()
    # the ports are free again
    UrServer(ADDRESS).close()


@pytest.mark.slow
def test_a_start_that_is_broken_off_leaves_no_emulator(monkeypatch: pytest.MonkeyPatch) -> None:
    """By Ctrl-C, say, while it comes up."""

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    def emulators() -> set[int]:
        found = psutil.Process().children(recursive=True)
        return {its.pid for its in found if "resource_tracker" not in " ".join(its.cmdline())}

    monkeypatch.setattr(EmulatorProcess, "_first_message", interrupted)
    before = emulators()
    with pytest.raises(KeyboardInterrupt), EmulatorProcess(no_robot_today):
        pass
    assert emulators() <= before
