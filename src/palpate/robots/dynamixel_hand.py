"""Hands of Dynamixel servos in robot files: `backend.hand` of a rig."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np

from palpate.errors import InvalidValueError
from palpate.hw.dynamixel.hand import DynamixelHand
from palpate.hw.dynamixel.registers import KINDS
from palpate.hw.dynamixel.settings import LENGTHS, HandSettings, ServoCalibration
from palpate.hw.emulators.dynamixel.bus import DynamixelBus
from palpate.hw.emulators.dynamixel.servo import EmulatedServo
from palpate.robots.device_settings import DeviceSettings
from palpate.robots.finger_load import payload_of
from palpate.robots.hand_kind import HandKind
from palpate.robots.robot import Robot
from palpate.robots.surface_entries import SphereEntry
from palpate.sim import Tip
from palpate.sim.hand.finger import HingeFinger, SlideFinger
from palpate.sim.hand.hand import Hand
from palpate.surfaces import Sphere

LEAST_TIP_MASS = 1e-6
"""[kg] A simulated tip has some; here only its place matters."""

USUAL_RADIUS = 0.008
"""[m] Stands for a tip that is no sphere, likewise."""


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

    RANGES = (
        ("id", 0, 252, ""),
        ("zero_rad", -1000.0, 1000.0, "rad"),
    )

    servo_id: int = msgspec.field(name="id")
    model: ServoModelName | None = None
    zero: float = msgspec.field(name="zero_rad", default=0.0)
    direction: int = 1

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.direction not in (-1, 1):
            raise InvalidValueError(f"direction = {self.direction}: must be 1 or -1")


class SlideFingerEntry(DeviceSettings, frozen=True, kw_only=True, tag_field="kind", tag="slide"):
    """Fingers on racks, square to the hand's axis, with a pinion of this radius [m]."""

    RANGES = (("pinion_m", 1e-3, 0.2, "m"),)

    pinion: float = msgspec.field(name="pinion_m")

    @property
    def joint(self) -> SlideFinger:
        """How they move."""
        return SlideFinger(pinion=self.pinion)


class HingeFingerEntry(DeviceSettings, frozen=True, kw_only=True, tag_field="kind", tag="hinge"):
    """Fingers on the horns of their servos, this far from the servo's axis to the sensor [m]."""

    RANGES = (("length_m", 1e-3, 0.5, "m"),)

    length: float = msgspec.field(name="length_m")

    @property
    def joint(self) -> HingeFinger:
        """How they move."""
        return HingeFinger(length=self.length)


class DynamixelEntry(HandKind, DeviceSettings, frozen=True, kw_only=True):
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

    RANGES = (
        ("opening_m", 1e-3, 0.5, "m"),
        ("depth_m", 1e-3, 0.5, "m"),
        ("closing_speed_m_per_s", 1e-4, 0.5, "m/s"),
        ("baud_rate", 9600, 10_000_000, "1/s"),
        ("watchdog_s", 0.02, 2.5, "s"),
        ("poll_s", 1e-3, 0.1, "s"),
        ("silent_after_s", 1e-3, 5.0, "s"),
        ("reply_timeout_s", 1e-3, 1.0, "s"),
    )

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

    @property
    def fingers(self) -> int:
        """See `HandKind`: one per servo."""
        return len(self.servos)

    def device(self, robot: Robot) -> DynamixelHand:
        """See `HandKind`.

        Raises:
            InvalidValueError: Fingers that cannot close, or times with which a late reply is taken for a new one.
        """
        longest = LENGTHS * self.reply_timeout
        if self.silent_after > longest * (1.0 + 1e-9):
            raise InvalidValueError(
                f"backend.hand.silent_after_s = {self.silent_after:g}: must be at most {longest:g}, {LENGTHS} "
                "times reply_timeout_s: a reply later than that cannot be told from a new one"
            )
        settings = HandSettings(
            tuple(ServoCalibration(its.servo_id, its.zero, its.direction, its.model) for its in self.servos),
            self.finger.joint,
            opening=self.opening,
            tip_along=robot.file.fingers[0].surface.center[2],
            closing_speed=self.closing_speed,
            baud_rate=self.baud_rate,
            watchdog=self.watchdog,
            reply_timeout=self.reply_timeout,
            silence=self.silent_after,
        )
        return DynamixelHand(self.port, settings)

    def emulator(self, number: int = 0) -> DynamixelBus:
        """See `DeviceKind`; a servo of any model is an XL330."""
        models = {kind.servo.name: kind for kind in KINDS.values()}
        servos = [
            EmulatedServo(models[its.model or ServoModelName.XL330], its.servo_id, self.baud_rate)
            for its in self.servos
        ]
        return DynamixelBus(servos, link=Path(self.port))

    def geometry(self, robot: Robot) -> Hand:
        """See `HandKind`.

        Raises:
            InvalidValueError: Fingers that cannot close, or neither two nor three of them.
        """
        surface = robot.file.fingers[0].surface
        radius = surface.radius if isinstance(surface, SphereEntry) else USUAL_RADIUS
        sphere = Sphere(radius, center=np.array([0.0, 0.0, surface.center[2]]))
        return Hand(
            len(self.servos),
            self.finger.joint,
            Tip(sphere, max(payload_of(robot, 0).mass, LEAST_TIP_MASS)),
            opening=self.opening,
            depth=self.depth,
            closing_speed=self.closing_speed,
            bus_period=self.poll,
        )
