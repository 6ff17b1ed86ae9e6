"""The emulated controller on its sockets, its faults, and its limits of clients."""

import inspect
import ipaddress
import select
import socket
import struct
from collections.abc import Iterator
from contextlib import ExitStack, closing
from itertools import pairwise

import pytest

from palpate.errors import InvalidValueError
from palpate.hw.emulators.simple_plant import SimplePlant
from palpate.hw.emulators.ur import ControllerFault, ControllerVersion, UrServer
from palpate.hw.emulators.ur.rtde import PackageReader, PackageType, package
from palpate.hw.emulators.ur.server import DASHBOARD_PORT, RTDE_PORT, SCRIPT_PORT
from support.served_ur import ServedUr
from support.ur_wire_sessions import own_address
from support.waiting import WITHIN, until

ADDRESS = own_address(4)
SCRIPT = b'def rtde_control():\n  textmsg("RTDE Control Script Loaded")\nend\n'


class Rtde:
    """A minimal client."""

    def __init__(self) -> None:
        self.socket = socket.create_connection((ADDRESS, RTDE_PORT), timeout=WITHIN)
        self.reader = PackageReader()
        self.waiting: list[tuple[int, bytes]] = []

    def ask(self, kind: PackageType, payload: bytes = b"") -> bytes:
        self.socket.sendall(package(kind, payload))
        while True:
            got, reply = self.next()
            if got == kind:
                return reply

    def next(self) -> tuple[int, bytes]:
        while not self.waiting:
            data = self.socket.recv(65536)
            if not data:
                raise EOFError
            self.waiting = self.reader.feed(data)
        return self.waiting.pop(0)

    def close(self) -> None:
        self.socket.close()

    def stream(self, count: int = 0) -> list[float]:
        """Start a stream of time stamps, and return as many."""
        self.ask(PackageType.OUTPUTS, struct.pack(">d", 500.0) + b"timestamp")
        assert self.ask(PackageType.START) == b"\x01"
        return [struct.unpack(">Bd", self.next()[1])[1] for _ in range(count)]


@pytest.fixture
def serving() -> Iterator[ServedUr]:
    with ServedUr(ADDRESS) as one:
        yield one


def upload() -> None:
    with socket.create_connection((ADDRESS, SCRIPT_PORT), timeout=WITHIN) as client:
        client.sendall(SCRIPT)


def talk(*lines: str) -> list[str]:
    """Return the replies of the dashboard, without its greeting."""
    with socket.create_connection((ADDRESS, DASHBOARD_PORT), timeout=WITHIN) as client:
        file = client.makefile("rb")
        assert file.readline() == b"Connected: Universal Robots Dashboard Server\n"
        replies = []
        for line in lines:
            client.sendall(line.encode() + b"\n")
            replies.append(file.readline().decode().rstrip("\n"))
    return replies


def test_addresses_and_versions(serving: ServedUr) -> None:
    default = inspect.signature(UrServer).parameters["address"].default
    assert ipaddress.ip_address(default).is_loopback
    with pytest.raises(InvalidValueError, match="30004"):
        UrServer(ADDRESS)
    # PolyScope X has no dashboard
    other = own_address(5)
    with closing(UrServer(other, ControllerVersion(10, 10, 0, 0))), pytest.raises(ConnectionRefusedError):
        socket.create_connection((other, DASHBOARD_PORT), timeout=WITHIN)


@pytest.mark.parametrize(("period", "cycle"), [(0.001, 0.002), (0.0015, 0.002), (0.002, 0.002), (0.005, 0.005)])
def test_the_controller_streams_every_cycle_whatever_the_plants_step(period: float, cycle: float) -> None:
    with ServedUr(ADDRESS, period), closing(Rtde()) as client:
        times = client.stream(60)
    assert (times[-1] - times[0]) / 59 == pytest.approx(cycle, rel=0.02)
    assert max(b - a for a, b in pairwise(times)) < cycle + period
    if period == cycle:
        assert [b - a for a, b in pairwise(times)] == pytest.approx([cycle] * 59, abs=1e-9)


