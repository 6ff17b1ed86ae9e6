"""The controller on its sockets: RTDE, script port and dashboard."""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

from palpate.errors import InvalidValueError
from palpate.hw.emulators.connection import Connection, Talk, TcpServer
from palpate.hw.emulators.host import Host
from palpate.hw.emulators.server import PlantState, fault_named
from palpate.hw.emulators.simple_plant import ElasticPlane, SimplePlant, SimpleTip
from palpate.hw.emulators.ur.arm import STILL, ArmMounting
from palpate.hw.emulators.ur.commands import program_of
from palpate.hw.emulators.ur.controller import ControllerVersion, EmulatedController
from palpate.hw.emulators.ur.dashboard import GREETING, DashboardServer, DashboardTalk
from palpate.hw.emulators.ur.rtde import (
    ControllerFault,
    PackageType,
    RtdeSession,
    package,
    text_message,
)
from palpate.hw.emulators.ur.script import ProgramReader, UploadedProgram
from palpate.spatial import Vector

RTDE_PORT, SCRIPT_PORT, DASHBOARD_PORT = 30004, 30003, 29999
"""Fixed in ur_rtde; the address is not."""

MOST_CLIENTS = 100
"""Connections; one more is refused with a message. `select` takes 1024 descriptors, of all devices together."""

_ROUNDING = 1e-9
"""[s] of rounding between the plant's clock and the controller's cycles."""

_ERROR = 1
"""Level of a text message."""


class UrServer:
    """Arm with its controller at one address.

    Attributes:
        name: Name for faults and messages.
        address: IP address for clients.
    """

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
            address: Address of this controller alone, since ports are fixed: one of the loopback net unless others
                are to reach it.
            version: Version of its software; None: 5.14.0.1.
            mounting: Mounting of the arm in the plant; None: a UR5e at its origin.
            name: Name for faults.
            unlock_delay: Time for which a protective stop cannot be unlocked [s]; 5 on a robot.

        Raises:
            InvalidValueError: If the address is not free, or none of this machine.
        """
        self.name, self.address = name, address
        version = ControllerVersion() if version is None else version
        self._robot = EmulatedController(version, ArmMounting() if mounting is None else mounting, unlock_delay)
        self._dashboard = DashboardServer(self._robot)
        self._faults: set[ControllerFault] = set()
        self._owners: dict[str, RtdeSession] = {}
        self._late = 0.0
        self._uploads: deque[tuple[float, UploadedProgram]] = deque()
        self._next = 0.0
        self._fresh = False
        ports = {RTDE_PORT: self._rtde, SCRIPT_PORT: lambda _: ProgramReader(self._upload)}
        if version.has_dashboard:
            ports[DASHBOARD_PORT] = self._screen
        try:
            self._tcp = TcpServer(address, ports, MOST_CLIENTS, _refusal)
        except OSError as error:
            raise InvalidValueError(
                f"address = {address!r}: {error.strerror}; another emulator may be running there: end it, or take "
                "another address of 127.0.0.0/8"
            ) from error

    def files(self) -> Sequence[int]:
        """See `Server`."""
        return self._tcp.files()

    def receive(self, file: int, now: float) -> None:
        """See `Server`."""
        self._tcp.receive(file, now)

    def due(self) -> float:
        """Return when a late program is to start."""
        return self._uploads[0][0] if self._uploads else math.inf

    def tick(self, now: float) -> None:
        """Start programs that are due."""
        while self._uploads and self._uploads[0][0] <= now:
            self._start(self._uploads.popleft()[1])

    def take(self, state: PlantState) -> None:
        """Measure, and stream the measurements, once per cycle of the controller."""
        if state.time < self._next - _ROUNDING:
            return
        # a plant whose periods are longer than the controller's has one cycle for each of them
        self._next = max(self._next + self._robot.period, state.time)
        self._robot.measure(state)
        self._fresh = True
        for file, session in self._sessions().items():
            connection, data = self._tcp.clients[file].connection, session.stream()
            # a client that does not read misses packages, as with the real controller
            if not connection.send(data if connection.clear else b""):
                self._tcp.drop(file)

    def velocity(self) -> tuple[Vector, Vector]:
        """Run one cycle, if a new measurement has come, and return the twist of the plant's tip."""
        robot = self._robot
        if self._fresh:
            self._fresh = False
            robot.cycle()
        return STILL if robot.twist == STILL else robot.arm.tip_velocity(robot.twist)

    def inject(self, fault: str, value: float) -> str:
        """Switch one of `ControllerFault`.

        Raises:
            InvalidValueError: If there is no such fault; the message lists those that exist.
        """
        switch, robot = fault_named(ControllerFault, fault), self._robot
        robot.note("fault", fault=fault, value=value)
        match switch:
            case ControllerFault.DROP_FIN | ControllerFault.DROP_RST:
                dropped = list(self._sessions())
                for file in dropped:
                    self._tcp.drop(file, reset=switch is ControllerFault.DROP_RST)
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
        """Return the state of the controller, for tests."""
        robot = self._robot
        return {
            "runtime": robot.runtime.name,
            "safety": robot.safety.name,
            "mode": robot.mode.name,
            "tcp": list(robot.outputs["actual_TCP_pose"]),
            "joints": list(robot.arm.joints),
            "twist": [*robot.twist[0], *robot.twist[1]],
            "rtde_clients": len(self._sessions()),
            "clients": len(self._tcp.clients),
            "dropped": robot.dropped,
        }

    def lines(self) -> list[str]:
        """Return the log, oldest first."""
        return self._robot.lines()

    def close(self) -> None:
        """Close all sockets."""
        self._tcp.close()

    def _sessions(self) -> dict[int, RtdeSession]:
        return {file: c.talk for file, c in self._tcp.clients.items() if isinstance(c.talk, RtdeSession)}

    def _rtde(self, connection: Connection) -> Talk:
        return RtdeSession(self._robot, self._owners, self._faults)

    def _screen(self, connection: Connection) -> Talk:
        if ControllerFault.WITHHOLD_GREETING not in self._faults:
            connection.send(f"{GREETING}\n".encode())
        return DashboardTalk(self._dashboard)

    def _upload(self, uploaded: UploadedProgram, now: float) -> None:
        self._robot.note("uploaded", name=uploaded.name, control=uploaded.is_control)
        if self._late:
            self._uploads.append((now + self._late, uploaded))
        else:
            self._start(uploaded)

    def _start(self, uploaded: UploadedProgram) -> None:
        self._robot.start_program(program_of(uploaded, self._robot), uploaded.name)


def _refusal(talk: Talk) -> bytes:
    sentence = f"{MOST_CLIENTS} connections to this controller already: close one"
    if isinstance(talk, RtdeSession):
        return package(PackageType.TEXT, text_message(sentence, "emulator", _ERROR))
    return f"{sentence}\n".encode()


@dataclass(frozen=True, slots=True)
class SimpleUr:
    """Factory of a whole emulated robot on the built-in plant, for `EmulatorProcess`.

    Attributes:
        address: See `UrServer`.
        version: Version of its software.
        plane: Plane that the tip may touch; None for nothing.
        scale: Seconds of the robot per second of wall time.
        unlock_delay: See `UrServer`.
    """

    address: str = "127.0.0.2"
    version: ControllerVersion | None = None
    plane: ElasticPlane | None = None
    scale: float = 1.0
    unlock_delay: float = 5.0

    def __call__(self) -> Host:
        """Return a host that is ready to run."""
        server = UrServer(self.address, self.version, unlock_delay=self.unlock_delay)
        return Host(SimplePlant(SimpleTip(plane=self.plane)), [server], scale=self.scale)
