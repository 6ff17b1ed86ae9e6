"""Where the arm was at times between its samples."""

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from palpate.errors import FloatArray

MAX_MAGNITUDE = 1e12
"""[s, m] Beyond it a number is a damaged one, also if it is finite."""

SKEWED = 1e-3
"""Largest entry of R'R - 1 of what is still a rotation: that of a robot that sends single precision."""


def poses_at(
    wanted: FloatArray, time: FloatArray, position: FloatArray, rotation: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return poses at other times, straight between neighbouring samples, turning steadily.

    A row whose two times are the same keeps its pose to the last bit. So does one with a time that cannot be;
    samples with poses that cannot be are passed over. Beyond the first and the last sample the nearest one holds.

    Args:
        wanted: Times, one per row, shape (n,) [s].
        time: Of the samples, hardly ever decreasing, shape (n,) [s].
        position: Shape (n, 3) [m].
        rotation: Shape (n, 3, 3).

    Returns:
        Positions (n, 3) [m] and rotations (n, 3, 3).
    """
    late = np.flatnonzero((wanted != time) & (np.abs(wanted) < MAX_MAGNITUDE) & (np.abs(time) < MAX_MAGNITUDE))
    usable = np.asarray((np.abs(time) < MAX_MAGNITUDE) & (np.abs(position) < MAX_MAGNITUDE).all(axis=1))
    usable[usable] = proper_rotations(rotation[usable])
    samples = np.flatnonzero(usable)
    if not len(late) or not len(samples):
        return position, rotation
    times, first = np.unique(time[samples], return_index=True)
    samples = samples[first]
    after = np.clip(np.searchsorted(times, wanted[late], side="right"), 1, max(len(times) - 1, 1))
    before, after = samples[after - 1], samples[np.minimum(after, len(samples) - 1)]
    step = time[after] - time[before]
    share = np.where(step > 0.0, (wanted[late] - time[before]) / np.where(step > 0.0, step, 1.0), 0.0)
    share = np.clip(share, 0.0, 1.0)
    moved, turned = position.copy(), rotation.copy()
    moved[late] = position[before] + share[:, None] * (position[after] - position[before])
    turned[late] = rotation[before]
    turning = (rotation[before] != rotation[after]).any(axis=(1, 2))  # most robots hold their tip upright
    if turning.any():
        i, j = before[turning], after[turning]
        by = Rotation.from_matrix(rotation[i].transpose(0, 2, 1) @ rotation[j]).as_rotvec()
        part = Rotation.from_rotvec(share[turning, None] * by).as_matrix()
        turned[late[turning]] = rotation[i] @ part
    return moved, turned


def quaternions_xyzw(rotation: FloatArray) -> FloatArray:
    """Return rotations (n, 3, 3) as unit quaternions (n, 4), by their largest component (Shepperd 1978).

    The log's writer calls this: for 20 matrices scipy's takes five times as long, in Python.
    """
    a, b, c, d, e, f, g, h, i = rotation.reshape(-1, 9).T
    candidates = np.array(
        [
            [1.0 + a - e - i, b + d, c + g, h - f],
            [b + d, 1.0 - a + e - i, f + h, c - g],
            [c + g, f + h, 1.0 - a - e + i, d - b],
            [h - f, c - g, d - b, 1.0 + a + e + i],
        ]
    )
    largest = candidates.diagonal().argmax(axis=1)
    chosen = candidates[largest, :, np.arange(len(largest))]
    return np.asarray(chosen / np.sqrt(np.square(chosen).sum(axis=1, keepdims=True)))


def proper_rotations(rotation: FloatArray) -> npt.NDArray[np.bool_]:
    """Return which of some matrices (n, 3, 3), of any numbers, are rotations."""
    fine = np.asarray((np.abs(rotation) <= 1.0 + SKEWED).all(axis=(1, 2)))
    R = rotation[fine]
    fine[fine] = (np.abs(R.transpose(0, 2, 1) @ R - np.eye(3)) <= SKEWED).all(axis=(1, 2)) & (np.linalg.det(R) > 0)
    return fine
