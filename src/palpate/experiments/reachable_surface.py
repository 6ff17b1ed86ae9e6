"""The part of a true surface that a fingertip can feel while its centre stays over the rows."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from palpate.errors import FloatArray
from palpate.experiments.explore_config import ExploreConfig
from palpate.sim import SceneObject

GRID = 81
"""Samples along each side: half a millimetre of 40 mm."""

STEEPEST_COS = 0.5
"""Steeper than 60 degrees a surface is not to be felt from above, as of `SceneObject.reachable`."""

FITS = 0.99
"""Of the tip's smallest half length: nearer to the surface, the tip would touch somewhere else first."""


@dataclass(frozen=True, slots=True, eq=False)
class ReachableSurface:
    """Samples of it.

    Attributes:
        position: Shape (n, 3) [m].
        area: That each stands for, shape (n,) [m^2].
    """

    position: FloatArray
    area: FloatArray

    @classmethod
    def of(cls, target: SceneObject, config: ExploreConfig) -> Self:
        """Return the surface of `target` that the tip of `config` touches with its centre over the raster.

        A tip touches a point of normal n with its centre off by A^2 n / |A n|, A its half lengths along the axes.
        """
        half = np.array(config.tip if len(config.tip) == 3 else config.tip * 3)
        middle, extent = np.array(config.middle), np.array([config.width, config.depth])
        room = 0.5 * extent + half[:2]
        x, y = (np.linspace(m - r, m + r, GRID) for m, r in zip(middle, room, strict=True))
        X, Y = np.meshgrid(x, y)
        Z = np.asarray(target.height(X, Y))
        slope_y, slope_x = np.gradient(Z, y, x)
        known = np.isfinite(Z) & np.isfinite(slope_x) & np.isfinite(slope_y)
        position = np.stack([X, Y, Z], axis=-1)[known]
        normal = np.stack([-slope_x, -slope_y, np.ones_like(Z)], axis=-1)[known]
        length = np.linalg.norm(normal, axis=1)
        normal /= length[:, None]
        center = position + half**2 * normal / np.linalg.norm(half * normal, axis=1, keepdims=True)
        felt = (np.abs(center[:, :2] - middle) <= 0.5 * extent).all(axis=1) & (normal[:, 2] >= STEEPEST_COS)
        felt[felt] = target.signed_distance(center[felt]) >= FITS * half.min()
        step = (x[1] - x[0]) * (y[1] - y[0])
        return cls(position[felt], step * length[felt])
