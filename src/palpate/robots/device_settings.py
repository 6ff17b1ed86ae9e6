"""What settings in robot files have in common: numbers within ranges, texts that are one word, poses."""

from typing import ClassVar

import msgspec

from palpate.errors import InvalidValueError
from palpate.kinematics.pose import Pose, rotation_from_rotvec
from palpate.open_kinds import Settings
from palpate.runtime.robot_ranges import at_most, within
from palpate.spatial import ZERO, Vector

MAX_COORDINATE = 10.0
"""[m] from one frame of a cell to another: more is a number in millimetres."""


Range = tuple[str, float, float, str]
"""Key, least, greatest and unit of a number."""


class RangedSettings(Settings, frozen=True, kw_only=True):
    """Settings whose numbers are within ranges.

    Attributes:
        RANGES: What can be, generously; beyond, it is a number in another unit.
    """

    RANGES: ClassVar[tuple[Range, ...]] = ()

    def __post_init__(self) -> None:
        """Refuse numbers out of range."""
        names = {field.encode_name: field.name for field in msgspec.structs.fields(self)}
        for key, least, most, unit in self.RANGES:
            value = getattr(self, names[key])
            if value is not None:
                within(key, value, least, most, unit)


class DeviceSettings(RangedSettings, frozen=True, kw_only=True):
    """Settings of a real device: numbers within `RANGES`, texts that are one word."""

    def __post_init__(self) -> None:
        """Refuse numbers out of range, and texts of several words or none."""
        super().__post_init__()
        for field in msgspec.structs.fields(self):
            value = getattr(self, field.name)
            if isinstance(value, str) and (not value.strip() or not value.isprintable() or " " in value.strip()):
                raise InvalidValueError(f"{field.encode_name} = {value!r}: must be one word")


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

    @property
    def pose(self) -> Pose:
        """The same as a pose."""
        return Pose(self.position, rotation_from_rotvec(self.rotvec))
