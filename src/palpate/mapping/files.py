"""Touch clouds and height maps as files that other programs read: PLY and CSV.

Coordinates are those of the robot's base frame in metres, forces in newtons. Files appear whole or not at all
(`palpate.atomic_file`). PLY: Greg Turk, "The PLY Polygon File Format", 1994, binary little endian.
"""

import os
from collections.abc import Sequence

import msgspec
import numpy as np

from palpate.atomic_file import replacing
from palpate.errors import FloatArray
from palpate.mapping.cloud import TouchCloud
from palpate.mapping.height_map import HeightMap

PathLike = str | os.PathLike[str]

_PROPERTIES = ("x", "y", "z", "nx", "ny", "nz", "time", "normal_force", "fx", "fy", "fz", "spin_torque")
"""PLY properties of a contact; x to nz are the names that mesh viewers know, f is the tangential force."""

_COLUMNS = (
    "x_m",
    "y_m",
    "z_m",
    "nx",
    "ny",
    "nz",
    "time_s",
    "normal_force_N",
    "tangential_force_x_N",
    "tangential_force_y_N",
    "tangential_force_z_N",
    "spin_torque_Nm",
)


def write_cloud_ply(cloud: TouchCloud, path: PathLike) -> None:
    """Write every contact as a PLY vertex with its normal, time and forces, in double precision.

    Raises:
        OSError: The file cannot be written.
    """
    with replacing(path) as file:
        file.write(_ply_header(len(cloud)))
        file.write(_table(cloud).astype("<f8").tobytes())


def write_cloud_csv(cloud: TouchCloud, path: PathLike) -> None:
    """Write every contact as a CSV row; the header names the units, numbers keep every digit.

    Raises:
        OSError: The file cannot be written.
    """
    _write_csv(path, _COLUMNS, _table(cloud))


def write_height_map_csv(height_map: HeightMap, path: PathLike) -> None:
    """Write every grid point as a CSV row, `z_m` being `nan` where nothing was felt.

    Raises:
        OSError: The file cannot be written.
    """
    x, y = np.meshgrid(height_map.x, height_map.y)
    columns = (x, y, height_map.z, height_map.distance)
    _write_csv(path, ("x_m", "y_m", "z_m", "distance_to_contact_m"), np.stack(columns, axis=-1).reshape(-1, 4))


def _table(cloud: TouchCloud) -> FloatArray:
    """The contacts as rows in the order of `_PROPERTIES` and `_COLUMNS`."""
    return np.column_stack(
        [
            cloud.position,
            cloud.normal,
            cloud.time,
            cloud.normal_force,
            cloud.tangential_force,
            cloud.spin_torque,
        ]
    )


def _write_csv(path: PathLike, columns: Sequence[str], rows: FloatArray) -> None:
    """Write rows (n, k) below the names of their columns."""
    # JSON's numbers are the shortest that read back the same, as Python's, and are made ten times as quickly
    lines = msgspec.json.encode(rows.tolist())[2:-2].replace(b"],[", b"\n").replace(b"null", b"nan")
    with replacing(path) as file:
        file.write(",".join(columns).encode("ascii") + b"\n" + lines + b"\n" * bool(lines))


def _ply_header(vertices: int) -> bytes:
    lines = ["ply", "format binary_little_endian 1.0", "comment written by palpate"]
    lines += ["comment frame: robot base; units: m, s, N, N m", f"element vertex {vertices}"]
    lines += [f"property double {name}" for name in _PROPERTIES]
    return "\n".join([*lines, "end_header", ""]).encode("ascii")
