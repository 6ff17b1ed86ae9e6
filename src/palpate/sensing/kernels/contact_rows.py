"""What kernels share: the wrench as the tip sees it, rows without a contact, and what they return."""

import math

from palpate.compiling import njit


@njit(error_model="numpy")
def in_tip_frame(w, center, r, force):
    """Return a wrench over its force, about the tip's center and in its axes: (f, m), each of three.

    Args:
        w: Wrench about the sensor frame's origin, shape (6,) [N, N m].
        center: Of the tip, in the sensor frame, shape (3,) [m].
        r: Columns are the tip's axes in sensor coordinates, shape (3, 3).
        force: Length of the force [N].
    """
    fx, fy, fz = w[0] / force, w[1] / force, w[2] / force
    mx = (w[3] - (center[1] * w[2] - center[2] * w[1])) / force
    my = (w[4] - (center[2] * w[0] - center[0] * w[2])) / force
    mz = (w[5] - (center[0] * w[1] - center[1] * w[0])) / force
    f = (
        r[0, 0] * fx + r[1, 0] * fy + r[2, 0] * fz,
        r[0, 1] * fx + r[1, 1] * fy + r[2, 1] * fz,
        r[0, 2] * fx + r[1, 2] * fy + r[2, 2] * fz,
    )
    m = (
        r[0, 0] * mx + r[1, 0] * my + r[2, 0] * mz,
        r[0, 1] * mx + r[1, 1] * my + r[2, 1] * mz,
        r[0, 2] * mx + r[1, 2] * my + r[2, 2] * mz,
    )
    return f, m


@njit(error_model="numpy")
def clear_contact(result, stride, i):
    """Write that wrench i has no contact: NaN, and an infinite condition; its force stays."""
    for j in range(3):
        result[3 * i + j] = math.nan
        result[3 * (stride + i) + j] = math.nan
        result[3 * (3 * stride + i) + j] = math.nan
    result[12 * stride + i] = math.nan
    result[13 * stride + i] = math.nan
    result[14 * stride + i] = math.inf


@njit(cache=True, error_model="numpy")
def last_scalars(result, status):
    """Return normal force, spin torque, condition and status of the last contact: of one, all but its vectors.

    So a single contact needs no second look into the arrays, which costs more from Python than the look itself.
    """
    if len(status) == 0:
        return math.nan, math.nan, math.inf, 0
    stride, i = len(result) // 15, len(status) - 1
    return result[12 * stride + i], result[13 * stride + i], result[14 * stride + i], int(status[i])
