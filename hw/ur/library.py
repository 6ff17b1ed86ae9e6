"""The part of ur_rtde that is used, and nothing else; only the client process imports the library itself.

ur_rtde 1.6.5 has calls that must not be made: real-time getters that reply with old registers, forward and
inverse kinematics (one takes the numbers of the last command for the tool, the other ends the program),
setExternalForceTorque (wrong recipe), upper range registers (wrong offset), analog outputs (an uninitialised
number), stopL and stopJ (the script takes one for the other), servoC (works every other time), waitPeriod (whole
milliseconds), and reconnect (hangs, or never ends). The protocols below leave them out.
"""
# ruff: noqa: D102 -- the library's manual documents the calls

import os
import platform
from collections.abc import Sequence
from importlib import import_module
from importlib.util import find_spec
from typing import Protocol, cast

from palpate.extras import MissingLibraryError
from palpate.hw.round_trip_clock import RoundTrip
from palpate.hw.ur.exchange import READINGS
from palpate.hw.ur.problems import UrRefusal
from palpate.hw.ur.rtde import DASHBOARD_PORT, Echo, dashboard_greeting

HAS_WHEELS = "CPython 3.11 and 3.12 on Linux x86-64"
"""Computers with wheels of ur_rtde 1.6.5 on which the client process runs: it needs Linux."""

ENVIRONMENT = "python3.12 -m venv .venv-ur && .venv-ur/bin/pip install palpate"
"""Commands that make an environment with ur_rtde; from a clone with `.` in place of `palpate`."""

LAST = "actual_execution_time"
"""Variable that is not used. The library accepts a package that is some bytes too short, and keeps for the missing
bytes those of the package before: they are this value's."""

RECEIVED = ("timestamp", *(variable for variable, _ in READINGS.values()), LAST)
"""Variables of a state; fewer than the library's 59 by default, which takes a third less time to decode."""

Numbers = list[float]


def is_supported() -> bool:
    """Return whether this computer can drive a UR arm."""
    return find_spec("rtde_control") is not None and hasattr(os, "memfd_create")


def refuse_unsupported() -> None:
    """Refuse a UR arm where it cannot be driven, before anything is connected.

    Raises:
        MissingLibraryError: If ur_rtde is not installed, or this is not Linux.
    """
    if is_supported():
        return
    here = f"{platform.python_implementation()} {platform.python_version()}"
    raise MissingLibraryError(
        f"a UR arm needs ur_rtde, which exists for {HAS_WHEELS}, and is not to be had here ({here} on "
        f"{platform.system()} {platform.machine()}); where it exists: {ENVIRONMENT} (in a clone: pip install .)",
        name="rtde_control",
    )


class ReceiveClient(Protocol):
    """RTDEReceiveInterface: states of the controller, decoded in a thread of its own.

    The getters of the values are named in the fields of `UrState`.
    """

    def isConnected(self) -> bool: ...
    def getTimestamp(self) -> float: ...


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


class PendantClient(Protocol):
    """DashboardClient: buttons of the pendant."""

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
    """Proof of the age of states: see `Echo`."""

    @property
    def connected(self) -> bool: ...
    def exchange(self, now: float) -> Sequence[RoundTrip]: ...


class Library(Protocol):
    """Module that makes the connections."""

    def receiver(self, address: str, rate: float) -> ReceiveClient: ...
    def echo(self, address: str, rate: float) -> EchoClient: ...
    def controls(self, address: str, rate: float) -> ControlClient: ...
    def dashboard(self, address: str) -> PendantClient: ...
    def slider(self, address: str) -> Slider: ...


def receiver(address: str, rate: float) -> ReceiveClient:
    """Connect for states at `rate` [Hz]. If the controller refuses, the client is disconnected from the start."""
    from rtde_receive import RTDEReceiveInterface

    return cast(ReceiveClient, RTDEReceiveInterface(address, rate, [*RECEIVED]))


def echo(address: str, rate: float) -> EchoClient:
    """Connect for echoes, once per cycle at `rate` [Hz]."""
    return Echo(address, rate)


def controls(address: str, rate: float) -> ControlClient:
    """Connect for commands and load the script: lower registers, no waiting for a person at the pendant."""
    from rtde_control import RTDEControlInterface

    return cast(ControlClient, RTDEControlInterface(address, rate, RTDEControlInterface.FLAG_UPLOAD_SCRIPT))


def dashboard(address: str) -> PendantClient:
    """Return a client of the dashboard that is not connected yet.

    Raises:
        UrRefusal: If the dashboard does not greet: the library would wait for it, and not show what it received.
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
