"""Known loads of a calibration: given as wrenches, or weights in known poses; and the temperature beside them."""

from dataclasses import dataclass

import numpy as np

from palpate.commands.calibrate.config import RotationOrder
from palpate.commands.calibrate.data import CsvData, has_wrenches, measured_poses, wrenches
from palpate.errors import FloatArray
from palpate.sensing.ft.arrays import AXES
from palpate.sensing.ft.left_out import equal_loads
from palpate.spatial import Vector, Wrench

MASS_UNITS = {"kg": 1.0, "g": 1e-3}
LENGTH_UNITS = {"m": 1.0, "mm": 1e-3}
CENTER = ("com_x", "com_y", "com_z")
TEMPERATURE = "temperature_c"


@dataclass(frozen=True, slots=True, eq=False)
class KnownLoads:
    """Loads, each an average over the rows that were taken of it in one go.

    Attributes:
        raw: What the sensor showed, shape (n, k) [raw unit].
        wrench: The loads, shape (n, 6) [N, N m].
        temperature: Shape (n,) [degrees Celsius]; None: not in the file.
        rows: Of the file.
    """

    raw: FloatArray
    wrench: FloatArray
    temperature: FloatArray | None
    rows: int


def known_loads(
    data: CsvData, raw: FloatArray, limits: Wrench, rotation: RotationOrder, up_base: Vector, gravity: float
) -> KnownLoads:
    """Return the known loads of a file, with what the sensor showed.

    Rows of one load that follow one another are readings of it, not loads: their average counts, once.

    Args:
        data: The file.
        raw: Its raw channels, shape (rows, k).
        limits: Of the sensor [N, N m].
        rotation: What rotations and quaternions map.
        up_base: Upward direction in base coordinates.
        gravity: Local g [m/s^2].

    Raises:
        InvalidValueError: Neither wrenches nor weights in poses, or something in them is wrong.
    """
    if has_wrenches(data) or _place(data, "mass", MASS_UNITS) is None:
        wrench = wrenches(data, limits)
    else:
        wrench = _of_weights(data, limits, rotation, up_base, gravity)
    columns = [raw, wrench]
    lower = [column.lower() for column in data.columns]
    warm = lower.count(TEMPERATURE)
    if warm > 1:
        raise data.wrong_header("temperature_C is there twice; keep one")
    if warm:
        columns.append(data.numbers([lower.index(TEMPERATURE)]))
    changes = np.flatnonzero(np.diff(equal_loads(wrench))) + 1
    mean = np.array([rows.mean(axis=0) for rows in np.split(np.hstack(columns), changes)])
    k = raw.shape[1]
    return KnownLoads(mean[:, :k], mean[:, k : k + 6], mean[:, k + 6] if warm else None, len(raw))


def _of_weights(
    data: CsvData, limits: Wrench, rotation: RotationOrder, up_base: Vector, gravity: float
) -> FloatArray:
    """Return what weights put on the tip side of a sensor at rest, shape (n, 6) [N, N m]."""
    found = {name: _place(data, name, LENGTH_UNITS) for name in CENTER}
    if missing := [f"{name}_m" for name, place in found.items() if place is None]:
        raise data.wrong_header(
            f"mass_kg, but no column {', '.join(missing)}: the centre of mass in the sensor frame is needed"
        )
    places = [place for place in (_place(data, "mass", MASS_UNITS), *found.values()) if place is not None]
    numbers = data.numbers([place for place, _ in places], [factor for _, factor in places])
    mass, center = numbers[:, :1], numbers[:, 1:]
    if (bad := np.flatnonzero(mass[:, 0] < 0.0)).size:
        raise data.wrong(int(bad[0]), f"the mass is {mass[bad[0], 0]:g} kg: must be 0 or more")
    force = -mass * measured_poses(data, rotation, up_base, gravity).specific_force
    wrench = np.hstack([force, np.cross(center, force)])
    beyond = np.argwhere(np.abs(wrench) > np.array(limits))
    if len(beyond):
        i, j = beyond[0].tolist()
        raise data.wrong(
            i,
            f"this weight makes {AXES[j]} {wrench[i, j]:g} {'N' if j < 3 else 'N m'}: beyond the sensor's range "
            f"of {limits[j]:g}; grams for kilograms, or millimetres for metres?",
        )
    return wrench


def _place(data: CsvData, name: str, units: dict[str, float]) -> tuple[int, float] | None:
    """Return the column of a quantity, and its factor; None if there is none."""
    lower = [column.lower() for column in data.columns]
    there = [
        (lower.index(f"{name}_{unit}"), factor) for unit, factor in units.items() if f"{name}_{unit}" in lower
    ]
    if len(there) > 1 or any(lower.count(f"{name}_{unit}") > 1 for unit in units):
        raise data.wrong_header(f"{name} is there twice; keep one")
    return there[0] if there else None
