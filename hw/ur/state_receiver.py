"""States as the client process gets them: one cycle's values together, each cycle once, with our time."""

import math
from collections.abc import Sequence
from typing import NamedTuple

from palpate.hw.round_trip_clock import RoundTripClock
from palpate.hw.ur.exchange import Six, UrState
from palpate.hw.ur.library import EchoClient, ReceiveClient

_UNKNOWN: Six = (math.nan, math.nan, math.nan, math.nan, math.nan, math.nan)
_TRIES = 8
"""Cycles that may pass while one is read; more, and the process is being starved."""


class ControllerRestartedError(ConnectionError):
    """The controller's clock went back."""


class ImpossibleStateError(ConnectionError):
    """Numbers that no controller sends: not finite, or modes that there are not."""


_RUNTIME_STATES = range(6)
_ROBOT_MODES = range(-1, 10)
"""As the maker's RTDE guide numbers them."""


LARGEST = 1000.0
"""Joints [rad, rad/s], pose and velocity of the tool [m, rad, m/s, rad/s]: no arm is ever there."""

LARGEST_LOAD = 1e5
"""[N, N m] Likewise."""

LARGEST_SHARE = 2.0
"""Of speed scaling and slider, which are from 0 to 1."""


class _Read(NamedTuple):
    """One cycle's values."""

    modes: tuple[int, int, int, int]
    speeds: tuple[float, float]
    joint_position: Six
    joint_velocity: Six
    tool_pose: Six
    tool_velocity: Six
    tool_wrench: Six
    raw_wrench: Six
    acceleration: tuple[float, float, float]


class StateReceiver:
    """Looks whether there is a new state, and takes it."""

    def __init__(self, receiver: ReceiveClient, echo: EchoClient, rate: float, *, raw_wrench: bool) -> None:
        """Begin.

        Args:
            receiver: Connected.
            echo: Connected.
            rate: States per second of the controller's time [Hz].
            raw_wrench: Whether the controller has one.
        """
        self._receiver, self._echo, self._rate, self._raw = receiver, echo, rate, raw_wrench
        self._clock = RoundTripClock()
        self._last = -math.inf
        self._lost = 0

    @property
    def connected(self) -> bool:
        """Whether states and echoes come, as far as their connections know."""
        return self._receiver.isConnected() and self._echo.connected

    def take(self, now: float) -> UrState | None:
        """Return the newest state if it is new, and if an echo proves when it was taken.

        The library's getters are not one snapshot: a state counts if the time stamp is the same before and after.

        Args:
            now: [s].

        Raises:
            ControllerRestartedError: Its clock went back.
            ImpossibleStateError: It is none.
        """
        receiver = self._receiver
        self._clock.prove(self._echo.exchange(now))
        for _ in range(_TRIES):
            stamp = receiver.getTimestamp()
            if stamp == self._last or stamp == 0.0 or not self._clock.proven:  # 0: nothing has arrived yet
                return None
            read = self._read()
            if receiver.getTimestamp() == stamp:
                return self._state(stamp, now, read)
        return None

    def _read(self) -> _Read:
        r = self._receiver
        ax, ay, az = r.getActualToolAccelerometer()
        return _Read(
            (r.getRuntimeState(), r.getRobotMode(), r.getSafetyMode(), r.getSafetyStatusBits()),
            (r.getSpeedScaling(), r.getTargetSpeedFraction()),
            _six(r.getActualQ()),
            _six(r.getActualQd()),
            _six(r.getActualTCPPose()),
            _six(r.getActualTCPSpeed()),
            _six(r.getActualTCPForce()),
            _six(r.getFtRawWrench()) if self._raw else _UNKNOWN,
            (ax, ay, az),
        )

    def _state(self, stamp: float, now: float, read: _Read) -> UrState:
        if stamp < self._last:
            raise ControllerRestartedError(f"time stamp {stamp:g} s after {self._last:g} s")
        if self._last > -math.inf:
            self._lost += max(0, round((stamp - self._last) * self._rate) - 1)
        self._last = stamp
        if not _possible(read):
            raise ImpossibleStateError(f"{read}")
        return UrState(
            self._clock.stamp(stamp, now),
            now,
            stamp,
            *read.modes,
            *read.speeds,
            read.joint_position,
            read.joint_velocity,
            read.tool_pose,
            read.tool_velocity,
            read.tool_wrench,
            read.raw_wrench,
            read.acceleration,
            self._lost,
        )


def _possible(read: _Read) -> bool:
    """Whether a controller could send these: where bytes are missing before the end, numbers are other ones."""
    motion = (*read.joint_position, *read.joint_velocity, *read.tool_pose, *read.tool_velocity)
    load, shares = read.tool_wrench, read.speeds
    return (
        read.modes[0] in _RUNTIME_STATES
        and read.modes[1] in _ROBOT_MODES
        and math.isfinite(sum(motion) + sum(load) + sum(shares))
        and min(motion) >= -LARGEST
        and max(motion) <= LARGEST
        and min(load) >= -LARGEST_LOAD
        and max(load) <= LARGEST_LOAD
        and min(shares) >= 0.0
        and max(shares) <= LARGEST_SHARE
    )


def _six(values: Sequence[float]) -> Six:
    a, b, c, d, e, f = values
    return (a, b, c, d, e, f)
