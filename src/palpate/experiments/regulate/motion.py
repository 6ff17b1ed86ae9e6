"""Motions of a tip along a surface: options, files of recorded positions or velocities, and their checks."""

import math
from bisect import bisect_right
from typing import TypeVar

import numpy as np

from palpate.bounded_file import read_text
from palpate.controllers.tangent_motion import (
    CircleMotion,
    PathTable,
    SineMotion,
    Still,
    TangentMotion,
    VelocityTable,
)
from palpate.csv_table import BOUNDS, read_csv_table
from palpate.errors import InvalidValueError
from palpate.experiments.kit.checks import check_acceleration, check_speed
from palpate.experiments.regulate.config import LARGEST_MOTION, MOTION_TEXT, RegulateConfig
from palpate.kinematics import FollowedPath, StandingArm, follow_path
from palpate.runtime import Limits
from palpate.spatial import Vector, add_scaled, norm, subtract
from palpate.unit_ranges import RANGES

_COLUMNS = 4
"""Number of columns: time, and three coordinates."""

_MAX_NUMBER = RANGES["s"].most
"""Largest absolute value of times [s] and coordinates."""

_MAX_EXTENT = 1.8 * LARGEST_MOTION
"""Largest distance along x or y from the begin of a motion from a file [m]: the plate ends after 0.1 m."""

_STEP, _MAX_STEPS = 0.01, 20_000
"""Time between positions at which joints are checked [s]; largest number of these positions."""

_Table = TypeVar("_Table", PathTable, VelocityTable)

_COORDINATES = {PathTable: "position x, y, z [m]", VelocityTable: "velocity along x, y, z [m/s]"}


def motion_of(config: RegulateConfig, kept: str | None = None) -> TangentMotion:
    """Return the motion of the tip along the surface.

    Args:
        config: Configuration.
        kept: Text of the motion's file from a log; if None, the file is read.

    Raises:
        InvalidValueError: If the file cannot be read, or is no motion.
    """
    frequency = config.motion_speed / (2.0 * math.pi * config.motion_size)
    match config.motion:
        case "still":
            return Still()
        case "sine":
            return SineMotion(config.motion_size, frequency)
        case "circle":
            return CircleMotion(config.motion_size, frequency)
        case "path" | "table":
            assert config.motion_file is not None  # RegulateConfig has made sure
            name, text = MOTION_TEXT, kept
            if text is None:
                name = str(config.motion_file)
                try:
                    text = read_text(config.motion_file, BOUNDS, "a motion is CSV text")
                except OSError as error:
                    raise InvalidValueError(f"motion_file = {name}: cannot be read: {error.strerror}") from None
            if config.motion == "path":
                return read_motion(PathTable, text, name)
            return read_motion(VelocityTable, text, name)


def read_motion(kind: type[_Table], text: str, name: str) -> _Table:
    """Return the motion of a file.

    Args:
        kind: Kind of motion: recorded positions, or velocities.
        text: CSV with time [s] and position [m], or velocity [m/s], along x, y and z; a first line with names, or
            none.
        name: Name of the file, for messages.

    Raises:
        InvalidValueError: If the text is no motion of that kind.
    """
    table = read_csv_table(text, name, f"four numbers, time [s] and {_COORDINATES[kind]}", _COLUMNS)
    numbers = table.numbers()
    wrong = np.flatnonzero(~(np.abs(numbers) <= _MAX_NUMBER).all(axis=1))
    if len(wrong):
        raise InvalidValueError(
            f"{name}, line {table.lines[wrong[0]]}: every number must be finite, at most {_MAX_NUMBER:g} in size"
        )
    try:
        return kind(tuple(numbers[:, 0].tolist()), tuple((x, y, z) for _, x, y, z in numbers.tolist()))
    except InvalidValueError as error:
        raise InvalidValueError(f"{name}: {error}") from None


