"""The emulated controller on its sockets, its faults, and clients as bad as clients get."""

import inspect
import ipaddress
import select
import socket
import struct
import threading
from collections.abc import Iterator
from itertools import pairwise

import pytest
from palpate.hw.emulators.ur.framing import PackageReader, PackageType, package

from palpate.errors import InvalidValueError
from palpate.hw.emulators.control import EmulatorControl
from palpate.hw.emulators.host import Host
from palpate.hw.emulators.simple_plant import SimplePlant
from palpate.hw.emulators.ur import ControllerFault, ControllerVersion, UrServer
from palpate.hw.emulators.ur.server import DASHBOARD_PORT, RTDE_PORT, SCRIPT_PORT
from support.ur_wire_sessions import own_address
from support.waiting import WITHIN, until

ADDRESS = own_address(4)
SCRIPT = b'def rtde_control():\n  textmsg("RTDE Control Script Loaded")\nend\n'


class Serving:
    """A controller served by a thread."""

    def __init__(self, period: float = 0.002) -> None:
        server = UrServer(ADDRESS, unlock_delay=0.5)
        self.host = Host(SimplePlant(period=period), [server])
        self.thread = threading.Thread(target=self.host.run)
        self.thread.start()
        self.control = EmulatorControl(self.host.control_address)

    def close(self) -> None:
        self.control.close()
        self.host.stop()
        self.thread.join(WITHIN)
        assert not self.thread.is_alive()

    def status(self) -> dict[str, object]:
        devices = self.control.state()["devices"]
        assert isinstance(devices, dict)
        return devices["ur"]

    def becomes(self, **wanted: object) -> None:
        """Wait until the controller is as wanted."""
        until(lambda: all(self.status()[name] == value for name, value in wanted.items()))


class Rtde:
    """A client as small as it can be."""

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

    def until_it_ends(self) -> None:
        """Read on, for a minute of packages at most."""
        for _ in range(30_000):
            self.next()

    def stream(self, *names: str) -> None:
        self.ask(PackageType.OUTPUTS, struct.pack(">d", 500.0) + ",".join(names).encode())
        assert self.ask(PackageType.START) == b"\x01"


@pytest.fixture
def serving() -> Iterator[Serving]:
    one = Serving()
    yield one
    one.close()


@pytest.fixture
def rtde(serving: Serving) -> Iterator[Rtde]:
    client = Rtde()
    yield client
    client.socket.close()


def upload(script: bytes = SCRIPT) -> None:
    with socket.create_connection((ADDRESS, SCRIPT_PORT), timeout=WITHIN) as client:
        client.sendall(script)


def talk(*lines: str) -> list[str]:
    with socket.create_connection((ADDRESS, DASHBOARD_PORT), timeout=WITHIN) as client:
        file = client.makefile("rb")
        replies = [file.readline()]
        for line in lines:
            client.sendall(line.encode() + b"\n")
            replies.append(file.readline())
    return [one.decode().rstrip("\n") for one in replies]


def test_default_address_is_on_loopback() -> None:
    default = inspect.signature(UrServer).parameters["address"].default
    assert ipaddress.ip_address(default).is_loopback


def test_an_address_that_is_taken_is_refused_and_nothing_stays_open(serving: Serving) -> None:
    with pytest.raises(InvalidValueError, match="30004"):
        UrServer(ADDRESS)


def test_no_dashboard_from_version_10_on() -> None:
    server = UrServer(ADDRESS, ControllerVersion(10, 10, 0, 0))
    try:
        with pytest.raises(ConnectionRefusedError):
            socket.create_connection((ADDRESS, DASHBOARD_PORT), timeout=WITHIN)
    finally:
        server.close()


def test_the_stream_has_every_cycle_in_order(rtde: Rtde) -> None:
    rtde.stream("timestamp")
    times = [struct.unpack(">Bd", rtde.next()[1])[1] for _ in range(100)]
    steps = [b - a for a, b in pairwise(times)]
    assert steps == pytest.approx([0.002] * 99, abs=1e-9)


@pytest.mark.parametrize(("period", "cycle"), [(0.001, 0.002), (0.0015, 0.002), (0.005, 0.005)])
def test_the_controller_keeps_its_cycle_whatever_the_plants_step(period: float, cycle: float) -> None:
    serving = Serving(period)
    client = Rtde()
    try:
        client.stream("timestamp")
        times = [struct.unpack(">Bd", client.next()[1])[1] for _ in range(60)]
    finally:
        client.socket.close()
        serving.close()
    assert (times[-1] - times[0]) / 59 == pytest.approx(cycle, rel=0.02)
    assert max(b - a for a, b in pairwise(times)) < cycle + period


@pytest.mark.parametrize(
    ("fault", "end"), [(ControllerFault.DROP_FIN, EOFError), (ControllerFault.DROP_RST, ConnectionResetError)]
)
def test_connections_are_dropped_either_way(
    serving: Serving, rtde: Rtde, fault: ControllerFault, end: type[Exception]
) -> None:
    rtde.stream("timestamp")
    assert serving.control.fault("ur", fault) == "1 connections closed"
    with pytest.raises(end):
        rtde.until_it_ends()
    # and accepted again
    again = Rtde()
    assert again.ask(PackageType.VERSION, b"\x00\x02") == b"\x01"
    again.socket.close()


def test_a_stalled_stream_keeps_its_connection(serving: Serving, rtde: Rtde) -> None:
    rtde.stream("timestamp")
    serving.control.fault("ur", ControllerFault.STALL_STREAM)
    rtde.socket.settimeout(0.2)
    with pytest.raises(TimeoutError):
        rtde.until_it_ends()
    rtde.socket.settimeout(WITHIN)
    assert rtde.ask(PackageType.VERSION, b"\x00\x02") == b"\x01"
    serving.control.fault("ur", ControllerFault.STALL_STREAM, 0.0)
    assert rtde.next()[0] == PackageType.DATA


