"""Loop that serves emulated devices and steps the plant behind them.

`select` with absolute deadlines: its time-outs are in microseconds, those of epoll and poll in milliseconds, which
is half a period here.
"""

import select
import time
from collections.abc import Mapping, Sequence
from typing import Protocol, runtime_checkable

from palpate.errors import InvalidValueError, positive
from palpate.hw.emulators.control import ControlSocket
from palpate.hw.emulators.server import ArmServer, Plant, Server, ServoServer
from palpate.spatial import ZERO

MOST_BEHIND = 0.05
"""[s] of wall time up to which a stall is caught up with; a longer one is given up whole, and counted."""

_LONGEST_WAIT = 0.1
"""[s] between two checks whether to stop."""


@runtime_checkable
class Monitored(Protocol):
    """Server that reports its internal state to tests; not every server does."""

    def status(self) -> Mapping[str, object]:
        """Return its state: numbers, strings, and lists of them."""
        ...

    def lines(self) -> list[str]:
        """Return the log, oldest first."""
        ...


class Host:
    """Serves devices until it is stopped."""

    def __init__(
        self,
        plant: Plant,
        servers: Sequence[Server],
        scale: float = 1.0,
        control_port: int = 0,
        control_token: str | None = None,
    ) -> None:
        """Start the plant and inform the devices, which listen already.

        Args:
            plant: Mechanics that are moved and measured.
            servers: All devices. An `ArmServer` moves the plant's arm, a `ServoServer` its servos.
            scale: Seconds of the plant per second of wall time.
            control_port: Port of the control socket; 0: a free one.
            control_token: Token that requests to it must carry; None: a new one.

        Raises:
            InvalidValueError: If the scale is not above zero, two devices have one name, or the port is not free.
        """
        names = [server.name for server in servers]
        if len(set(names)) < len(names):
            raise InvalidValueError(f"devices named {', '.join(names)}: each needs a name of its own")
        self._plant, self._servers = plant, list(servers)
        self._arm = next((server for server in servers if isinstance(server, ArmServer)), None)
        self._hand = next((server for server in servers if isinstance(server, ServoServer)), None)
        self._interval = plant.period / positive("scale", scale, "")
        self._by_name = {server.name: server for server in servers}
        self._state = plant.start()
        for server in self._servers:
            server.take(self._state)
        self._control = ControlSocket(self._perform, control_port, control_token)
        self._running, self._closed = True, False
        self._steps = 0
        self._given_up = 0.0
        self._begun = time.monotonic()

    @property
    def control_port(self) -> int:
        """Port of the control socket on 127.0.0.1."""
        return self._control.port

    @property
    def control_address(self) -> str:
        """Port and token of the control socket, as `EmulatorControl` takes them."""
        return self._control.address

    @property
    def addresses(self) -> dict[str, str]:
        """Address of each device by its name."""
        return {server.name: server.address for server in self._servers}

    def run(self, lifeline: int | None = None) -> None:
        """Serve until `stop`, or until the lifeline breaks; then close everything.

        Args:
            lifeline: Descriptor that becomes readable when the parent process is gone.
        """
        try:
            self._loop(lifeline)
        finally:
            self.close()

    def stop(self) -> None:
        """Let `run` return, from any thread, within a tenth of a second."""
        self._running = False

    def close(self) -> None:
        """Close devices, plant and control socket; `run` does so at its end."""
        if self._closed:
            return
        self._closed = True
        for server in self._servers:
            server.close()
        self._control.close()
        self._plant.close()

    def _loop(self, lifeline: int | None) -> None:
        monotonic, interval = time.monotonic, self._interval
        self._begun = step_at = monotonic()
        extra = [] if lifeline is None else [lifeline]
        while self._running:
            owners = {file: server for server in self._servers for file in server.files()}
            control = self._control.files()
            due = min([step_at, *(server.due() for server in self._servers)])
            wait = min(_LONGEST_WAIT, max(0.0, due - monotonic()))
            readable, _, _ = select.select([*owners, *control, *extra], [], [], wait)
            now = monotonic()
            for file in readable:
                if file == lifeline:
                    return
                owner = owners.get(file)
                if owner is not None:
                    owner.receive(file, now)
                else:
                    self._control.receive(file)
            now = monotonic()
            for server in self._servers:
                if server.due() <= now:
                    server.tick(now)
            self._control.flush()
            if now >= step_at:
                self._step()
                step_at += interval
                behind = monotonic() - step_at
                if behind > MOST_BEHIND:
                    step_at += behind
                    self._given_up += behind

    def _step(self) -> None:
        velocity, turning = (ZERO, ZERO) if self._arm is None else self._arm.velocity()
        goals = () if self._hand is None else self._hand.goals()
        self._state = self._plant.step(velocity, turning, goals)
        self._steps += 1
        for server in self._servers:
            server.take(self._state)

    def _perform(self, request: Mapping[str, object]) -> Mapping[str, object]:
        """Carry out a request of the control socket.

        Raises:
            InvalidValueError: If there is no such request.
        """
        match request:
            case {"do": "state"}:
                return self._status()
            case {"do": "fault", "device": str(name), "fault": str(fault), "value": int() | float() as value}:
                return {"done": self._device(name).inject(fault, float(value))}
            case {"do": "log", "device": str(name)}:
                device = self._device(name)
                return {"lines": device.lines() if isinstance(device, Monitored) else []}
            case {"do": "stop"}:
                self._running = False
                return {"done": "stopping"}
            case _:
                raise InvalidValueError(
                    f"request = {dict(request)!r}: must have do = state, log (device), stop, or fault "
                    "(device, fault, value)"
                )

    def _device(self, name: str) -> Server:
        device = self._by_name.get(name)
        if device is None:
            raise InvalidValueError(f"device = {name!r}: there are {', '.join(self._by_name)}")
        return device

    def _status(self) -> dict[str, object]:
        state = self._state
        return {
            "time": state.time,
            "wall": time.monotonic() - self._begun,
            "steps": self._steps,
            "given_up": self._given_up,
            "refused": self._control.refused,
            "position": list(state.arm.position_base_tip),
            "velocity": list(state.arm.velocity_base_tip),
            "wrenches": [list(sample.wrench) for sample in state.wrenches],
            "servos": [[servo.position, servo.velocity, servo.current] for servo in state.servos],
            "devices": {
                name: dict(s.status()) if isinstance(s, Monitored) else {} for name, s in self._by_name.items()
            },
        }
