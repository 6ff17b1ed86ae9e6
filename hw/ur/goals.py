"""What an arm may be asked for: lengths, finite numbers and limits, before anything is sent.

The library checks no lengths: five numbers instead of six make it wait for five minutes.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from palpate.errors import InvalidValueError, numbers
from palpate.hw.ur.exchange import UrState
from palpate.hw.ur.settings import UrSettings
from palpate.kinematics.pose import (
    Pose,
    checked_pose,
    rotation_from_rotvec,
    rotvec_from_rotation,
    times,
    transposed,
)
from palpate.spatial import Vector, norm, subtract

_ROUNDING = 1e-9
"""Relative: a speed that was limited to the limit may come out a little above."""


def checked_velocity(settings: UrSettings, velocity: Vector, angular_velocity: Vector) -> tuple[float, ...]:
    """Return both as six numbers [m/s, rad/s].

    Raises:
        InvalidValueError: Above a limit, not finite, or not three numbers each.
    """
    v = _three("velocity_base_tip", velocity, settings.speed, "m/s", "speed")
    w = _three("angular_velocity_base_tip", angular_velocity, settings.angular_speed, "rad/s", "angular_speed")
    return v + w


def checked_joints(settings: UrSettings, goal: Sequence[float], state: UrState) -> tuple[float, ...]:
    """Return six joint goals [rad] that can be reached at the speed allowed while the servo looks ahead.

    Raises:
        InvalidValueError: Otherwise.
    """
    joints = six("joint_position", goal, "rad")
    reach = settings.joint_speed * (settings.lookahead + settings.watchdog)
    for i, (wanted, actual) in enumerate(zip(joints, state.joint_position, strict=True)):
        if not abs(wanted - actual) <= reach:
            raise InvalidValueError(
                f"joint_position: the goal of joint {i + 1} is {wanted - actual:+.3g} rad away; at most "
                f"{reach:.3g} rad can be reached at UrSettings.joint_speed: give a stream of goals that begins "
                "where it is"
            )
    return joints


def checked_pose_goal(settings: UrSettings, goal: Pose, state: UrState) -> tuple[float, ...]:
    """Return position [m] and rotation vector [rad] of a goal that can be reached likewise.

    Raises:
        InvalidValueError: Otherwise.
    """
    checked_pose("pose_base_tip", goal)
    x, y, z, rx, ry, rz = state.tool_pose
    time = settings.lookahead + settings.watchdog
    distance = norm(subtract(goal.position, (x, y, z)))
    turn = norm(rotvec_from_rotation(times(goal.rotation, transposed(rotation_from_rotvec((rx, ry, rz))))))
    if not distance <= settings.speed * time or not turn <= settings.angular_speed * time:
        raise InvalidValueError(
            f"pose_base_tip is {1e3 * distance:.3g} mm and {turn:.3g} rad away; at most "
            f"{1e3 * settings.speed * time:.3g} mm and {settings.angular_speed * time:.3g} rad can be reached at "
            "UrSettings.speed and angular_speed: give a stream of goals that begins where it is"
        )
    return (*goal.position, *rotvec_from_rotation(goal.rotation))


@dataclass(frozen=True, slots=True)
class ForceTask:
    """What force mode is to hold. Other axes are held in position.

    Attributes:
        pose_base_task: Frame in which it is stated.
        compliant: Along and about which axes of that frame it yields: x, y, z, then about them.
        wrench_on_object: That the tool exerts on what it touches, about the TCP, task frame [N, N m]; what the
            object exerts on the tool is the opposite. Only the compliant axes' count.
        speed: Limit along compliant axes [m/s].
        angular_speed: Limit about compliant axes [rad/s].
        deviation: Of the other axes, until the controller stops itself [m].
        angular_deviation: Likewise [rad].
    """

    compliant: tuple[bool, bool, bool, bool, bool, bool]
    wrench_on_object: tuple[float, float, float, float, float, float]
    pose_base_task: Pose = field(default_factory=Pose)
    speed: float = 0.05
    angular_speed: float = 0.2
    deviation: float = 0.01
    angular_deviation: float = 0.1

    def checked(self, settings: UrSettings) -> tuple[float, ...]:
        """Return frame, selection, wrench and limits, six numbers each.

        Raises:
            InvalidValueError: Beyond the limits, or of the wrong kind.
        """
        pose = checked_pose("pose_base_task", self.pose_base_task)
        wrench = six("wrench_on_object", self.wrench_on_object, "N, N m")
        selection = six("compliant", self.compliant, "")
        if any(s not in (0.0, 1.0) for s in selection):
            raise InvalidValueError(f"compliant = {self.compliant!r}: must be six of True and False")
        asked = tuple(s * w for s, w in zip(selection, wrench, strict=True))
        _most("wrench_on_object, force", math.hypot(*asked[:3]), settings.force, "N", "force")
        _most("wrench_on_object, moment", math.hypot(*asked[3:]), settings.moment, "N m", "moment")
        _most("speed", self.speed, settings.speed, "m/s", "speed")
        _most("angular_speed", self.angular_speed, settings.angular_speed, "rad/s", "angular_speed")
        free = (self.speed,) * 3 + (self.angular_speed,) * 3
        held = (self.deviation,) * 3 + (self.angular_deviation,) * 3
        if not all(limit > 0.0 and math.isfinite(limit) for limit in free + held):
            raise InvalidValueError("speed, angular_speed and deviations of a ForceTask must be finite, above 0")
        limits = tuple(f if s else h for s, f, h in zip(selection, free, held, strict=True))
        return (*pose.position, *rotvec_from_rotation(pose.rotation), *selection, *asked, *limits)


def six(name: str, values: Sequence[float], unit: str) -> tuple[float, ...]:
    """Return six finite numbers.

    Raises:
        InvalidValueError: Otherwise.
    """
    array = numbers(name, values)
    if array.shape != (6,):
        raise InvalidValueError(f"{name} has shape {array.shape}: must be (6,) [{unit}]")
    found = tuple(array.tolist())
    if not all(map(math.isfinite, found)):
        raise InvalidValueError(f"{name} = {found}: every entry must be finite [{unit}]")
    return found


def _three(name: str, values: Vector, most: float, unit: str, setting: str) -> tuple[float, ...]:
    try:
        x, y, z = map(float, values)
    except (TypeError, ValueError):
        raise InvalidValueError(f"{name} = {values!r}: must be three numbers [{unit}]") from None
    _most(name, math.hypot(x, y, z), most, unit, setting)
    return (x, y, z)


def _most(name: str, value: float, most: float, unit: str, setting: str) -> None:
    if not abs(value) <= most * (1.0 + _ROUNDING):  # so that nan does not pass
        raise InvalidValueError(
            f"{name} = {value:g} {unit}: the limit is {most:g} {unit}; ask for less, or raise UrSettings.{setting}"
        )
