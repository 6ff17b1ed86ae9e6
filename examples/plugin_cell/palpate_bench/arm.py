"""The client of the arm: a thread reads its states, the control loop takes the newest and sends velocities."""

import contextlib
import socket
import threading
from collections import deque
from time import monotonic, sleep

from palpate.errors import vector
from palpate.hw.devices import DeviceError, WireError
from palpate.hw.round_trip_clock import RoundTrip, RoundTripClock
from palpate.runtime.data import ArmSample
from palpate.runtime.watchdog import DeviceWatchdog
from palpate.spatial import ZERO, Vector
from palpate_bench.arm_lines import ArmState, read_state

START_WITHIN = 2.0
"""[s] to connect, and to receive states whose age is proven."""

STAND_WITHIN = 0.5
"""[s] Longest wait for the arm to stand still when it is closed."""

AT_REST = 1e-4
"""[m/s, rad/s] Speed below which it stands still."""

ECHO_EVERY = 0.01
"""[s] A round trip is measured so often, whatever else is sent."""

MOST_PENDING = 4096
"""Lines whose echo is awaited; it is silent long before."""

SEE = "look at it"


class BenchArm:
    """An `ArmDevice`."""

    def __init__(self, address: str, port: int, watchdog: float, silent_after: float) -> None:
        """Open nothing yet.

        Args:
            address: Of the arm.
            port: TCP.
            watchdog: Time without commands after which it stops by itself [s].
            silent_after: Age of the newest state at which it counts as lost [s].
        """
        self.address, self.port, self.watchdog, self.silent_after = address, port, watchdog, silent_after
        self.name = f"bench arm at {address}"
        self._socket: socket.socket | None = None

    def start(self) -> None:
        """Connect and wait for states; the arm stands still.

        Raises:
            DeviceError: It cannot be reached, or sends nothing.
        """
        self.close()
        try:
            opened = socket.create_connection((self.address, self.port), START_WITHIN)
        except OSError as error:
            raise WireError(
                self.name, f"cannot be reached: {error.strerror or error}", "check power and cable"
            ) from None
        opened.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket, self._sending = opened, threading.Lock()
        self._count, self._sent = 0, deque[tuple[int, float]](maxlen=MOST_PENDING)
        self._clock, self._newest = RoundTripClock(), None
        threading.Thread(target=self._receive, args=(opened,), daemon=True).start()
        threading.Thread(target=self._echo, args=(opened,), daemon=True).start()
        deadline = monotonic() + START_WITHIN
        while self._newest is None:
            if monotonic() > deadline:
                self.close()
                raise WireError(self.name, f"sends no states within {START_WITHIN:g} s", "check its power")
            sleep(0.001)

    def read(self) -> ArmSample:
        """Return the newest state.

        Raises:
            DeviceError: It is silent, or has stopped by itself.
        """
        sample, state = self._fresh()
        if state.stopped:
            raise DeviceError(self.name, "stopped by its watchdog", "run again; was this computer too busy?")
        return sample

    def read_stopped(self) -> ArmSample:
        """Return the newest state, stopped or not.

        Raises:
            DeviceError: There is none.
        """
        return self._fresh()[0]

    def move(self, velocity_base_tip: Vector, angular_velocity_base_tip: Vector) -> None:
        """Move so until commanded otherwise.

        Raises:
            DeviceError: It cannot be reached any more.
            InvalidValueError: Not three finite numbers each.
        """
        vector("velocity_base_tip", velocity_base_tip, 3, "m/s")
        vector("angular_velocity_base_tip", angular_velocity_base_tip, 3, "rad/s")
        numbers = " ".join(f"{x:.12g}" for x in (*velocity_base_tip, *angular_velocity_base_tip))
        self._send("v", numbers)

    def close(self) -> None:
        """Stop the arm, wait until it stands still, and disconnect; any number of times."""
        opened = self._socket
        if opened is None:
            return
        with contextlib.suppress(DeviceError):
            self.move(ZERO, ZERO)
            stop, deadline = self._count, monotonic() + STAND_WITHIN
            while not self._at_rest_since(stop) and monotonic() < deadline:
                sleep(0.001)
        self._socket = None
        with contextlib.suppress(OSError):
            opened.shutdown(socket.SHUT_RDWR)
        opened.close()

    def watchdogs(self) -> tuple[DeviceWatchdog, ...]:
        """What stops it if this program cannot."""
        return (DeviceWatchdog(self.name, "stops by itself", self.watchdog, SEE),)

    def _at_rest_since(self, command: int) -> bool:
        """Whether the arm stands still in a state that it sent after a command."""
        if self._newest is None or self._newest[1].echo < command:
            return False
        state = self._newest[1]
        return max(map(abs, (*state.velocity, *state.angular_velocity))) < AT_REST

    def _fresh(self) -> tuple[ArmSample, ArmState]:
        newest = None if self._socket is None else self._newest
        if newest is None:
            raise DeviceError(self.name, "not started", "start it first")
        if monotonic() - newest[0].time > self.silent_after:
            raise WireError(self.name, f"silent for {self.silent_after:g} s", "check power and cable")
        return newest

    def _send(self, mark: str, words: str = "") -> None:
        opened = self._socket
        if opened is None:
            raise DeviceError(self.name, "not started", "start it first")
        with self._sending:
            self._count += 1
            self._sent.append((self._count, monotonic()))
            try:
                opened.sendall(f"{mark} {self._count} {words}\n".encode())
            except OSError as error:
                raise WireError(self.name, f"connection lost: {error.strerror}", "check power and cable") from None

    def _echo(self, opened: socket.socket) -> None:
        with contextlib.suppress(DeviceError):
            while self._socket is opened:
                self._send("e")
                sleep(ECHO_EVERY)

    def _receive(self, opened: socket.socket) -> None:
        rest, echoed = b"", 0
        with contextlib.suppress(OSError):
            while data := opened.recv(4096):
                seen = monotonic()
                *lines, rest = (rest + data).split(b"\n")
                for line in lines:
                    try:
                        state = read_state(line)
                    except ValueError:  # garbled: the next one counts
                        continue
                    sent = self._sent_at(state.echo) if state.echo > echoed else None
                    echoed = max(echoed, state.echo)
                    if sent is not None:
                        self._clock.prove([RoundTrip(state.cycle, sent, seen)])
                    if self._clock.paced:
                        self._newest = self._sample(state, self._clock.stamp(state.cycle, seen)), state

    def _sent_at(self, echo: int) -> float | None:
        """When the line with this number was sent [s]; what went before is forgotten."""
        while self._sent and self._sent[0][0] < echo:
            self._sent.popleft()
        return self._sent[0][1] if self._sent and self._sent[0][0] == echo else None

    def _sample(self, state: ArmState, time: float) -> ArmSample:
        return ArmSample(
            time,
            state.pose.position,
            state.pose.rotation,
            state.velocity,
            angular_velocity_base_tip=state.angular_velocity,
        )
