"""Motions of a tip along a surface, as files: recorded positions, or velocities, over time."""

from typing import TypeVar

import numpy as np

from palpate.controllers.tangent_motion import PathTable, TangentMotion, VelocityTable
from palpate.csv_table import read_csv_table
from palpate.errors import InvalidValueError
from palpate.spatial import Vector
from palpate.unit_ranges import RANGES

COLUMNS = 4
"""Time, and three coordinates."""

LARGEST = RANGES["s"].most
"""Bounds every number: times [s], and the rest as well."""

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
    table = read_csv_table(text, name, f"four numbers, time [s] and {_VECTOR[kind]}", width=COLUMNS)
    numbers = table.numbers()
    wrong = np.flatnonzero(~(np.abs(numbers) <= LARGEST).all(axis=1))
    if len(wrong):
        raise table.wrong(int(wrong[0]), f"every number must be finite, at most {LARGEST:g} in size")
    try:
        return kind(tuple(numbers[:, 0].tolist()), tuple((x, y, z) for _, x, y, z in numbers.tolist()))
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
