"""What must not be exceeded, with safe defaults."""

import math
from dataclasses import dataclass

from palpate.errors import InvalidValueError, positive
from palpate.spatial import Vector

REDUCED_SPEED = 0.25
"""[m/s]: the reduced speed of ISO 10218-1:2011, section 5.6.2."""

GRAVEST_STEP = 25.0
"""[m/s^2]: a step of the commanded velocity by 25 mm/s within a millisecond is a bug or a wrong gain."""

REDUCED_TURN = 2.5
"""[rad/s]: what is 0.1 m away from the fingertip then moves with the reduced speed."""

MAX_ANGULAR_ACCELERATION = 250.0
"""[rad/s^2]: likewise, with `GRAVEST_STEP`."""

OLDEST_SAMPLE = 0.02
"""[s]: two and a half periods of the slowest arm in use (UR CB3, 125 Hz)."""


@dataclass(frozen=True, slots=True)
class Limits:
    """What must not be exceeded.

    Attributes:
        force: Length of any finger's contact force [N].
        moment: Length of any finger's contact moment about the origin of its sensor frame [N m].
        spin_torque: Size of any finger's spin torque [N m].
        grip_force: Normal force of any finger of a hand, commanded and felt [N].
        speed: Of the tip, commanded and measured, and of any finger of a hand sideways, commanded [m/s].
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

    force: float = 20.0
    moment: float = 2.0
    spin_torque: float = 1.0
    grip_force: float = 20.0
    speed: float = REDUCED_SPEED
    acceleration: float = GRAVEST_STEP
    angular_speed: float = REDUCED_TURN
    angular_acceleration: float = MAX_ANGULAR_ACCELERATION
    sample_age: float = OLDEST_SAMPLE
    workspace_lower: Vector = (-1.0, -1.0, -1.0)
    workspace_upper: Vector = (1.0, 1.0, 1.0)
    joint_lower: tuple[float, ...] = ()
    joint_upper: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        positive("force limit", self.force, "N")
        positive("moment limit", self.moment, "N m")
        positive("spin torque limit", self.spin_torque, "N m")
        positive("grip force limit", self.grip_force, "N")
        positive("speed limit", self.speed, "m/s")
        positive("acceleration limit", self.acceleration, "m/s^2")
        positive("angular speed limit", self.angular_speed, "rad/s")
        positive("angular acceleration limit", self.angular_acceleration, "rad/s^2")
        positive("sample age limit", self.sample_age, "s")
        for axis, lower, upper in zip("xyz", self.workspace_lower, self.workspace_upper, strict=True):
            if not lower < upper:
                raise InvalidValueError(f"workspace along {axis} is [{lower:g}, {upper:g}] m: must not be empty")
        if len(self.joint_lower) != len(self.joint_upper):
            raise InvalidValueError(
                f"joint limits: {len(self.joint_lower)} lower and {len(self.joint_upper)} upper ones; give as many"
            )
        for i, (lower, upper) in enumerate(zip(self.joint_lower, self.joint_upper, strict=True)):
            if not (math.isfinite(lower) and math.isfinite(upper) and lower < upper):
                raise InvalidValueError(
                    f"range of joint {i + 1} is [{lower:g}, {upper:g}]: must be finite and not empty"
                )
