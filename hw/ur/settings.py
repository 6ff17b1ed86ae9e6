"""Settings of a UR arm, and the check of velocities against them.

The library checks no lengths: five numbers instead of six make it wait for five minutes.
"""

import math
from dataclasses import dataclass, field

from palpate.errors import InvalidValueError, not_negative, positive, vector
from palpate.hw.ur.exchange import Opening
from palpate.hw.ur.rtde import Version
from palpate.kinematics.pose import Pose, checked_pose, rotvec_from_rotation
from palpate.spatial import ZERO, Vector

MAX_SPEED = 3.0
"""Largest speed of a tool that the client library accepts [m/s]."""

MAX_ACCELERATION = 150.0
"""Largest acceleration of a tool that the client library accepts [m/s^2]."""

WATCHDOG_RANGE = (0.02, 1.0)
"""[s]: below, an ordinary system's stalls of tens of milliseconds stop the arm; above, it stops too late."""

_ROUNDING = 1e-9
"""Relative excess that a speed may have after it was scaled down to the limit."""

_POSITIVE = {
    "speed": "m/s",
    "angular_speed": "rad/s",
    "acceleration": "m/s^2",
    "deceleration": "m/s^2",
    "watchdog": "s",
    "stale_after": "s",
    "start_within": "s",
}


@dataclass(frozen=True, slots=True)
class FlangePayload:
    """Payload of the flange: the controller takes its weight off the wrench, and needs it to hold still.

    Attributes:
        mass: Mass [kg].
        center: Centre of gravity, flange frame [m].
    """

    mass: float
    center: Vector = ZERO

    def __post_init__(self) -> None:
        not_negative("payload mass", self.mass, "kg")
        vector("payload center", self.center, 3, "m")


@dataclass(frozen=True, slots=True)
class UrSettings:
    """Limits, tool and times of a UR arm. A command beyond a limit is refused, not reduced.

    Attributes:
        pose_flange_tip: Tip frame on the flange: the controller's TCP.
        payload: Payload of the flange; None: as set on the teach pendant.
        speed: Limit for the tool [m/s]. Default: reduced speed of ISO 10218-1.
        angular_speed: Limit for the tool [rad/s]. Default: 60 deg/s, the default of movej.
        acceleration: Acceleration with which the tool follows velocities [m/s^2]. Default: 20 mm/s reversed in 4
            periods of 2 ms, which a force loop requires at a stiff contact.
        deceleration: Deceleration of a stop [m/s^2]. Default: that of the library's stop commands.
        watchdog: Time without a command after which the arm stops: the client process stops it when this process
            is silent, the controller when the client is [s]. Default: the library's 10 Hz.
        stale_after: Age from which a state is refused [s]. Default: that of the supervisor.
        speed_slider: Fraction of the speed that the pendant's slider is set to (0, 1]; None: unchanged.
        start_within: Time limit from the first connection to the running script [s]; to end a client process that
            hangs takes up to 6 s more.
    """

    pose_flange_tip: Pose = field(default_factory=Pose)
    payload: FlangePayload | None = None
    speed: float = 0.25
    angular_speed: float = math.radians(60.0)
    acceleration: float = 5.0
    deceleration: float = 10.0
    watchdog: float = 0.1
    stale_after: float = 0.02
    speed_slider: float | None = None
    start_within: float = 15.0

    def __post_init__(self) -> None:
        checked_pose("pose_flange_tip", self.pose_flange_tip)
        for name, unit in _POSITIVE.items():
            positive(name, getattr(self, name), unit)
        _check_range("speed", self.speed, (0.0, MAX_SPEED), "m/s")
        _check_range("acceleration", self.acceleration, (0.0, MAX_ACCELERATION), "m/s^2")
        _check_range("deceleration", self.deceleration, (0.0, MAX_ACCELERATION), "m/s^2")
        _check_range("watchdog", self.watchdog, WATCHDOG_RANGE, "s")
        if self.speed_slider is not None:
            positive("speed_slider", self.speed_slider, "")
            _check_range("speed_slider", self.speed_slider, (0.0, 1.0), "")

    def opening(self, address: str, version: Version, library: str, memory: int) -> Opening:
        """Return the first message to the client process: see `Opening`."""
        pose, payload = self.pose_flange_tip, self.payload
        return Opening(
            address=address,
            version=version,
            library=library,
            memory=memory,
            tool=(*pose.position, *rotvec_from_rotation(pose.rotation)),
            payload=() if payload is None else (payload.mass, *payload.center),
            speed_slider=self.speed_slider,
            acceleration=self.acceleration,
            deceleration=self.deceleration,
            watchdog=self.watchdog,
            stale_after=self.stale_after,
        )

    def checked_twist(self, velocity: Vector, angular_velocity: Vector) -> tuple[float, ...]:
        """Return a velocity and an angular velocity as six numbers [m/s, rad/s].

        Raises:
            InvalidValueError: If one is above its limit, not finite, or not three numbers.
        """
        v = _three("velocity_base_tip", velocity, self.speed, "m/s", "speed")
        w = _three("angular_velocity_base_tip", angular_velocity, self.angular_speed, "rad/s", "angular_speed")
        return v + w


def _check_range(name: str, value: float, bounds: tuple[float, float], unit: str) -> None:
    lower, upper = bounds
    if not lower <= value <= upper:
        raise InvalidValueError(f"{name} = {value:g} {unit}".rstrip() + f": must be within {lower:g} .. {upper:g}")


def _three(name: str, values: Vector, limit: float, unit: str, setting: str) -> tuple[float, float, float]:
    try:
        x, y, z = map(float, values)
    except (TypeError, ValueError):
        raise InvalidValueError(f"{name} = {values!r}: must be three numbers [{unit}]") from None
    speed = math.hypot(x, y, z)
    if not speed <= limit * (1.0 + _ROUNDING):  # nan does not pass
        raise InvalidValueError(
            f"{name} = {speed:g} {unit}: the limit is {limit:g} {unit}; ask for less, or raise "
            f"UrSettings.{setting}"
        )
    return (x, y, z)
