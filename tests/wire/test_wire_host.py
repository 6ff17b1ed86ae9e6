"""The loop that serves emulated devices, in a thread and in processes of its own."""

import itertools
import json
import os
import socket
import threading
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import psutil
import pytest

from emulator_parents import no_robot_today, stand_behind
from palpate.errors import InvalidValueError
from palpate.hw.devices import DeviceError
from palpate.hw.emulators.control import Controls
from palpate.hw.emulators.host import Host
from palpate.hw.emulators.plant import PlantState
from palpate.hw.emulators.process import EmulatorProcess
from palpate.hw.emulators.simple_plant import SimplePlant
from palpate.hw.emulators.ur import UrServer
from palpate.spatial import ZERO, Vector
from ur_wire_sessions import ClientProcess, own_address
from waiting import until

ADDRESS = own_address(3)


@dataclass(eq=False)
class Mover:
    """A device without a wire that moves the arm and counts."""

    name: str = "mover"
    address: str = "nowhere"
    velocity_: Vector = (0.01, 0.0, 0.0)
    states: list[PlantState] = field(default_factory=list)
    walls: list[float] = field(default_factory=list)
    ticks: list[float] = field(default_factory=list)
    next_tick: float = float("inf")
    delay: float = 0.0
    closed: bool = False

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
        self.walls.append(time.monotonic())
        time.sleep(self.delay)

    def inject(self, fault: str, value: float) -> str:
        if fault != "slow":
            raise InvalidValueError("fault: there is slow")
        self.delay = value
        return "slow"

    def close(self) -> None:
        self.closed = True

    def velocity(self) -> tuple[Vector, Vector]:
        return self.velocity_, ZERO


class Running:
    """A host in a thread."""

    def __init__(self, scale: float = 1.0) -> None:
        self.mover = Mover()
        self.host = Host(SimplePlant(), [self.mover], arm=self.mover, scale=scale)
        self.thread = threading.Thread(target=self.host.run)
        self.thread.start()
        self.control = Controls(self.host.control_port)

    def close(self) -> None:
        self.control.close()
        self.host.stop()
        self.thread.join(5.0)
        assert not self.thread.is_alive()


@pytest.fixture
def running() -> Iterator[Running]:
    one = Running()
    yield one
    one.close()
    assert one.mover.closed


def number(state: dict[str, object], name: str) -> float:
    value = state[name]
    assert isinstance(value, int | float)
    return value