def motion_text(motion: TangentMotion) -> str | None:
    """Return CSV text that `read_motion` reads back to the same bits; None for a motion that came from no file."""
    match motion:
        case PathTable():
            heading, rows = "time_s,x_m,y_m,z_m", motion.positions
        case VelocityTable():
            heading, rows = "time_s,vx_m_per_s,vy_m_per_s,vz_m_per_s", motion.velocities
        case _:
            return None
    lines = (f"{time!r},{x!r},{y!r},{z!r}" for time, (x, y, z) in zip(motion.times, rows, strict=True))
    return "\n".join([heading, *lines, ""])


def speed_along(config: RegulateConfig, motion: TangentMotion) -> float:
    """Return the largest speed of a motion [m/s]."""
    if isinstance(motion, PathTable | VelocityTable):
        return motion.fastest
    return 0.0 if config.motion == "still" else config.motion_speed


def acceleration_along(motion: TangentMotion, duration: float, period: float) -> float:
    """Return the largest change of a motion's velocity from period to period, over the period [m/s^2].

    Args:
        motion: Motion along the surface.
        duration: Time for which the motion is played [s].
        period: Control period [s].
    """
    match motion:
        case SineMotion(amplitude=size) | CircleMotion(radius=size):
            return float(size * (2.0 * math.pi * motion.frequency) ** 2)
        case PathTable() | VelocityTable():
            begin = motion.times[0] if isinstance(motion, PathTable) else 0.0
            knots = motion.times[: bisect_right(motion.times, begin + duration)]
            # between two knots velocity is linear or quadratic: the largest change is next to a knot
            times = {max(knot - begin - share * period, 0.0) for knot in knots for share in (0.0, 0.5, 1.0)}
            changes = (subtract(motion.velocity(time + period), motion.velocity(time)) for time in times)
            return max(map(norm, changes), default=0.0) / period
        case _:
            return 0.0


def check_motion(
    config: RegulateConfig, motion: TangentMotion, duration: float, period: float, limits: Limits
) -> None:
    """Refuse a motion with more speed, acceleration or extent than robot and plate allow.

    Args:
        config: Configuration.
        motion: Motion along the surface.
        duration: Time for which the motion is played [s].
        period: Control period [s].
        limits: Limits of the robot.

    Raises:
        InvalidValueError: If the motion exceeds a limit.
    """
    acceleration = acceleration_along(motion, duration, period)
    if not isinstance(motion, PathTable | VelocityTable):
        check_speed("motion_speed", speed_along(config, motion), limits)
        remedy = "move more slowly or farther (--motion-speed, --motion-size)"
        check_acceleration("motion_speed, motion_size: the acceleration", acceleration, limits, remedy)
        return
    file = f"motion_file = {config.motion_file}: its"
    check_speed(f"{file} fastest", motion.fastest, limits)
    check_acceleration(
        f"{file} largest acceleration", acceleration, limits, "turn and start more slowly in the file"
    )
    if motion.farthest > _MAX_EXTENT:
        raise InvalidValueError(
            f"motion_file = {config.motion_file}: it goes {motion.farthest:.3g} m away from where it begins: "
            f"must be at most {_MAX_EXTENT:g} m, or the tip would leave the plate; metres are meant"
        )


def followed_motion(
    arm: StandingArm, motion: TangentMotion, duration: float, descent: float, fastest: float
) -> FollowedPath:
    """Return the joint motion of an arm that descends [m] and is then moved along the surface.

    Args:
        arm: Arm over the object.
        motion: Motion along the surface.
        duration: Time for which the motion is played [s].
        descent: Largest distance down to the surface [m].
        fastest: Largest speed of landing and motion [m/s].

    Raises:
        InvalidValueError: If a joint or a singularity is in the way.
    """
    points: list[Vector] = [add_scaled(arm.position, -descent, (0.0, 0.0, 1.0)), arm.position]
    step = max(_STEP, duration / _MAX_STEPS)
    for i in range(int(duration / step)):
        points.append(add_scaled(points[-1], step, motion.velocity((i + 0.5) * step)))
    return follow_path(arm, points, fastest)
