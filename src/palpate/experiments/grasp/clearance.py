"""How far a held object is above the table that it stood on, by the simulation's truth."""

import math

from palpate.experiments.grasp.config import GraspConfig


def clearance(config: GraspConfig, height: float, quat_wxyz: tuple[float, float, float, float]) -> float:
    """Return the height of an object's lowest point above the table [m]; 0 or less where it stands on it.

    Args:
        config: What is held; its origin is its centre, and stands half a height above the table at height 0.
        height: Of its origin, base frame [m].
        quat_wxyz: Its orientation, object to base. A cylinder's axis is its x.
    """
    w, x, y, z = quat_wxyz
    up = (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y))
    sizes = config.sizes
    if config.object == "box":
        below = sum(0.5 * size * abs(each) for size, each in zip(sizes, up, strict=True))
    elif config.object == "cylinder":
        below = 0.5 * sizes[1] * abs(up[0]) + sizes[0] * math.sqrt(max(0.0, 1.0 - up[0] ** 2))
    else:
        below = sizes[0]
    return height + config.half_height - below
