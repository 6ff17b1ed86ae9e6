"""What must not be exceeded, with safe defaults; in robot files with units in the keys."""

import msgspec

from palpate.errors import InvalidValueError, positive
from palpate.nearest_name import unit_of
from palpate.runtime.robot_ranges import at_most
from palpate.spatial import Vector

REDUCED_SPEED = 0.25
"""[m/s]: the reduced speed of ISO 10218-1:2011, section 5.6.2."""

GRAVEST_STEP = 25.0
"""[m/s^2]: a step of the commanded velocity by 25 mm/s within a millisecond is a bug or a wrong gain."""

REDUCED_TURN = 2.5
"""[rad/s]: what is 0.1 m away from the fingertip then moves with the reduced speed."""

MAX_ANGULAR_ACCELERATION = 250.0
"""[rad/s^2]: likewise, with `GRAVEST_STEP`."""

CONTACT_SPEED_PER_FORCE = 1e-3
"""[m/s per N of the force limit]: with it a tip on 8 kg and servos of 80 kN/m, a UR5e's, presses a contact of
20 kN/m with 1.35 times the limit at most; `palpate robot check` says what another robot does."""

LARGEST_SHARE = 1.5
"""Of the force limit, with which something unexpected may be hit where nothing else is stated."""

OLDEST_SAMPLE = 0.02
"""[s]: two and a half periods of the slowest arm in use (UR CB3, 125 Hz)."""

_LARGEST = {
    "force": 1e4,
    "impact_force": 1e4,
    "moment": 1e3,
    "spin_torque": 1e3,
    "grip_force": 1e4,
    "speed": 10.0,
    "contact_speed": 10.0,
    "acceleration": 1e3,
    "angular_speed": 100.0,
    "angular_acceleration": 1e4,
    "sample_age": 1.0,
    "workspace_lower": 100.0,
    "workspace_upper": 100.0,
    "joint_lower": 1e3,
    "joint_upper": 1e3,
}
"""Beyond any robot that works by touch: a larger number is in another unit (mN, mm/s, ms, mm, degrees, steps)."""


class Limits(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """What must not be exceeded.

    Attributes:
        force: Length of any finger's contact force [N].
        impact_force: Largest force with which something unexpected may be hit after all delays, by the model
            `palpate.controllers.LandingModel.largest_force` [N]: what sensor, tip and object bear. Plans and
            limits that would exceed it are refused. None: `LARGEST_SHARE` times `force`.
        moment: Length of any finger's contact moment about the origin of its sensor frame [N m].
        spin_torque: Size of any finger's spin torque [N m].
        grip_force: Normal force of any finger of a hand, commanded and felt [N].
        speed: Of the tip, commanded and measured, and of any finger of a hand sideways, commanded [m/s].
        contact_speed: Of the tip, commanded by a controller, but for backing off from what it touches: it may run
            into something at any time [m/s]. None: `CONTACT_SPEED_PER_FORCE` times `force`, and at most `speed`.
        acceleration: Change of the commanded velocity per time [m/s^2].
        angular_speed: Of the tip frame, commanded and measured [rad/s].
        angular_acceleration: Change of the commanded angular velocity per time [rad/s^2].
        sample_age: From when any device's sample was taken to the period that uses it [s]; if above 0.1 s, also
            from period to period.
        workspace_lower: Smallest position of the tip frame, base frame [m].
        workspace_upper: Largest position of the tip frame, base frame [m].
        joint_lower: Smallest position of each joint of the arm [rad or m]; empty: not limited.
        joint_upper: Largest position of each joint of the arm [rad or m]; empty: not limited.
    """

    force: float = msgspec.field(name="force_N", default=20.0)
    impact_force: float | None = msgspec.field(name="impact_force_N", default=None)
    moment: float = msgspec.field(name="moment_Nm", default=2.0)
    spin_torque: float = msgspec.field(name="spin_torque_Nm", default=1.0)
    grip_force: float = msgspec.field(name="grip_force_N", default=20.0)
    speed: float = msgspec.field(name="speed_m_per_s", default=REDUCED_SPEED)
    contact_speed: float | None = msgspec.field(name="contact_speed_m_per_s", default=None)
    acceleration: float = msgspec.field(name="acceleration_m_per_s2", default=GRAVEST_STEP)
    angular_speed: float = msgspec.field(name="angular_speed_rad_per_s", default=REDUCED_TURN)
    angular_acceleration: float = msgspec.field(
        name="angular_acceleration_rad_per_s2", default=MAX_ANGULAR_ACCELERATION
    )
    sample_age: float = msgspec.field(name="sample_age_s", default=OLDEST_SAMPLE)
    workspace_lower: Vector = msgspec.field(name="workspace_lower_m", default=(-1.0, -1.0, -1.0))
    workspace_upper: Vector = msgspec.field(name="workspace_upper_m", default=(1.0, 1.0, 1.0))
    joint_lower: tuple[float, ...] = msgspec.field(name="joint_lower_rad", default=())
    joint_upper: tuple[float, ...] = msgspec.field(name="joint_upper_rad", default=())

    def __post_init__(self) -> None:
        for field in msgspec.structs.fields(self):
            key, value, largest = field.encode_name, getattr(self, field.name), _LARGEST[field.name]
            unit = unit_of(key)
            if value is None:
                continue
            if not isinstance(value, tuple):
                positive(key, value, unit)
            for each in value if isinstance(value, tuple) else (value,):
                at_most(key, each, largest, unit)
        if self.contact_speed is not None and self.contact_speed > self.speed:
            raise InvalidValueError(
                f"contact_speed_m_per_s = {self.contact_speed:g}: must be at most speed_m_per_s = {self.speed:g}"
            )
        if self.impact_force is not None and self.impact_force < self.force:
            raise InvalidValueError(
                f"impact_force_N = {self.impact_force:g}: must be at least force_N = {self.force:g}, at which the "
                "robot is only just stopped"
            )
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

    @property
    def largest_impact(self) -> float:
        """Largest force with which something unexpected may be hit [N]."""
        return LARGEST_SHARE * self.force if self.impact_force is None else self.impact_force

    @property
    def commanded_speed(self) -> float:
        """Largest speed of the tip that a controller may command [m/s]."""
        if self.contact_speed is not None:
            return self.contact_speed
        return min(CONTACT_SPEED_PER_FORCE * self.force, self.speed)

    def allowing(self, speed: float) -> "Limits":
        """Return the limits of a plan that commands up to a speed [m/s] if that is more, but at most `speed`."""
        return msgspec.structs.replace(self, contact_speed=min(max(speed, self.commanded_speed), self.speed))
