"""Settings of a UR arm."""

import math
from dataclasses import dataclass, field

from palpate.errors import InvalidValueError, not_negative, positive, vector
from palpate.hw.ur.requests import Opening
from palpate.hw.ur.version import Version
from palpate.kinematics.pose import Pose, checked_pose, rotvec_from_rotation
from palpate.spatial import ZERO, Vector

HIGHEST_SPEED = 3.0
"""[m/s] that the client library takes for a tool; it refuses more."""

HIGHEST_ACCELERATION = 150.0
"""[m/s^2] that the client library takes for a tool."""

LOOKAHEAD_RANGE = (0.03, 0.2)
"""[s], of servoj in the maker's script manual."""

GAIN_RANGE = (100.0, 2000.0)
"""Of servoj in the maker's script manual."""

WATCHDOG_RANGE = (0.02, 1.0)
"""[s]: below, an ordinary system's stalls of tens of milliseconds stop the arm; above, it stops too late."""


@dataclass(frozen=True, slots=True)
class FlangePayload:
    """What the flange carries: the controller takes its weight off the wrench, and needs it to hold still.

    Attributes:
        mass: [kg].
        center: Of gravity, flange frame [m].
    """

    mass: float
    center: Vector = ZERO

    def __post_init__(self) -> None:
        not_negative("payload mass", self.mass, "kg")
        vector("payload center", self.center, 3, "m")


@dataclass(frozen=True, slots=True)
class UrSettings:
    """Limits, tool and times of a UR arm. What is out of a limit is refused, not shortened.

    Attributes:
        pose_flange_tip: Where the tip frame is on the flange: the controller's TCP.
        payload: What the flange carries; None: as set on the teach pendant.
        speed: Limit for the tool [m/s]. Default: reduced speed of ISO 10218-1.
        angular_speed: Limit for the tool [rad/s]. Default: 60 deg/s, the default of movej.
        joint_speed: Limit for joint goals [rad/s]. Default: as `angular_speed`.
        force: Limit for force mode [N]. Default: that of the supervisor.
        moment: Limit for force mode [N m]. Default: that of the supervisor.
        acceleration: With which the tool follows velocities [m/s^2]. Default: 20 mm/s turned round in 4 periods of
            2 ms, which a force loop asks for at a stiff contact.
        deceleration: With which it stops [m/s^2]. Default: that of the library's stop commands.
        watchdog: Time without a command after which the arm stops: the client process when this one is silent, the
            controller when the client is [s]. Default: the library's 10 Hz.
        stale_after: Age at which a state is no longer believed [s]. Default: that of the supervisor.
        lookahead: Of joint and pose servo [s], smooths.
        gain: Of joint and pose servo.
        speed_slider: Fraction of the speed that the pendant's slider is set to (0, 1]; None: as it is.
        start_within: Time in which it must be up, from the first connection to the running script [s]; to end a
            client process that hangs takes up to 6 s more.
    """

    pose_flange_tip: Pose = field(default_factory=Pose)
    payload: FlangePayload | None = None
    speed: float = 0.25
    angular_speed: float = math.radians(60.0)
    joint_speed: float = math.radians(60.0)
    force: float = 20.0
    moment: float = 2.0
    acceleration: float = 5.0
    deceleration: float = 10.0
    watchdog: float = 0.1
    stale_after: float = 0.02
    lookahead: float = 0.1
    gain: float = 300.0
    speed_slider: float | None = None
    start_within: float = 15.0

    def __post_init__(self) -> None:
        checked_pose("pose_flange_tip", self.pose_flange_tip)
        for name, unit in _POSITIVE.items():
            positive(name, getattr(self, name), unit)
        _within("speed", self.speed, (0.0, HIGHEST_SPEED), "m/s")
        _within("acceleration", self.acceleration, (0.0, HIGHEST_ACCELERATION), "m/s^2")
        _within("deceleration", self.deceleration, (0.0, HIGHEST_ACCELERATION), "m/s^2")
        _within("watchdog", self.watchdog, WATCHDOG_RANGE, "s")
        _within("lookahead", self.lookahead, LOOKAHEAD_RANGE, "s")
        _within("gain", self.gain, GAIN_RANGE, "")
        if self.speed_slider is not None:
            checked_fraction("speed_slider", self.speed_slider)

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
            lookahead=self.lookahead,
            gain=self.gain,
        )


def checked_fraction(name: str, value: float) -> float:
    """Return a fraction of the speed, if it is one above 0.

    Raises:
        InvalidValueError: Otherwise.
    """
    positive(name, value, "")
    return _within(name, value, (0.0, 1.0), "")


_POSITIVE = {
    "speed": "m/s",
    "angular_speed": "rad/s",
    "joint_speed": "rad/s",
    "force": "N",
    "moment": "N m",
    "acceleration": "m/s^2",
    "deceleration": "m/s^2",
    "watchdog": "s",
    "stale_after": "s",
    "lookahead": "s",
    "gain": "",
    "start_within": "s",
}


def _within(name: str, value: float, bounds: tuple[float, float], unit: str) -> float:
    lower, upper = bounds
    if lower <= value <= upper:
        return value
    raise InvalidValueError(f"{name} = {value:g} {unit}".rstrip() + f": must be within {lower:g} .. {upper:g}")
