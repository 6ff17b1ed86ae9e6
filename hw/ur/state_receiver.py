"""States as the client process receives them: values of one cycle together, each cycle once, with our time."""

import math
from typing import Any

from palpate.hw.round_trip_clock import RoundTripClock
from palpate.hw.ur.exchange import READINGS, UrState
from palpate.hw.ur.library import EchoClient, ReceiveClient

MAX_MOTION = 1000.0
"""Limit of joints [rad, rad/s] and of pose and velocity of the tool [m, rad, m/s, rad/s]: no arm reaches it."""

MAX_LOAD = 1e5
"""Limit of the load on the tool [N, N m]: no arm carries it."""

MAX_SPEED_SHARE = 2.0
"""Limit of speed scaling and slider, which are from 0 to 1."""

_TRIES = 8
"""Cycles that may pass while one is read; if more pass, the process is starved."""

_RUNTIME_STATES = range(6)
_ROBOT_MODES = range(-1, 10)
"""Numbers in the maker's RTDE guide."""


class ControllerRestartedError(ConnectionError):
    """The controller's clock went back."""


class ImpossibleStateError(ConnectionError):
    """Numbers that no controller sends: not finite, beyond all limits, or modes that do not exist."""


class StateReceiver:
    """Polls the library for a new state."""

    def __init__(self, receiver: ReceiveClient, echo: EchoClient, rate: float) -> None:
        """Begin without a state.

        Args:
            receiver: Connected client for states.
            echo: Connected client for echoes.
            rate: States per second of the controller's time [Hz].
        """
        self._receiver, self._echo, self._rate = receiver, echo, rate
        self._getters = [getattr(receiver, getter) for _, getter in READINGS.values()]
        self._clock = RoundTripClock()
        self._last = -math.inf
        self._lost = 0

    @property
    def connected(self) -> bool:
        """Whether the connections for states and echoes are up, as far as they report."""
        return self._receiver.isConnected() and self._echo.connected

    def take(self, now: float) -> UrState | None:
        """Return the newest state if it is new, and if an echo proves when it was sampled.

        The library's getters are not one snapshot: a state counts if the time stamp is the same before and after.

        Args:
            now: `time.monotonic` [s].

        Raises:
            ControllerRestartedError: If the controller's clock went back.
            ImpossibleStateError: If no controller sends such numbers.
        """
        stamp_of = self._receiver.getTimestamp
        self._clock.prove(self._echo.exchange(now))
        for _ in range(_TRIES):
            stamp = stamp_of()
            if stamp == self._last or stamp == 0.0 or not self._clock.proven:  # 0: nothing has arrived yet
                return None
            values = [get() for get in self._getters]
            if stamp_of() == stamp:
                return self._state(stamp, now, values)
        return None

    def _state(self, stamp: float, now: float, values: list[Any]) -> UrState:
        if stamp < self._last:
            raise ControllerRestartedError(f"time stamp {stamp:g} s after {self._last:g} s")
        if self._last > -math.inf:
            self._lost += max(0, round((stamp - self._last) * self._rate) - 1)
        self._last = stamp
        read = [tuple(value) if isinstance(value, list) else value for value in values]
        columns: list[Any] = [self._clock.stamp(stamp, now), now, stamp, *read, self._lost]
        state = UrState(*columns)
        if not is_possible(state):
            raise ImpossibleStateError(f"{state}")
        return state


def is_possible(state: UrState) -> bool:
    """Return whether a controller could send a state: missing bytes before its end change its numbers."""
    motion = (*state.joint_position, *state.joint_velocity, *state.tool_pose, *state.tool_velocity)
    load, shares = state.tool_wrench, (state.speed_scaling, state.speed_slider)
    return (
        state.runtime_state in _RUNTIME_STATES
        and state.robot_mode in _ROBOT_MODES
        and math.isfinite(sum(motion) + sum(load) + sum(shares))
        and min(motion) >= -MAX_MOTION
        and max(motion) <= MAX_MOTION
        and min(load) >= -MAX_LOAD
        and max(load) <= MAX_LOAD
        and min(shares) >= 0.0
        and max(shares) <= MAX_SPEED_SHARE
    )
