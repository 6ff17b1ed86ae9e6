"""Real devices in robot files: what `backend` of kind `rig` may be.

Plain data, as all of a robot file; `palpate.robots.rig_built` makes devices of it.
"""

from enum import StrEnum
from typing import Annotated

import msgspec

from palpate.errors import InvalidValueError
from palpate.open_kinds import Settings
from palpate.runtime.robot_ranges import at_most, within
from palpate.sensing.ft.sensor_file import PayloadEntry
from palpate.spatial import ZERO, Vector

MAX_COORDINATE = 10.0
"""[m] from one frame of a cell to another: more is a number in millimetres."""

RANGES = {
    "acceleration_m_per_s2": (0.01, 150.0, "m/s^2"),
    "joint_speed_rad_per_s": (0.001, 10.0, "rad/s"),
    "watchdog_s": (0.02, 2.5, "s"),
    "stiffness_N_per_m": (100.0, 1e7, "N/m"),
    "response_s": (1e-4, 1.0, "s"),
    "lag_s": (0.0, 1.0, "s"),
    "baud_rate": (9600, 10_000_000, "1/s"),
    "opening_m": (1e-3, 0.5, "m"),
    "depth_m": (1e-3, 0.5, "m"),
    "closing_speed_m_per_s": (1e-4, 0.5, "m/s"),
    "poll_s": (1e-3, 0.1, "s"),
    "pinion_m": (1e-3, 0.2, "m"),
    "length_m": (1e-3, 0.5, "m"),
    "id": (0, 252, ""),
    "zero_rad": (-1000.0, 1000.0, "rad"),
    "silent_after_s": (1e-3, 5.0, "s"),
    "reply_timeout_s": (1e-3, 1.0, "s"),
    "record_period_s": (0.001, 0.254, "s"),
    "sinc_length": (51, 512, ""),
    "port": (1, 65535, ""),
    "calibration_port": (1, 65535, ""),
}
"""What a device can be, generously: beyond, the number is in another unit."""


class DeviceSettings(Settings, frozen=True, kw_only=True):
    """Numbers within `RANGES`, texts that are one line."""

    def __post_init__(self) -> None:
        for field in msgspec.structs.fields(self):
            key, value = field.encode_name, getattr(self, field.name)
            if key in RANGES and value is not None and not isinstance(value, str):
                least, most, unit = RANGES[key]
                within(key, value, least, most, unit)
            elif isinstance(value, str) and (not value.strip() or not value.isprintable() or " " in value.strip()):
                raise InvalidValueError(f"{key} = {value!r}: must be one word")


class PoseEntry(DeviceSettings, frozen=True, kw_only=True):
    """Where a frame is in another one.

    Attributes:
        position: Of its origin [m].
        rotvec: How it is turned: axis times angle [rad], as the UR pendant shows it.
    """

    position: Vector = msgspec.field(name="position_m", default=ZERO)
    rotvec: Vector = msgspec.field(name="rotvec_rad", default=ZERO)

    def __post_init__(self) -> None:
        for coordinate in self.position:
            at_most("position_m", coordinate, MAX_COORDINATE, "m")
        for angle in self.rotvec:
            at_most("rotvec_rad", angle, 7.0, "rad")


class UrEntry(DeviceSettings, frozen=True, kw_only=True, tag_field="kind", tag="ur"):
    """An arm of Universal Robots: see `palpate.hw.ur.UrSettings`. Its speed limits are the robot's `limits`.

    Attributes:
        address: Of its controller: host name or IP address.
        tcp: The tip frame on the flange; its axes are those of the fingertip's sensor.
        payload: What the flange carries; None: as set on the pendant.
        robot_base: Where its own base frame is in the base frame that experiments speak of. None: a run begins
        where it
            is to begin, the tip close above the middle of the object, and that tells the position.
        acceleration: With which the tip follows velocities [m/s^2], and its turning [rad/s^2]: the controller has
            one number for both.
        joint_speed: Limit of goals for joints [rad/s].
        watchdog: Time without commands after which it stops [s].
        speed_slider: To set the pendant's slider to, (0, 1]; None: as it is.
        stiffness: With which it holds its tip [N/m]. Default: of the order of arms of this size; pressing finds
            what it really is (--identify).
        response: Delay that stands for its controller in force control [s]. Default: ten of its cycles; likewise.
        lag: How far it runs behind a ramp [s]; likewise.
    """

    address: str
    tcp: PoseEntry = PoseEntry()
    payload: PayloadEntry | None = None
    robot_base: PoseEntry | None = None
    acceleration: float = msgspec.field(name="acceleration_m_per_s2", default=5.0)
    joint_speed: float = msgspec.field(name="joint_speed_rad_per_s", default=1.0)
    watchdog: float = msgspec.field(name="watchdog_s", default=0.1)
    speed_slider: float | None = None
    stiffness: float = msgspec.field(name="stiffness_N_per_m", default=3e4)
    response: float = msgspec.field(name="response_s", default=0.02)
    lag: float = msgspec.field(name="lag_s", default=0.02)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.speed_slider is not None:
            within("speed_slider", self.speed_slider, 0.01, 1.0, "")


