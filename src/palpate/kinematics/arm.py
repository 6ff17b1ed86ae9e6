"""What a serial arm is: its geometry and its limits. Data only."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum

from palpate.errors import FloatArray, InvalidValueError, positive, vector
from palpate.kinematics.pose import Pose


class JointKind(Enum):
    """How a joint moves."""

    SLIDE = "slide"
    HINGE = "hinge"


@dataclass(frozen=True, slots=True)
class JointLimits:
    """What a joint may do.

    Attributes:
        lower: Least position [rad or m].
        upper: Largest position [rad or m].
        speed: Largest speed [rad/s or m/s].
        torque: Largest torque or force of its drive [N m or N].
    """

    lower: float
    upper: float
    speed: float
    torque: float

    def __post_init__(self) -> None:
        vector("joint range (lower, upper)", (self.lower, self.upper), 2, "rad or m")
        if not self.lower < self.upper:
            raise InvalidValueError(
                f"joint range: lower = {self.lower:g} must be below upper = {self.upper:g} (rad or m)"
            )
        positive("joint speed", self.speed, "rad/s or m/s")
        positive("joint torque", self.torque, "N m or N")


@dataclass(frozen=True, slots=True)
class Joint:
    """One joint of a chain: a hinge turns about z of its frame, a slide moves along it.

    Attributes:
        pose_before_joint: Of its frame at 0, in the frame of the joint before it, moved; of the first one, in the
            frame of the robot base.
        limits: What it may do.
        kind: Hinge or slide.
    """

    pose_before_joint: Pose
    limits: JointLimits
    kind: JointKind = JointKind.HINGE


@dataclass(frozen=True, slots=True)
class SerialArm:
    """A chain of joints from a robot base to a flange.

    Attributes:
        name: For messages.
        joints: From the robot base on.
        pose_joint_flange: Of the flange, in the frame of the last joint, moved.
    """

    name: str
    joints: tuple[Joint, ...]
    pose_joint_flange: Pose = field(default_factory=Pose)

    def __post_init__(self) -> None:
        if not self.joints:
            raise InvalidValueError(f"{self.name}: it has no joints: must have one or more")

    @property
    def limits(self) -> tuple[JointLimits, ...]:
        """Of each joint."""
        return tuple(joint.limits for joint in self.joints)

    def joint_position(self, name: str, value: Sequence[float] | FloatArray) -> tuple[float, ...]:
        """Return joint positions as floats if there is one per joint, each within its range [rad or m].

        Raises:
            InvalidValueError: Otherwise.
        """
        positions: list[float] = vector(name, value, len(self.joints), "rad or m").tolist()
        for i, (position, joint) in enumerate(zip(positions, self.joints, strict=True)):
            limits = joint.limits
            if not limits.lower <= position <= limits.upper:
                shown = f"{position:.4f} rad ({math.degrees(position):.1f} deg)"
                unit = "rad"
                if joint.kind is JointKind.SLIDE:
                    shown, unit = f"{position:.4f} m", "m"
                raise InvalidValueError(
                    f"{name}, joint {i + 1}, is {shown}: its range is {limits.lower:.4f} to "
                    f"{limits.upper:.4f} {unit}"
                )
        return tuple(positions)