def test_every_step_is_handed_to_every_device_in_order(running: Running) -> None:
    time.sleep(0.3)
    states = list(running.mover.states)
    steps = [b.time - a.time for a, b in itertools.pairwise(states)]
    assert steps == pytest.approx([0.002] * len(steps), abs=1e-9)
    assert states[-1].arm.velocity_base_tip == pytest.approx((0.01, 0.0, 0.0), abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("scale", [0.5, 1.0, 2.0])
def test_the_plant_keeps_its_pace(scale: float) -> None:
    one = Running(scale)
    try:
        time.sleep(0.5)
        state = one.control.state()
    finally:
        one.close()
    kept = number(state, "wall") - number(state, "given_up")
    assert number(state, "time") == pytest.approx(scale * kept, rel=0.05, abs=0.06 * scale)
    assert number(state, "steps") * 0.002 == pytest.approx(number(state, "time"))


def test_a_stall_is_given_up_not_caught_up_with(running: Running) -> None:
    running.control.fault("mover", "slow", 0.3)
    time.sleep(0.4)
    running.control.fault("mover", "slow", 0.0)
    before, begun = len(running.mover.states), time.monotonic()
    time.sleep(0.1)
    steps = len(running.mover.states) - before
    # the 0.05 s that are caught up with, and that time of its own, not 0.4 s more
    assert steps < (time.monotonic() - begun) / 0.002 + 25 + 15
    assert number(running.control.state(), "given_up") > 0.2


def test_a_device_is_woken_when_it_wants(running: Running) -> None:
    wanted = time.monotonic() + 0.1
    running.mover.next_tick = wanted
    until(lambda: running.mover.ticks)
    time.sleep(0.1)
    assert len(running.mover.ticks) == 1
    assert 0.0 <= running.mover.ticks[0] - wanted < 1.0


@pytest.mark.parametrize(
    "line",
    [
        b"{}",
        b"[]",
        b"nonsense",
        b"\xff\xfe",
        b'{"do": "fault", "device": "nobody", "fault": "x", "value": 1}',
        b'{"do": "fault", "device": "mover", "fault": "no", "value": 1}',
        b'{"do": "fault", "device": "mover", "fault": "slow", "value": "1"}',
        b'{"do": "log", "device": 3}',
        b"[" * 50_000,
    ],
)
def test_senseless_requests_are_answered(running: Running, line: bytes) -> None:
    with socket.create_connection(("127.0.0.1", running.host.control_port), timeout=5.0) as client:
        client.sendall(line + b"\n")
        answer = json.loads(client.makefile("rb").readline())
    assert set(answer) == {"error"}
    assert running.control.state()["steps"]


def test_faults_are_refused_with_what_there_is(running: Running) -> None:
    with pytest.raises(InvalidValueError, match="there is slow"):
        running.control.fault("mover", "melt")
    with pytest.raises(InvalidValueError, match="there are mover"):
        running.control.fault("nobody", "slow")


def test_two_devices_of_one_name_are_refused() -> None:
    with pytest.raises(InvalidValueError, match="mover, mover"):
        Host(SimplePlant(), [Mover(), Mover()])


def test_nothing_is_left_open() -> None:
    before = psutil.Process().num_fds()
    for _ in range(3):
        server = UrServer(ADDRESS)
        host = Host(SimplePlant(), [server], arm=server)
        thread = threading.Thread(target=host.run)
        thread.start()
        with socket.create_connection((ADDRESS, 30004), timeout=5.0) as client:
            client.sendall(bytes.fromhex("0005 56 0002"))
            assert client.recv(4) == bytes.fromhex("0004 56 01")
            host.stop()
            thread.join(5.0)
    assert psutil.Process().num_fds() == before


def test_many_clients_that_say_nothing_or_rubbish_do_not_hurt() -> None:
    server = UrServer(ADDRESS)
    host = Host(SimplePlant(), [server], arm=server)
    thread = threading.Thread(target=host.run)
    thread.start()
    clients = []
    try:
        for i in range(60):
            client = socket.create_connection((ADDRESS, (30004, 30003, 29999)[i % 3]), timeout=5.0)
            clients.append(client)
            client.sendall(os.urandom(1 + 37 * i))
        with socket.create_connection((ADDRESS, 30004), timeout=5.0) as client:
            client.sendall(bytes.fromhex("0005 56 0002"))
            assert client.recv(4) == bytes.fromhex("0004 56 01")
    finally:
        for client in clients:
            client.close()
        host.stop()
        thread.join(5.0)
    assert not thread.is_alive()


@pytest.mark.slow
def test_a_factory_that_fails_says_why() -> None:
    with pytest.raises(DeviceError, match="no robot today"), EmulatorProcess(no_robot_today):
        pass


@pytest.mark.slow
def test_an_emulator_dies_with_its_parent() -> None:
    parent = ClientProcess(stand_behind, ADDRESS)
    try:
        (child,) = parent.hear()
        parent.process.kill()
        killed = time.monotonic()
        while psutil.pid_exists(child) and psutil.Process(child).status() != psutil.STATUS_ZOMBIE:
            assert time.monotonic() - killed < 5.0
            time.sleep(0.01)
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

    monkeypatch.setattr(EmulatorProcess, "_heard", interrupted)
    before = emulators()
    with pytest.raises(KeyboardInterrupt), EmulatorProcess(no_robot_today):
        pass
    assert emulators() <= before
