"""How far a held object is above the table that it stood on, by the simulation's truth."""

import numpy as np

from palpate.errors import FloatArray
from palpate.experiments.grasp.config import GraspConfig


def clearance(config: GraspConfig, height: FloatArray, quat_wxyz: FloatArray) -> FloatArray:
    """Return the height of an object's lowest point above the table, shape (n,) [m]; 0 or less: it stands on it.

    Args:
        config: What is held; its origin is its centre, and stands half a height above the table at height 0.
        height: Of its origin, base frame, shape (n,) [m].
        quat_wxyz: Its orientation, object to base, shape (n, 4). A cylinder's axis is its x.
    """
    w, x, y, z = np.moveaxis(quat_wxyz, -1, 0)
    up = np.stack([2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)], axis=-1)
    sizes = config.sizes
    if config.object == "box":
        below = np.abs(up) @ (0.5 * np.array(sizes))
    elif config.object == "cylinder":
        below = 0.5 * sizes[1] * np.abs(up[..., 0]) + sizes[0] * np.sqrt(np.maximum(0.0, 1.0 - up[..., 0] ** 2))
    else:
        below = np.full(w.shape, sizes[0])
    lowest: FloatArray = height + config.half_height - below
    return lowest
