"""The supervisor's limits in robot files, with their units in the keys."""

import msgspec

from palpate.errors import InvalidValueError, positive
from palpate.runtime.robot_ranges import at_most
from palpate.runtime.supervision.limits import Limits
from palpate.spatial import Vector

_SAFE = Limits()

_LARGEST = {
    "force_N": (1e4, "N"),
    "moment_Nm": (1e3, "N m"),
    "spin_torque_Nm": (1e3, "N m"),
    "grip_force_N": (1e4, "N"),
    "speed_m_per_s": (10.0, "m/s"),
    "acceleration_m_per_s2": (1e3, "m/s^2"),
    "angular_speed_rad_per_s": (100.0, "rad/s"),
    "angular_acceleration_rad_per_s2": (1e4, "rad/s^2"),
    "sample_age_s": (1.0, "s"),
}
"""Beyond any robot that works by touch: a larger number is in another unit (mN, mm/s, ms)."""

MAX_COORDINATE = 100.0
"""[m] from the base to a corner of the workspace: more is a number in millimetres."""

LARGEST_JOINT = 1e3
"""[rad or m] of a joint: 1000 rad are 159 turns; more is a number in degrees or steps."""


class LimitsEntry(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """What must not be exceeded: see `palpate.runtime.supervision.limits.Limits`, whose defaults these are."""

    force: float = msgspec.field(name="force_N", default=_SAFE.force)
    moment: float = msgspec.field(name="moment_Nm", default=_SAFE.moment)
    spin_torque: float = msgspec.field(name="spin_torque_Nm", default=_SAFE.spin_torque)
    grip_force: float = msgspec.field(name="grip_force_N", default=_SAFE.grip_force)
    speed: float = msgspec.field(name="speed_m_per_s", default=_SAFE.speed)
    acceleration: float = msgspec.field(name="acceleration_m_per_s2", default=_SAFE.acceleration)
    angular_speed: float = msgspec.field(name="angular_speed_rad_per_s", default=_SAFE.angular_speed)
    angular_acceleration: float = msgspec.field(
        name="angular_acceleration_rad_per_s2", default=_SAFE.angular_acceleration
    )
    sample_age: float = msgspec.field(name="sample_age_s", default=_SAFE.sample_age)
    workspace_lower: Vector = msgspec.field(name="workspace_lower_m", default=_SAFE.workspace_lower)
    workspace_upper: Vector = msgspec.field(name="workspace_upper_m", default=_SAFE.workspace_upper)
    joint_lower: tuple[float, ...] = msgspec.field(name="joint_lower_rad", default=_SAFE.joint_lower)
    joint_upper: tuple[float, ...] = msgspec.field(name="joint_upper_rad", default=_SAFE.joint_upper)

    def __post_init__(self) -> None:
        for field in msgspec.structs.fields(self):
            key, value = field.encode_name, getattr(self, field.name)
            if key in _LARGEST:
                largest, unit = _LARGEST[key]
                positive(key, value, unit)
                at_most(key, value, largest, unit)
            else:
                largest, unit = (MAX_COORDINATE, "m") if key.startswith("workspace") else (LARGEST_JOINT, "rad")
                for coordinate in value:
                    at_most(key, coordinate, largest, unit)
        for axis, lower, upper in zip("xyz", self.workspace_lower, self.workspace_upper, strict=True):
            if not lower < upper:
                raise InvalidValueError(
                    f"workspace_lower_m, {axis}, is {lower:g} and workspace_upper_m {upper:g}: must be the "
                    "smaller one"
                )
        if len(self.joint_lower) != len(self.joint_upper):
            raise InvalidValueError(
                f"joint_lower_rad has {len(self.joint_lower)} numbers and joint_upper_rad "
                f"{len(self.joint_upper)}: give one of each per joint, or none"
            )
        for i, (lower, upper) in enumerate(zip(self.joint_lower, self.joint_upper, strict=True)):
            if not lower < upper:
                raise InvalidValueError(
                    f"joint_lower_rad, joint {i + 1}, is {lower:g} and joint_upper_rad {upper:g}: must be the "
                    "smaller one"
                )
        self.limits()

    def limits(self) -> Limits:
        """Return the same as the supervisor takes it."""
        return Limits(**msgspec.structs.asdict(self))
