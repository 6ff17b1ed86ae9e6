"""Where the tip frame goes in a planned exploration, as far as the object is as described."""

import math
from itertools import pairwise

import numpy as np

from palpate.controllers.paths import PathPlane
from palpate.experiments.explore.scans import Scan
from palpate.sim import SceneObject
from palpate.spatial import Vector

GRID = 2e-3
"""Between places whose height is looked up [m]."""

MOST_PLACES = 5000
"""Of those; a height field of a scan takes some microseconds for each."""


def tip_path(scan: Scan, target: SceneObject, plane: PathPlane, tip_height: float) -> list[Vector]:
    """Return points of it, base frame [m].

    Args:
        scan: Of the middle of the tip.
        target: What is explored; where it has no height the tip comes down beside it.
        plane: In whose coordinates the scan is.
        tip_height: From the middle of the tip to its lowest point [m].
    """
    corners = scan.corners
    grid = max(GRID, sum(math.dist(*ends) for ends in pairwise(corners)) / MOST_PLACES)
    places = np.array(corners[:1])
    for a, b in pairwise(corners):
        count = max(1, math.ceil(math.dist(a, b) / grid))
        places = np.vstack([places, np.linspace(a, b, count + 1)[1:]])
    heights = target.height(*places.T)
    lowest = np.where(np.isnan(heights), target.bottom, heights) + tip_height
    return [plane.base((x, y), z) for (x, y), z in zip(places.tolist(), lowest.tolist(), strict=True)]
