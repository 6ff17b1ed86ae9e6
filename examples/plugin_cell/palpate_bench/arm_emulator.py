"""The arm as a server of `palpate.hw.emulators`: it moves whatever plant stands behind it."""

import socket
from collections.abc import Sequence
from math import inf
from time import monotonic

from palpate.errors import InvalidValueError
from palpate.hw.emulators.connection import Connection
from palpate.hw.emulators.server import PlantState
from palpate.kinematics.pose import Pose
from palpate.spatial import ZERO, Vector
from palpate_bench.arm_lines import ArmState

FAULTS = ("silent", "stopped")


class BenchArmServer:
    """An `ArmServer`; one client at a time."""

    name = "bench arm"

    def __init__(self, address: str, port: int, watchdog: float) -> None:
        """Listen.

        Raises:
            InvalidValueError: The address is not free.
        """
        self.address, self._watchdog = address, watchdog
        self._listener = socket.socket()
        self._listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            self._listener.bind((address, port))
        except OSError as error:
            self._listener.close()
            raise InvalidValueError(f"address = {address}, port {port}: {error.strerror}") from None
        self._listener.listen()
        self._listener.setblocking(False)
        self._client: Connection | None = None
        self._faults = dict.fromkeys(FAULTS, 0.0)
        self._cycle = 0
        self._forget()

    def files(self) -> Sequence[int]:
        """Those to wait for."""
        return (self._listener.fileno(), *(() if self._client is None else (self._client.file,)))

    def receive(self, file: int, now: float) -> None:
        """Accept a client, or read what it sends."""
        if file == self._listener.fileno():
            self._drop()
            self._client = Connection(self._listener.accept()[0])
            return
        data = None if self._client is None else self._client.read()
        if data is None:
            self._drop()
            return
        *lines, self._rest = (self._rest + data).split(b"\n")
        for line in lines:
            self._obey(line, now)

    def due(self) -> float:
        """Never by itself: it does what the plant's steps ask for."""
        return inf

    def tick(self, now: float) -> None:
        """Nothing."""

    def take(self, state: PlantState) -> None:
        """Send the new state; stop if no command has come for too long."""
        self._cycle += 1
        if self._commanded is not None and monotonic() - self._commanded > self._watchdog:
            self._stop()
        arm = state.arm
        pose = Pose(arm.position_base_tip, arm.rotation_base_tip)
        told = ArmState(
            self._cycle,
            self._echo,
            self._stopped or bool(self._faults["stopped"]),
            pose,
            arm.velocity_base_tip,
            arm.angular_velocity_base_tip,
        )
        if self._client is not None and not self._faults["silent"] and not self._client.send(told.line()):
            self._drop()

    def velocity(self) -> tuple[Vector, Vector]:
        """With which the plant's arm is to move."""
        return self._velocity

    def inject(self, fault: str, value: float) -> str:
        """Switch a fault.

        Raises:
            InvalidValueError: There is no such one.
        """
        if fault not in FAULTS:
            raise InvalidValueError(f"fault {fault!r} is unknown: must be one of {', '.join(FAULTS)}")
        self._faults[fault] = value
        if fault == "stopped" and value:
            self._velocity = (ZERO, ZERO)
        return f"{self.name}: {fault} = {value:g}"

    def close(self) -> None:
        """Close all sockets."""
        self._drop()
        self._listener.close()

    def _obey(self, line: bytes, now: float) -> None:
        try:
            mark, count, *numbers = line.split()
            self._echo = int(count)
            if mark == b"v":
                vx, vy, vz, wx, wy, wz = map(float, numbers)
                moves = any((vx, vy, vz, wx, wy, wz))
                self._commanded = now if moves else None
                if not (self._stopped or self._faults["stopped"]):
                    self._velocity = ((vx, vy, vz), (wx, wy, wz))
        except ValueError:  # garbled
            self._stop()

    def _stop(self) -> None:
        self._stopped, self._velocity, self._commanded = True, (ZERO, ZERO), None

    def _drop(self) -> None:
        if self._client is not None:
            self._client.close()
        self._client = None
        self._forget()

    def _forget(self) -> None:
        """Be as after switching on; a client that is gone leaves it standing."""
        self._echo, self._stopped, self._rest = 0, False, b""
        self._velocity: tuple[Vector, Vector] = (ZERO, ZERO)
        self._commanded: float | None = None
