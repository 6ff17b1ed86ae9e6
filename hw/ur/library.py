"""The part of ur_rtde that is used, and nothing else; only the client process imports it.

ur_rtde 1.6.5 has calls that must not be made: real-time getters that reply with old registers, forward and
inverse kinematics (the one takes the last command's numbers for the tool, the other ends the program),
setExternalForceTorque (wrong recipe), upper range registers (wrong offset), analog outputs (an uninitialised
number), stopL and stopJ (the script takes one for the other), servoC (works every other time), waitPeriod (whole
milliseconds), and reconnect (hangs, or is at it for ever). The protocols below leave them out.
"""
# ruff: noqa: D102 -- what the calls mean is the library's manual

from collections.abc import Sequence
from importlib import import_module
from typing import Protocol, cast

from palpate.hw.round_trip_clock import RoundTrip
from palpate.hw.ur.echo import Echo
from palpate.hw.ur.hello import DASHBOARD_PORT, dashboard_greeting
from palpate.hw.ur.problems import UrRefusal
from palpate.hw.ur.version import Version, has_raw_wrench

Numbers = list[float]

RECEIVED = (
    "timestamp",
    "actual_q",
    "actual_qd",
    "actual_TCP_pose",
    "actual_TCP_speed",
    "actual_TCP_force",
    "actual_tool_accelerometer",
    "runtime_state",
    "robot_mode",
    "safety_mode",
    "safety_status_bits",
    "robot_status_bits",
    "speed_scaling",
    "target_speed_fraction",
)
"""Fewer than the library's 59: a third less time to decode them."""

RAW_WRENCH = "ft_raw_wrench"

LAST = "actual_execution_time"
"""Nobody reads it. The library takes a package that is some bytes too short unseen, and for what it lacks the
bytes of one before: they are this value's."""


class ReceiveClient(Protocol):
    """RTDEReceiveInterface: states of the controller, decoded in a thread of its own."""

    def isConnected(self) -> bool: ...
    def getTimestamp(self) -> float: ...
    def getActualQ(self) -> Numbers: ...
    def getActualQd(self) -> Numbers: ...
    def getActualTCPPose(self) -> Numbers: ...
    def getActualTCPSpeed(self) -> Numbers: ...
    def getActualTCPForce(self) -> Numbers: ...
    def getFtRawWrench(self) -> Numbers: ...
    def getActualToolAccelerometer(self) -> Numbers: ...
    def getRuntimeState(self) -> int: ...
    def getRobotMode(self) -> int: ...
    def getSafetyMode(self) -> int: ...
    def getSafetyStatusBits(self) -> int: ...
    def getSpeedScaling(self) -> float: ...
    def getTargetSpeedFraction(self) -> float: ...


class ControlClient(Protocol):
    """RTDEControlInterface: commands for the script that it loads into the controller. One thread at a time."""

    def isConnected(self) -> bool: ...
    def reuploadScript(self) -> bool: ...
    def stopScript(self) -> None: ...
    def setWatchdog(self, min_frequency: float) -> bool: ...
    def kickWatchdog(self) -> bool: ...
    def setTcp(self, tcp_offset: Numbers, /) -> bool: ...
    def setPayload(self, mass: float, cog: Numbers, /) -> bool: ...
    def zeroFtSensor(self) -> bool: ...
    def speedL(self, xd: Numbers, acceleration: float, time: float) -> bool: ...
    def speedStop(self, a: float) -> bool: ...
    def servoJ(
        self, q: Numbers, speed: float, acceleration: float, time: float, lookahead: float, gain: float, /
    ) -> bool: ...
    def servoL(
        self, pose: Numbers, speed: float, acceleration: float, time: float, lookahead: float, gain: float, /
    ) -> bool: ...
    def servoStop(self, a: float) -> bool: ...
    def forceMode(
        self, frame: Numbers, selection: list[int], wrench: Numbers, kind: int, limits: Numbers, /
    ) -> bool: ...
    def forceModeStop(self) -> bool: ...
    def freedriveMode(self) -> bool: ...
    def endFreedriveMode(self) -> bool: ...


class PendantClient(Protocol):
    """DashboardClient: what somebody at the pendant would press."""

    def connect(self) -> None: ...
    def disconnect(self) -> None: ...
    def isInRemoteControl(self) -> bool: ...
    def unlockProtectiveStop(self) -> None: ...
    def closeSafetyPopup(self) -> None: ...
    def powerOn(self) -> None: ...
    def brakeRelease(self) -> None: ...


class Slider(Protocol):
    """RTDEIOInterface: the speed slider."""

    def setSpeedSlider(self, speed: float, /) -> bool: ...


class EchoClient(Protocol):
    """What proves how old states are; not of ur_rtde, which cannot read an input register back."""

    @property
    def connected(self) -> bool: ...
    def exchange(self, now: float) -> Sequence[RoundTrip]: ...


class Library(Protocol):
    """Makes the connections; a module will do."""

    def receiver(self, address: str, rate: float, version: Version) -> ReceiveClient: ...
    def echo(self, address: str, rate: float) -> EchoClient: ...
    def controls(self, address: str, rate: float) -> ControlClient: ...
    def dashboard(self, address: str) -> PendantClient: ...
    def slider(self, address: str) -> Slider: ...


def receiver(address: str, rate: float, version: Version) -> ReceiveClient:
    """Connect for states at `rate` [Hz]. Dead on arrival, without an exception, if the controller sends none."""
    from rtde_receive import RTDEReceiveInterface

    raw = [RAW_WRENCH] if has_raw_wrench(version) else []
    names = [*RECEIVED, *raw, LAST]
    return cast(ReceiveClient, RTDEReceiveInterface(address, rate, names))


def echo(address: str, rate: float) -> EchoClient:
    """Connect for echoes, once per cycle at `rate` [Hz]."""
    return Echo(address, rate)


def controls(address: str, rate: float) -> ControlClient:
    """Connect for commands and load the script: lower registers, no waiting for anybody at the pendant."""
    from rtde_control import RTDEControlInterface

    return cast(ControlClient, RTDEControlInterface(address, rate, RTDEControlInterface.FLAG_UPLOAD_SCRIPT))


def dashboard(address: str) -> PendantClient:
    """Return a client of the dashboard that is not connected yet.

    Raises:
        UrRefusal: The dashboard does not greet: the library would wait for it, and not say what it received.
    """
    from dashboard_client import DashboardClient

    try:
        dashboard_greeting(address)
    except OSError as error:
        raise UrRefusal(
            f"its dashboard server on port {DASHBOARD_PORT} does not greet ({error})",
            "restart the controller, and see that nothing in between holds the connection up",
        ) from error

    return cast(PendantClient, DashboardClient(address))


def slider(address: str) -> Slider:
    """Connect for the speed slider."""
    from rtde_io import RTDEIOInterface

    return cast(Slider, RTDEIOInterface(address))


def library_named(name: str) -> Library:
    """Return the module of that name."""
    return cast(Library, import_module(name))