class ServoModelName(StrEnum):
    """Servos that palpate knows."""

    XL330 = "XL330-M288"
    XM430 = "XM430-W210"


class ServoEntry(DeviceSettings, frozen=True, kw_only=True):
    """One finger's servo: see `palpate.hw.dynamixel.settings.ServoCalibration`.

    Attributes:
        servo_id: On the bus.
        model: Required model; None: any.
        zero: Where its shaft stands [rad] when the finger's joint is at 0.
        direction: 1 if its position grows as the finger closes, -1 if it shrinks.
    """

    servo_id: int = msgspec.field(name="id")
    model: ServoModelName | None = None
    zero: float = msgspec.field(name="zero_rad", default=0.0)
    direction: int = 1

    def __post_init__(self) -> None:
        within("id", self.servo_id, *RANGES["id"])
        within("zero_rad", self.zero, *RANGES["zero_rad"])
        if self.direction not in (-1, 1):
            raise InvalidValueError(f"direction = {self.direction}: must be 1 or -1")


class SlideFingerEntry(DeviceSettings, frozen=True, kw_only=True, tag_field="kind", tag="slide"):
    """Fingers on racks, square to the hand's axis, with a pinion of this radius [m]."""

    pinion: float = msgspec.field(name="pinion_m")


class HingeFingerEntry(DeviceSettings, frozen=True, kw_only=True, tag_field="kind", tag="hinge"):
    """Fingers on the horns of their servos, this far from the servo's axis to the sensor [m]."""

    length: float = msgspec.field(name="length_m")


class DynamixelEntry(DeviceSettings, frozen=True, kw_only=True, tag_field="kind", tag="dynamixel"):
    """A hand of Dynamixel servos: see `palpate.hw.dynamixel.settings.HandSettings`.

    Attributes:
        port: Path of the adapter's terminal; one under /dev/serial/by-id stays the same.
        servos: One per finger, in the order of `fingers`.
        finger: How each moves.
        opening: From the hand's axis to the tips' centres with all joints at 0 [m].
        depth: From the palm, where the arm's tip frame is, to the sensors [m].
        closing_speed: With which tips move while nothing obstructs them [m/s].
        baud_rate: [1/s].
        watchdog: Servos stop when the bus was silent for so long [s].
        poll: From exchange to exchange [s].
        silent_after: It counts as lost when exchanges have failed for so long [s]; below the watchdog.
        reply_timeout: How long a reply may take to begin [s].
    """

    port: str
    servos: Annotated[tuple[ServoEntry, ...], msgspec.Meta(min_length=1, max_length=16)]
    finger: SlideFingerEntry | HingeFingerEntry
    opening: float = msgspec.field(name="opening_m", default=0.04)
    depth: float = msgspec.field(name="depth_m", default=0.08)
    closing_speed: float = msgspec.field(name="closing_speed_m_per_s", default=0.005)
    baud_rate: int = 1_000_000
    watchdog: float = msgspec.field(name="watchdog_s", default=0.1)
    poll: float = msgspec.field(name="poll_s", default=0.004)
    silent_after: float = msgspec.field(name="silent_after_s", default=0.03)
    reply_timeout: float = msgspec.field(name="reply_timeout_s", default=0.006)

    def __post_init__(self) -> None:
        super().__post_init__()
        ids = [servo.servo_id for servo in self.servos]
        if len(set(ids)) < len(ids):
            raise InvalidValueError(f"servos: ids {ids}: each needs one of its own")


class RigEntry(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="rig"):
    """Real devices: see `palpate.hw.rig.Rig`. The sensors stand with the fingers (`sensor_device`).

    Attributes:
        arm: What carries the fingers; None: they stand.
        hand: With the fingers on it; None: there is one finger, at the arm's tip.
        tare_at_start: Whether sensors are tared whenever a run begins: nothing may be touched then.
    """

    arm: UrEntry | None = None
    hand: DynamixelEntry | None = None
    tare_at_start: bool = True
