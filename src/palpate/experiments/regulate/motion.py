"""Motions of a tip along a surface, as files: recorded positions, or velocities, over time."""

import csv
import math
from typing import TypeVar

from palpate.controllers.tangent_motion import PathTable, TangentMotion, VelocityTable
from palpate.errors import InvalidValueError
from palpate.spatial import Vector

COLUMNS = 4
"""Time, and three coordinates."""

Table = TypeVar("Table", PathTable, VelocityTable)
"""What a file can describe."""

_VECTOR = {PathTable: "position x, y, z [m]", VelocityTable: "velocity along x, y, z [m/s]"}
"""What follows the time in each line of it, for messages."""


def read_motion(kind: type[Table], text: str, name: str) -> Table:
    """Return the motion that a file describes.

    Args:
        kind: Of motion: recorded positions, or velocities.
        text: CSV with time [s] and position [m], or velocity [m/s], along x, y and z; a first line with names, or
            none.
        name: Of the file, for messages.

    Raises:
        InvalidValueError: It is no such file.
    """
    times, rows = _read(text, name, _VECTOR[kind])
    try:
        return kind(tuple(times), tuple(rows))
    except InvalidValueError as error:
        raise InvalidValueError(f"{name}: {error}") from None


def motion_text(motion: TangentMotion) -> str | None:
    """Return the text of a file that reads back to the same bits; None if the motion came from none."""
    if isinstance(motion, PathTable):
        return _text("time_s,x_m,y_m,z_m", motion.times, motion.positions)
    if isinstance(motion, VelocityTable):
        return _text("time_s,vx_m_per_s,vy_m_per_s,vz_m_per_s", motion.times, motion.velocities)
    return None


def _text(heading: str, times: tuple[float, ...], rows: tuple[Vector, ...]) -> str:
    lines = (f"{time!r},{x!r},{y!r},{z!r}" for time, (x, y, z) in zip(times, rows, strict=True))
    return "\n".join([heading, *lines, ""])


def _read(text: str, name: str, what: str) -> tuple[list[float], list[Vector]]:
    times: list[float] = []
    rows: list[Vector] = []
    first = True
    for i, row in enumerate(csv.reader(text.removeprefix("\ufeff").splitlines())):
        if not "".join(row).strip() or row[0].lstrip().startswith("#"):
            continue
        heading, first = first, False
        try:
            t, x, y, z = map(float, row)
        except ValueError:
            if heading and len(row) == COLUMNS and not any(map(_number, row)):
                continue
            shown = ",".join(row)
            raise InvalidValueError(
                f"{name}, line {i + 1}, {shown[:60]!r}: must be four numbers with commas between them, time [s] "
                f"and {what}"
            ) from None
        if not math.isfinite(t + x + y + z):
            raise InvalidValueError(f"{name}, line {i + 1}: every number must be finite")
        times.append(t)
        rows.append((x, y, z))
    if not times:
        raise InvalidValueError(
            f"{name}: no line with numbers; write time [s] and {what}, with commas between them"
        )
    return times, rows


def _number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
