"""What may have been mixed up in measured poses: the other reading of the same data that fits is named."""

from collections.abc import Callable, Iterator

import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.estimation import Assumption, BrokenAssumption
from palpate.sensing.ft.payload import IdentifiedPayload
from palpate.sensing.ft.poses import specific_force_from_rotations
from palpate.spatial import Vector

CLEARLY = 0.3
"""Residuals of another reading in units of those as read, below which that reading is meant."""

Identify = Callable[[FloatArray, FloatArray], IdentifiedPayload]
"""From specific forces and wrenches."""


def likely_mistake(
    rotation_sensor_base: FloatArray,
    wrench: FloatArray,
    as_read: IdentifiedPayload | None,
    identify: Identify,
    *,
    gravity: float,
    up_base: Vector,
) -> BrokenAssumption | None:
    """Return what explains the data better than the poses as they were read, if anything does.

    Args:
        rotation_sensor_base: Base to sensor coordinates, as read, shape (n, 3, 3).
        wrench: As read, shape (n, 6) [N, N m].
        as_read: What was identified; None if that was refused.
        identify: The identification.
        gravity: Local g [m/s^2].
        up_base: Upward direction in base coordinates.
    """
    fitting: list[tuple[float, BrokenAssumption]] = []
    for finding, remedy, rotations, rows in _other_readings(rotation_sensor_base, wrench):
        up = specific_force_from_rotations(rotations, gravity=gravity, up_base=up_base)
        try:
            found = identify(up, rows)
        except InvalidValueError:
            continue
        better = as_read is not None and _size(found) < CLEARLY**2 * _size(as_read)
        if found.payload.mass > 0.0 and (better or found.verdict.ok):
            fitting.append((_size(found), BrokenAssumption(Assumption.UNIQUE, finding, remedy)))
    return min(fitting, key=lambda each: each[0])[1] if fitting else None


def _size(found: IdentifiedPayload) -> float:
    return found.force_chi2 + found.moment_chi2


def _other_readings(
    rotations: FloatArray, wrench: FloatArray
) -> Iterator[tuple[str, str, FloatArray, FloatArray]]:
    inverse = rotations.transpose(0, 2, 1)
    turned = np.hstack([(rotations @ part[:, :, None])[:, :, 0] for part in (wrench[:, :3], wrench[:, 3:])])
    yield (
        "the inverse rotations fit",
        "turn --rotation round: sensor-from-base for base-from-sensor, or the other way",
        inverse,
        wrench,
    )
    yield (
        "wrenches turned from base to sensor coordinates fit",
        "give wrenches in the sensor's frame: these are in the base's",
        rotations,
        turned,
    )
    for of, sense in ((inverse, "qx,qy,qz,qw"), (rotations, "qx,qy,qz,qw, and the inverse rotation")):
        # as quaternions map sensor to base, unless --rotation says otherwise: both are tried
        yield (
            f"quaternions in the order {sense} fit",
            "name their columns in the order in which the numbers stand: the real part last",
            _reordered(of).transpose(0, 2, 1),
            wrench,
        )


def _reordered(rotations: FloatArray) -> FloatArray:
    """Return rotations whose quaternions, read as (w, x, y, z), were meant as (x, y, z, w)."""
    a, b, c, d = _quaternions_wxyz(rotations).T
    w, x, y, z = d, a, b, c
    rows = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
    return np.array(rows).transpose(2, 0, 1)


def _quaternions_wxyz(rotations: FloatArray) -> FloatArray:
    """Return quaternions of rotations: the eigenvector of the largest eigenvalue (Bar-Itzhack 2000)."""
    r = rotations.transpose(1, 2, 0)
    n = len(rotations)
    K = np.empty((n, 4, 4))
    K[:, 0, 0] = r[0, 0] + r[1, 1] + r[2, 2]
    K[:, 0, 1] = K[:, 1, 0] = r[2, 1] - r[1, 2]
    K[:, 0, 2] = K[:, 2, 0] = r[0, 2] - r[2, 0]
    K[:, 0, 3] = K[:, 3, 0] = r[1, 0] - r[0, 1]
    for i in range(3):
        for j in range(3):
            K[:, i + 1, j + 1] = r[i, j] + r[j, i]
    for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1))):
        K[:, i + 1, i + 1] = r[i, i] - r[j, j] - r[k, k]
    return np.linalg.eigh(K)[1][:, :, -1]
