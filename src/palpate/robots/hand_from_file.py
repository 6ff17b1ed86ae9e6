"""A simulated hand that its own file describes: `backend.hand` of kind `mjcf`."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import msgspec

from palpate.errors import InvalidValueError, shown
from palpate.robots.device_settings import DeviceSettings
from palpate.robots.hand_kind import HandKind
from palpate.robots.robot import Robot
from palpate.robots.simulated_tip import simulated_tip
from palpate.sim.hand.hand_file import HANDS, HandFile
from palpate.sim.hand.jointed_hand import JointedHand

HAND_TEXT = "hand.xml"
"""Under this name a log keeps the hand's file."""


class MjcfHandEntry(HandKind, DeviceSettings, frozen=True, kw_only=True):
    """A hand of fingers with one to four joints each: see `palpate.sim.hand.hand_file.HandFile`.

    Attributes:
        file: MJCF or URDF of the hand, relative to the robot file; or the name of a hand that palpate has, without
            an ending. Its world frame is the hand frame: in the palm, z away from the fingers.
        sensors: Names of sites, bodies or links, one per finger, in the order of `fingers`: there the sensors sit,
            x in the direction in which the finger closes.
        start: Joint positions with which it starts, finger by finger [rad, or m of a slide].
        joint_speed: Largest speed of each joint likewise, where the file has none.
        bandwidth: Natural frequency of the fingertips under control [rad/s].
        closing_speed: With which fingers close in free space [m/s].
        following_error: How far a tip's reference may run ahead of it [m].
    """

    RANGES = (
        ("bandwidth_rad_per_s", 0.1, 1e4, "rad/s"),
        ("closing_speed_m_per_s", 1e-4, 0.5, "m/s"),
        ("following_error_m", 1e-6, 0.1, "m"),
    )

    file: str
    sensors: Annotated[tuple[str, ...], msgspec.Meta(min_length=1, max_length=16)]
    start: tuple[float, ...] = msgspec.field(name="start_rad", default=())
    joint_speed: tuple[float, ...] = msgspec.field(name="joint_speed_rad_per_s", default=())
    bandwidth: float = msgspec.field(name="bandwidth_rad_per_s", default=200.0)
    closing_speed: float = msgspec.field(name="closing_speed_m_per_s", default=0.02)
    following_error: float = msgspec.field(name="following_error_m", default=0.002)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self._path.suffix:
            known = ", ".join(sorted(_own()))
            raise InvalidValueError(
                f"file = {shown(self.file)}: must be a file (.xml), or one of the hands {known}"
            )

    @property
    def fingers(self) -> int:
        """See `HandKind`."""
        return len(self.sensors)

    @property
    def files(self) -> Mapping[str, str]:
        """See `DeviceKind`."""
        return {HAND_TEXT: str(self._path)}

    def geometry(self, robot: Robot) -> JointedHand:
        """See `HandKind`.

        Raises:
            InvalidValueError: The file describes no such hand, or a fingertip cannot be simulated.
        """
        place, text = robot.texts[f"{HAND_TEXT}.path"], robot.texts[HAND_TEXT]
        tips = [simulated_tip(robot, i, finger.surface) for i, finger in enumerate(robot.file.fingers)]
        hand = HandFile(place, self.sensors, self.start, self.joint_speed, text).read(tips)
        return replace(
            hand,
            bandwidth=self.bandwidth,
            closing_speed=self.closing_speed,
            following_error=self.following_error,
        )

    @property
    def _path(self) -> Path:
        return _own().get(self.file, Path(self.file))


def _own() -> dict[str, Path]:
    return {path.stem: path for path in HANDS.glob("*.xml")}
