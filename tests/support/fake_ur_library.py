"""A client library without a connection: its controller is simulated in the client process.

The address is a folder: calls are logged to `calls` there, and a file `fault` names the fault from then on.
"""

import os
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

from palpate.hw.round_trip_clock import RoundTrip

CYCLE = 0.002
REST = [0.1, 0.2, 0.3, 0.0, 0.0, 0.0]


class FakeController:
    def __init__(self, folder: str) -> None:
        self.folder = Path(folder)
        self.begin = time.monotonic()
        self.twist, self.position, self.moved = [0.0] * 6, list(REST), 0.0
        self.running = False
        self.calls = (self.folder / "calls").open("a", buffering=1)
        self.fault_path = str(self.folder / "fault")
        self._inside = threading.Lock()

    def fault(self) -> str:
        try:
            with open(self.fault_path) as file:
                return file.read()
        except OSError:
            return ""

    def clock(self) -> float:
        return 100.0 + CYCLE * round((time.monotonic() - self.begin) / CYCLE)

    def advance(self) -> None:
        now = time.monotonic()
        if self.running:
            self.position = [p + v * (now - self.moved) for p, v in zip(self.position, self.twist, strict=True)]
        self.moved = now

    def call(self, name: str, *values: object) -> bool:
        if not self._inside.acquire(blocking=False):
            self.calls.write("CONCURRENT\n")
            return False
        try:
            self.advance()
            self.calls.write(f"{name} {threading.current_thread().name} {values}\n")
            if name not in ("speedL", "kickWatchdog"):
                time.sleep(2 * CYCLE)
            return self.fault() != "refuse"
        finally:
            self._inside.release()


_controller: FakeController | None = None


def _of(address: str) -> FakeController:
    global _controller
    if _controller is None:
        _controller = FakeController(address)
    return _controller


def forget() -> None:
    """Let the next connection make a new controller."""
    global _controller
    if _controller is not None:
        _controller.calls.close()
    _controller = None


class FakeReceiver:
    """Every getter replies for the present cycle, as the real ones do."""

    def __init__(self, controller: FakeController) -> None:
        self.c = controller
        self.frozen = 0.0

    def isConnected(self) -> bool:
        return self.c.fault() != "receive lost"

    def getTimestamp(self) -> float:
        fault = self.c.fault()
        if fault == "crash":
            os.kill(os.getpid(), 11)
        if fault == "hang":
            time.sleep(1000.0)
        if fault == "storm":
            sys.stderr.write("RTDEControlInterface: Robot is disconnected, reconnecting...\n")
            sys.stderr.flush()
        if fault == "back":
            return 1.0
        if fault != "silent":
            self.frozen = self.c.clock()
        return self.frozen

    def _six(self) -> list[float]:
        stamp = self.c.clock()  # all values of a state carry its time stamp: torn ones would be seen
        time.sleep(1e-5)
        return [stamp, 0.0, 0.0, 0.0, 0.0, 0.0]

    def __getattr__(self, name: str):
        return self._six  # joints and wrenches

    def getActualTCPSpeed(self) -> list[float]:
        return list(self.c.twist)

    def getActualTCPPose(self) -> list[float]:
        self.c.advance()
        return list(self.c.position)

    def getRuntimeState(self) -> int:
        return 2 if self.c.running and self.c.fault() != "stopped" else 1

    def getRobotMode(self) -> int:
        return 7

    def getSafetyStatusBits(self) -> int:
        return {"protective": 1 << 2, "emergency": 1 << 7}.get(self.c.fault(), 1)

    def getSpeedScaling(self) -> float:
        return 1.0

    def getTargetSpeedFraction(self) -> float:
        return 1.0


class FakeEcho:
    """Echo without a delay."""

    connected = True

    def __init__(self, clock: Callable[[], float]) -> None:
        self.clock = clock

    def exchange(self, now: float) -> list[RoundTrip]:
        sent = time.monotonic()
        return [RoundTrip(self.clock(), sent, time.monotonic())]


class Logged:
    """Logs every call that is not simulated."""

    def __init__(self, controller: FakeController) -> None:
        self.c = controller

    def __getattr__(self, name: str):
        return lambda *values: self.c.call(name, *values)


class FakeControls(Logged):
    def __init__(self, controller: FakeController) -> None:
        super().__init__(controller)
        controller.call("upload")
        controller.running = True

    def isConnected(self) -> bool:
        return self.c.fault() != "control lost"

    def speedL(self, xd: list[float], acceleration: float, seconds: float) -> bool:
        done = self.c.call("speedL", xd)
        self.c.twist = list(xd)
        return done

    def speedStop(self, a: float) -> bool:
        done = self.c.call("speedStop")
        self.c.twist = [0.0] * 6
        return done

    def stopScript(self) -> None:
        self.c.call("stopScript")
        self.c.running = False

    def zeroFtSensor(self) -> bool:
        if self.c.fault() == "deaf":
            time.sleep(1000.0)
        return self.c.call("zeroFtSensor")


class FakeDashboard(Logged):
    def isInRemoteControl(self) -> bool:
        return self.c.fault() != "local"

    def unlockProtectiveStop(self) -> None:
        self.c.call("unlockProtectiveStop")
        if self.c.fault() == "protective":
            os.unlink(self.c.fault_path)


def receiver(address: str, rate: float) -> FakeReceiver:
    return FakeReceiver(_of(address))


def echo(address: str, rate: float) -> FakeEcho:
    return FakeEcho(_of(address).clock)


def controls(address: str, rate: float) -> FakeControls:
    return FakeControls(_of(address))


def dashboard(address: str) -> FakeDashboard:
    return FakeDashboard(_of(address))


slider = dashboard