@pytest.mark.slow
def test_a_client_that_does_not_read_misses_packages_and_holds_nobody_up(serving: Serving) -> None:
    with socket.socket() as lazy:
        lazy.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        lazy.settimeout(WITHIN)
        lazy.connect((ADDRESS, RTDE_PORT))
        # 11 kB each: 8 MB in the time below, more than buffers hold
        names = ",".join(["actual_q"] * 220).encode()
        lazy.sendall(
            package(PackageType.OUTPUTS, struct.pack(">d", 500.0) + names) + package(PackageType.START, b"")
        )
        eager = Rtde()
        eager.stream("timestamp")
        first, *_, last = (struct.unpack(">Bd", eager.next()[1])[1] for _ in range(750))
        assert last - first == pytest.approx(749 * 0.002)
        # it is not given up: what it has not read is no more than one package
        assert serving.status()["rtde_clients"] == 2
        eager.socket.close()
    serving.becomes(rtde_clients=0)


def test_a_stream_that_cannot_be_read_on_is_closed_and_counted(serving: Serving, rtde: Rtde) -> None:
    rtde.socket.sendall(b"\xff\xff\x00" * 10)
    with pytest.raises((EOFError, ConnectionResetError)):
        rtde.next()
    serving.becomes(rtde_clients=0, dropped=1)


def test_inputs_are_free_again_when_their_client_is_gone(serving: Serving, rtde: Rtde) -> None:
    names = b"input_int_register_0,"
    assert rtde.ask(PackageType.INPUTS, names) == b"\x01INT32"
    second = Rtde()
    assert second.ask(PackageType.INPUTS, names) == b"\x00IN_USE"
    rtde.socket.close()
    serving.becomes(rtde_clients=1)
    assert second.ask(PackageType.INPUTS, names) == b"\x01INT32"
    second.socket.close()


def test_programs_start_and_are_killed(serving: Serving) -> None:
    upload()
    serving.becomes(runtime="PLAYING")
    serving.control.fault("ur", ControllerFault.KILL_PROGRAM)
    serving.becomes(runtime="STOPPED")
    serving.control.fault("ur", ControllerFault.LATE_START, 0.3)
    upload()
    serving.becomes(runtime="PLAYING")


def test_a_program_starts_as_late_as_was_asked_for() -> None:
    server = UrServer(ADDRESS)
    try:
        server.take(SimplePlant().start())
        server.inject(ControllerFault.LATE_START, 0.3)
        upload()
        while not any("uploaded" in line for line in server.lines()):
            for file in select.select(server.files(), [], [], WITHIN)[0]:
                server.receive(file, 100.0)
        assert server.due() == pytest.approx(100.3)
        server.tick(100.29)
        assert server.status()["runtime"] == "STOPPED"
        server.tick(100.31)
        assert server.status()["runtime"] == "PLAYING"
    finally:
        server.close()


def test_a_protective_stop_is_unlocked_by_the_dashboard_later(serving: Serving) -> None:
    upload()
    serving.becomes(runtime="PLAYING")
    serving.control.fault("ur", ControllerFault.PROTECTIVE_STOP)
    assert serving.status()["safety"] == "PROTECTIVE_STOP"
    assert talk("unlock protective stop")[1].startswith("Cannot unlock")
    upload()
    until(lambda: talk("unlock protective stop")[1] == "Protective stop releasing")
    serving.becomes(safety="NORMAL")
    assert talk("programState", "running")[1:] == [
        "PAUSED",
        "Program running: false",
    ]
    upload()
    serving.becomes(runtime="PLAYING", safety="NORMAL")


def test_an_emergency_stop_needs_all_steps_back(serving: Serving) -> None:
    serving.control.fault("ur", ControllerFault.E_STOP)
    assert talk("power on", "robotmode", "safetymode")[2:] == [
        "Robotmode: POWER_OFF",
        "Safetymode: ROBOT_EMERGENCY_STOP",
    ]
    serving.control.fault("ur", ControllerFault.E_STOP, 0.0)
    assert talk("robotmode", "power on", "robotmode", "brake release", "robotmode")[1:] == [
        "Robotmode: POWER_OFF",
        "Powering on",
        "Robotmode: IDLE",
        "Brake releasing",
        "Robotmode: RUNNING",
    ]


def test_the_dashboard_says_what_the_library_looks_for(serving: Serving) -> None:
    """Verbatim, or the words that ur_rtde 1.6.5 searches for."""
    greeting, version, serial, remote, loaded, played, paused, stopped, saved, quit_ = talk(
        "PolyscopeVersion",
        "get serial number",
        "is in remote control",
        "load /programs/a.urp",
        "play",
        "pause",
        "stop",
        "isProgramSaved",
        "quit",
    )
    assert greeting == "Connected: Universal Robots Dashboard Server"
    assert "5.14.0.1" in version
    assert serial.isdigit()
    assert "true" in remote
    assert "True" in saved
    assert "Loading program:" in loaded
    assert (played, paused, stopped, quit_) == (
        "Starting program",
        "Pausing program",
        "Stopped",
        "Disconnected",
    )


def test_play_without_a_loaded_program_fails(serving: Serving) -> None:
    assert talk("play")[1] == "Failed to execute: play"


def test_a_fault_that_does_not_exist_is_refused_with_those_that_do(serving: Serving) -> None:
    with pytest.raises(InvalidValueError, match=r"drop_fin.*kill_program"):
        serving.control.fault("ur", "flood")
