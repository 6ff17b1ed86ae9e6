"""What an accelerometer at the sensor would show in static poses."""

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray, InvalidValueError, positive, vector
from palpate.sensing.ft.arrays import finite_rows

STANDARD_GRAVITY = 9.80665
"""[m/s^2], by definition (CGPM 1901). The true value is 9.780 to 9.832 at sea level: 0.3 % of a payload's mass."""

GRAVITY_SD = 0.015
"""[m/s^2] of g where it is not known: anywhere at sea level, (9.832 - 9.780)/sqrt(12)."""

ROTATION_TOLERANCE = 1e-6
"""Largest entry of R'R - I in a measured pose: six digits, as robots and logs give them."""


def specific_force_from_rotations(
    rotation_sensor_base: npt.ArrayLike,
    *,
    gravity: float = STANDARD_GRAVITY,
    up_base: tuple[float, float, float] = (0.0, 0.0, 1.0),
) -> FloatArray:
    """Return the specific force at rest in the sensor frame: it points up and has length g.

    Args:
        rotation_sensor_base: Maps base to sensor coordinates, shape (n, 3, 3).
        gravity: Local g [m/s^2].
        up_base: Upward direction in base coordinates (a robot on a wall: not z); any length.

    Returns:
        Shape (n, 3) [m/s^2].

    Raises:
        InvalidValueError: Not (n, 3, 3), not rotations, or no direction of up.
    """
    g = positive("gravity", gravity, "m/s^2")
    up = vector("up_base", up_base, 3, "")
    length = float(np.linalg.norm(up))
    if length == 0.0:
        raise InvalidValueError("up_base = (0, 0, 0): must have a direction")
    try:
        rotations = np.array(rotation_sensor_base, dtype=np.float64)
    except (TypeError, ValueError):
        raise InvalidValueError("rotation_sensor_base: must be numbers in a regular array (n, 3, 3)") from None
    if rotations.ndim != 3 or rotations.shape[1:] != (3, 3):
        raise InvalidValueError(f"rotation_sensor_base has shape {rotations.shape}: must be (n, 3, 3)")
    defect = np.abs(rotations.transpose(0, 2, 1) @ rotations - np.eye(3)).max(axis=(1, 2))
    x, y, z = rotations.transpose(1, 0, 2)
    reflects = ~((np.cross(x, y) * z).sum(axis=1) > 0.0)
    bad = np.flatnonzero(~(defect <= ROTATION_TOLERANCE) | reflects)
    if len(bad):
        raise InvalidValueError(
            f"rotation_sensor_base[{bad[0]}] is no rotation: the largest entry of R'R - I is "
            f"{defect[bad[0]]:.1e}, the limit is {ROTATION_TOLERANCE:.0e}, and its determinant must be +1"
        )
    return np.asarray(rotations @ (up * (g / length)))


def specific_force_from_gravity(
    direction_sensor: npt.ArrayLike, *, gravity: float = STANDARD_GRAVITY
) -> FloatArray:
    """Return the specific force at rest from directions of gravity (downwards) in the sensor frame.

    Args:
        direction_sensor: Shape (n, 3), any length above zero.
        gravity: Local g [m/s^2].

    Raises:
        InvalidValueError: Not (n, 3), not finite, or a direction of length zero.
    """
    g = positive("gravity", gravity, "m/s^2")
    down = finite_rows("direction_sensor", direction_sensor, 3, "")
    length = np.linalg.norm(down, axis=1, keepdims=True)
    if not (length > 0.0).all():
        raise InvalidValueError(f"direction_sensor[{int(np.argmin(length))}] is zero: must have a direction")
    return np.asarray(-g * down / length)