@pytest.mark.slow
def test_a_client_that_does_not_read_misses_packages_and_delays_no_other(serving: ServedUr) -> None:
    with socket.socket() as lazy, ExitStack() as others:
        lazy.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        lazy.settimeout(WITHIN)
        lazy.connect((ADDRESS, RTDE_PORT))
        # 11 kB each: 8 MB in the time below, more than buffers hold
        names = struct.pack(">d", 500.0) + ",".join(["actual_q"] * 220).encode()
        lazy.sendall(package(PackageType.OUTPUTS, names) + package(PackageType.START, b""))
        first, *_, last = others.enter_context(closing(Rtde())).stream(750)
        assert last - first == pytest.approx(749 * 0.002)
        # the lazy client is kept: it is behind by no more than one package
        serving.becomes(rtde_clients=2)
    serving.becomes(rtde_clients=0)


def test_a_stream_that_cannot_be_read_on_is_closed_and_its_inputs_are_free_again(serving: ServedUr) -> None:
    names = b"input_int_register_0,"
    with closing(Rtde()) as first, closing(Rtde()) as second:
        assert first.ask(PackageType.INPUTS, names) == b"\x01INT32"
        assert second.ask(PackageType.INPUTS, names) == b"\x00IN_USE"
        first.socket.sendall(b"\xff\xff\x00" * 10)
        with pytest.raises((EOFError, ConnectionResetError)):
            first.next()
        serving.becomes(rtde_clients=1, dropped=1)
        assert second.ask(PackageType.INPUTS, names) == b"\x01INT32"


def test_a_program_starts_at_its_delayed_time() -> None:
    with closing(UrServer(ADDRESS)) as server:
        server.take(SimplePlant().start())
        server.inject(ControllerFault.LATE_START, 0.3)
        upload()
        while not any("uploaded" in line for line in server.lines()):
            for file in select.select(server.files(), [], [], WITHIN)[0]:
                server.receive(file, 100.0)
        assert server.due() == pytest.approx(100.3)
        for now, runtime in ((100.29, "STOPPED"), (100.31, "PLAYING")):
            server.tick(now)
            assert server.status()["runtime"] == runtime


def test_a_program_is_killed_and_a_protective_stop_is_unlocked_by_the_dashboard_later(serving: ServedUr) -> None:
    upload()
    serving.becomes(runtime="PLAYING")
    serving.fault(ControllerFault.KILL_PROGRAM)
    serving.becomes(runtime="STOPPED")
    upload()
    serving.becomes(runtime="PLAYING")
    assert serving.fault(ControllerFault.PROTECTIVE_STOP) == "PROTECTIVE_STOP"
    assert talk("unlock protective stop")[0].startswith("Cannot unlock")
    upload()
    until(lambda: talk("unlock protective stop") == ["Protective stop releasing"])
    serving.becomes(safety="NORMAL")
    assert talk("programState", "running") == ["PAUSED", "Program running: false"]
    upload()
    serving.becomes(runtime="PLAYING", safety="NORMAL")


def test_the_dashboard_replies_with_the_words_of_ur_rtde_and_unknown_faults_are_refused(
    serving: ServedUr,
) -> None:
    serving.fault(ControllerFault.E_STOP)
    off = ["Robotmode: POWER_OFF", "Safetymode: ROBOT_EMERGENCY_STOP", "Failed to execute: restart safety"]
    assert talk("power on", "robotmode", "safetymode", "restart safety")[1:] == off
    serving.fault(ControllerFault.E_STOP, 0.0)
    said = (
        ("robotmode", "Robotmode: POWER_OFF"),
        ("power on", "Powering on"),
        ("robotmode", "Robotmode: IDLE"),
        ("brake release", "Brake releasing"),
        ("robotmode", "Robotmode: RUNNING"),
        ("PolyscopeVersion", "URSoftware 5.14.0.1 (Jan 01 2023)"),
        ("get serial number", "20235500001"),
        ("is in remote control", "true"),
        ("play", "Failed to execute: play"),
        ("load /programs/a.urp", "Loading program: /programs/a.urp"),
        ("play", "Starting program"),
        ("programState", "PLAYING /programs/a.urp"),
        ("pause", "Pausing program"),
        ("stop", "Stopped"),
        ("isProgramSaved", "True /programs/a.urp"),
        ("nonsense", "could not understand: 'nonsense'"),
        ("quit", "Disconnected"),
    )
    assert [talk(line) for line, _ in said] == [[reply] for _, reply in said]
    with pytest.raises(InvalidValueError, match=r"drop_fin.*kill_program"):
        serving.control.fault("ur", "flood")
