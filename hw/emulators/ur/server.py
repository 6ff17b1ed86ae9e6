"""The controller on its sockets: what the emulators' host serves."""

import contextlib
import math
import socket
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

from palpate.errors import InvalidValueError
from palpate.hw.emulators.connection import Connection
from palpate.hw.emulators.plant import PlantState
from palpate.hw.emulators.ur.arm import STILL, ArmMounting
from palpate.hw.emulators.ur.dashboard import GREETING, DashboardServer
from palpate.hw.emulators.ur.faults import ControllerFault
from palpate.hw.emulators.ur.framing import FramingError, PackageType, package, text_message
from palpate.hw.emulators.ur.programs import program_of
from palpate.hw.emulators.ur.robot import EmulatedController
from palpate.hw.emulators.ur.rtde_session import RtdeSession
from palpate.hw.emulators.ur.script_text import ProgramReader, UploadedProgram
from palpate.hw.emulators.ur.version import ControllerVersion
from palpate.spatial import Vector

RTDE_PORT, SCRIPT_PORT, DASHBOARD_PORT = 30004, 30003, 29999
"""Fixed in ur_rtde; the address is not."""

_SLACK = 1e-9
"""[s] of rounding between the plant's clock and the controller's cycles."""

MOST_CLIENTS = 100
"""Connections; one more is refused in a sentence. `select` takes 1024 descriptors, of all devices together."""

_ERROR = 1
"""Level of a text message."""

_LONGEST_LINE = 4096
"""Bytes without an end after which a dashboard client is given up."""


@dataclass(slots=True, eq=False)
class _RtdeClient:
    connection: Connection
    session: RtdeSession


@dataclass(slots=True, eq=False)
class _ScriptClient:
    connection: Connection
    reader: ProgramReader


@dataclass(slots=True, eq=False)
class _DashboardClient:
    connection: Connection
    line: bytes = b""


_Client = _RtdeClient | _ScriptClient | _DashboardClient


def _one_too_many(port: int) -> bytes:
    """Return what a connection beyond `MOST_CLIENTS` is sent."""
    sentence = f"{MOST_CLIENTS} connections to this controller already: close one"
    if port == RTDE_PORT:
        return package(PackageType.TEXT, text_message(sentence, "emulator", _ERROR))
    return f"{sentence}\n".encode()


