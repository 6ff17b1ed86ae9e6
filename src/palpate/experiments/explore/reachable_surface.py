"""The part of a true surface that a fingertip can feel while its centre stays where an exploration leads it."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from palpate.errors import FloatArray
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.scan import Scan
from palpate.experiments.explore.tip_surface import PredictedContour
from palpate.sim import SceneObject

_GRID_LINES = 81
"""Samples along each side: half a millimetre of 40 mm."""

_STEEPEST_COS = 0.5
"""Steeper than 60 degrees a surface is not to be felt from above, as of `SceneObject.reachable`."""

_MIN_CLEARANCE = 0.99
"""Smallest distance of the tip's centre over its smallest half length: below it, the tip touches elsewhere
first."""

_NORMAL_STEP = 1e-6
"""Step of the differences that give a normal [m]."""

_SETTLING_STEPS = 5
"""Steps in which the point touched settles: one is enough for a sphere."""


@dataclass(frozen=True, slots=True, eq=False)
class ReachableSurface:
    """Samples of it.

    Attributes:
        position: Shape (n, 3) [m].
        area: Area of each sample, shape (n,) [m^2].
    """

    position: FloatArray
    area: FloatArray

    @classmethod
    def of(cls, target: SceneObject, config: ExploreConfig, scan: Scan) -> Self:
        """Return the surface of `target` that the tip of `config` touches with its centre where `scan` goes."""
        half = np.array(config.tip if len(config.tip) == 3 else config.tip * 3)
        if scan.contour is not None:
            return cls._along(target, half, scan.contour, config.gap)
        return cls._within(target, half, scan)

    @classmethod
    def unknown(cls) -> Self:
        """Return no samples, for an unknown surface."""
        return cls(np.zeros((0, 3)), np.zeros(0))

    @classmethod
    def _within(cls, target: SceneObject, half: FloatArray, scan: Scan) -> Self:
        """Return the samples that the tip touches with its centre over an area.

        A tip touches a point of normal n with its centre off by A^2 n / |A n|, A its half lengths along the axes.
        """
        low, high = (np.array(corner) for corner in scan.box)
        x, y = (np.linspace(a - r, b + r, _GRID_LINES) for a, b, r in zip(low, high, half[:2], strict=True))
        X, Y = np.meshgrid(x, y)
        Z = np.asarray(target.height(X, Y))
        slope_y, slope_x = np.gradient(Z, y, x)
        known = np.isfinite(Z) & np.isfinite(slope_x) & np.isfinite(slope_y)
        position = np.stack([X, Y, Z], axis=-1)[known]
        normal = np.stack([-slope_x, -slope_y, np.ones_like(Z)], axis=-1)[known]
        length = np.linalg.norm(normal, axis=1)
        normal /= length[:, None]
        center = position + _off(half, normal)
        felt = scan.passes(center[:, :2]) & (normal[:, 2] >= _STEEPEST_COS)
        felt[felt] = target.signed_distance(center[felt]) >= _MIN_CLEARANCE * half.min()
        step = (x[1] - x[0]) * (y[1] - y[0])
        return cls(position[felt], step * length[felt])

    @classmethod
    def _along(cls, target: SceneObject, half: FloatArray, curve: PredictedContour, width: float) -> Self:
        """Return the samples that the tip touches with its centre on a curve, as a ribbon of a width [m]."""
        center = np.column_stack([curve.points, curve.heights])
        touched = center
        for _ in range(_SETTLING_STEPS):
            # asked between the two, for on an edge the normal is any
            touched = center - _off(half, _normal(target, 0.5 * (touched + center)))
        steps = np.linalg.norm(np.diff(touched, axis=0, append=touched[:1]), axis=1)
        return cls(touched, width * steps)


def _off(half: FloatArray, normal: FloatArray) -> FloatArray:
    """From where normals (n, 3) are touched to the centre of the tip, shape (n, 3) [m]."""
    return np.asarray(half**2 * normal / np.linalg.norm(half * normal, axis=1, keepdims=True))


def _normal(target: SceneObject, points: FloatArray) -> FloatArray:
    """Unit gradient of the distance to the surface at points (n, 3)."""
    steps = _NORMAL_STEP * np.eye(3)
    slope = np.stack(
        [target.signed_distance(points + d) - target.signed_distance(points - d) for d in steps], axis=1
    )
    return np.asarray(slope / np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), 1e-12))