class UrServer:
    """An arm with its controller, found at one address."""

    def __init__(
        self,
        address: str = "127.0.0.2",
        version: ControllerVersion | None = None,
        mounting: ArmMounting | None = None,
        name: str = "ur",
        unlock_delay: float = 5.0,
    ) -> None:
        """Listen.

        Args:
            address: Of this controller alone, since ports are fixed: one of the loopback net unless others are to
                reach it.
            version: Of its software; None: 5.14.0.1.
            mounting: How the arm stands in the plant; None: a UR5e at its origin.
            name: For faults.
            unlock_delay: How long a protective stop cannot be unlocked [s]; 5 on a robot.

        Raises:
            InvalidValueError: The address is not free, or none of this machine.
        """
        self._name, self._address = name, address
        version = ControllerVersion() if version is None else version
        self._robot = EmulatedController(version, ArmMounting() if mounting is None else mounting, unlock_delay)
        self._dashboard = DashboardServer(self._robot)
        self._faults: set[ControllerFault] = set()
        self._owners: dict[str, RtdeSession] = {}
        self._clients: dict[int, _Client] = {}
        self._listeners: dict[int, socket.socket] = {}
        self._late = 0.0
        self._uploads: deque[tuple[float, UploadedProgram]] = deque()
        self._next = 0.0
        self._fresh = False
        self._dropped = 0
        for port in (RTDE_PORT, SCRIPT_PORT, *((DASHBOARD_PORT,) if version.has_dashboard else ())):
            try:
                listener = socket.create_server((address, port))
            except OSError as error:
                self.close()
                raise InvalidValueError(
                    f"address = {address!r}: cannot listen on port {port} ({error.strerror}); another "
                    "emulator may be running there: end it, or take another address of 127.0.0.0/8"
                ) from error
            listener.setblocking(False)
            self._listeners[listener.fileno()] = listener

    @property
    def name(self) -> str:
        """For faults and messages."""
        return self._name

    @property
    def address(self) -> str:
        """The IP address that clients take."""
        return self._address

    def files(self) -> Sequence[int]:
        """Return listeners and connections."""
        return [*self._listeners, *self._clients]

    def receive(self, file: int, now: float) -> None:
        """Accept a connection, or read what a client says."""
        listener = self._listeners.get(file)
        if listener is not None:
            self._accept(listener)
            return
        client = self._clients.get(file)
        if client is None:
            return
        data = client.connection.read()
        if data is None:
            self._drop(file)
        elif data:
            self._take_bytes(file, client, data, now)

    def due(self) -> float:
        """Return when a late program is to start."""
        return self._uploads[0][0] if self._uploads else math.inf

    def tick(self, now: float) -> None:
        """Start programs that are due."""
        while self._uploads and self._uploads[0][0] <= now:
            _, uploaded = self._uploads.popleft()
            self._start(uploaded)

    def take(self, state: PlantState) -> None:
        """Measure, and stream what was measured, once per cycle of the controller."""
        if state.time < self._next - _SLACK:
            return
        # a plant whose periods are longer than the controller's has one cycle for each of them
        self._next = max(self._next + self._robot.period, state.time)
        self._robot.measure(state)
        self._fresh = True
        for file, client in list(self._clients.items()):
            if isinstance(client, _RtdeClient):
                package = client.session.stream()
                # a client that does not read misses packages, as with the real controller
                if not client.connection.send(package if client.connection.clear else b""):
                    self._drop(file)

    def velocity(self) -> tuple[Vector, Vector]:
        """Run one cycle, if a new measurement has come, and return how the plant's tip is to move."""
        robot = self._robot
        if self._fresh:
            self._fresh = False
            robot.cycle()
        return STILL if robot.twist == STILL else robot.arm.tip_velocity(robot.twist)

    def inject(self, fault: str, value: float) -> str:
        """Switch one of `ControllerFault`.

        Raises:
            InvalidValueError: There is no such fault; the message lists those that there are.
        """
        if fault not in list(ControllerFault):
            raise InvalidValueError(f"fault = {fault!r}: {self._name} has {', '.join(ControllerFault)}")
        switch = ControllerFault(fault)
        robot = self._robot
        robot.note("fault", fault=fault, value=value)
        match switch:
            case ControllerFault.DROP_FIN | ControllerFault.DROP_RST:
                dropped = [file for file, client in self._clients.items() if isinstance(client, _RtdeClient)]
                for file in dropped:
                    self._drop(file, reset=switch is ControllerFault.DROP_RST)
                return f"{len(dropped)} connections closed"
            case ControllerFault.LATE_START:
                self._late = max(0.0, value)
                return f"programs start {self._late:g} s late"
            case ControllerFault.PROTECTIVE_STOP:
                if value:
                    robot.protective_stop("fault")
                else:
                    robot.unlock(by_hand=True)
                return robot.safety.name
            case ControllerFault.E_STOP:
                robot.press_emergency_stop(bool(value))
                return robot.safety.name
            case ControllerFault.KILL_PROGRAM:
                robot.end_program("killed")
                return robot.runtime.name
            case _:
                (self._faults.add if value else self._faults.discard)(switch)
                self._dashboard.remote = ControllerFault.LOCAL_CONTROL not in self._faults
                return f"{switch} {'on' if value else 'off'}"

    def status(self) -> dict[str, object]:
        """Return what is going on, for a test."""
        robot = self._robot
        clients = list(self._clients.values())
        sessions = [client.session for client in clients if isinstance(client, _RtdeClient)]
        return {
            "runtime": robot.runtime.name,
            "safety": robot.safety.name,
            "mode": robot.mode.name,
            "tcp": list(robot.outputs["actual_TCP_pose"]),
            "joints": list(robot.arm.joints),
            "twist": [*robot.twist[0], *robot.twist[1]],
            "rtde_clients": len(sessions),
            "clients": len(clients),
            "dropped": self._dropped + sum(session.dropped for session in sessions),
        }

    def lines(self) -> list[str]:
        """Return what has happened so far, oldest first."""
        return self._robot.lines()

    def close(self) -> None:
        """Close all sockets."""
        for file in list(self._clients):
            self._drop(file)
        for listener in self._listeners.values():
            listener.close()
        self._listeners.clear()

    def _accept(self, listener: socket.socket) -> None:
        with contextlib.suppress(OSError):
            accepted, _ = listener.accept()
            port = listener.getsockname()[1]
            connection = Connection(accepted)
            if len(self._clients) >= MOST_CLIENTS:
                connection.send(_one_too_many(port))
                connection.close()
                return
            client: _Client
            if port == RTDE_PORT:
                client = _RtdeClient(connection, RtdeSession(self._robot, self._owners, self._faults))
            elif port == SCRIPT_PORT:
                client = _ScriptClient(connection, ProgramReader())
            else:
                client = _DashboardClient(connection)
                if ControllerFault.WITHHOLD_GREETING not in self._faults:
                    connection.send(f"{GREETING}\n".encode())
            self._clients[connection.file] = client

    def _take_bytes(self, file: int, client: _Client, data: bytes, now: float) -> None:
        match client:
            case _RtdeClient():
                try:
                    alive = client.connection.send(client.session.feed(data))
                except FramingError as error:
                    self._dropped += 1
                    self._robot.note("unreadable", why=error)
                    alive = False
            case _ScriptClient():
                alive = True
                for uploaded in client.reader.feed(data):
                    self._upload(uploaded, now)
            case _DashboardClient():
                alive = self._talk(client, data)
        if not alive:
            self._drop(file)

    def _talk(self, client: _DashboardClient, data: bytes) -> bool:
        *lines, client.line = (client.line + data).split(b"\n")
        for raw in lines:
            line = raw.decode(errors="replace").strip()
            if not client.connection.send(f"{self._dashboard.reply(line)}\n".encode()) or line == "quit":
                return False
        return len(client.line) <= _LONGEST_LINE

    def _upload(self, uploaded: UploadedProgram, now: float) -> None:
        self._robot.note("uploaded", name=uploaded.name, kind=uploaded.kind.value, waypoints=len(uploaded.path))
        if self._late:
            self._uploads.append((now + self._late, uploaded))
        else:
            self._start(uploaded)

    def _start(self, uploaded: UploadedProgram) -> None:
        self._robot.start_program(program_of(uploaded, self._robot), uploaded.name)

    def _drop(self, file: int, *, reset: bool = False) -> None:
        client = self._clients.pop(file)
        if isinstance(client, _RtdeClient):
            self._dropped += client.session.dropped
            client.session.close()
        client.connection.close(reset=reset)
