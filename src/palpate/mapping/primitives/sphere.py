"""A sphere, or a round hollow, fitted to points and normals."""

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from palpate.errors import FloatArray
from palpate.mapping.primitives.round import FLATTEST, RoundShape


@dataclass(frozen=True, slots=True, eq=False)
class SphereShape(RoundShape):
    """A sphere."""

    MOTIONS: ClassVar[tuple[int, ...]] = (0, 1, 2)
    MIN_POINTS: ClassVar[int] = 4
    ACROSS: ClassVar[tuple[float, float, float]] = (1.0, 1.0, 1.0)

    def placed(self, origin: FloatArray, scale: float, touched: FloatArray) -> Self:
        """Return the sphere in the frame of the points."""
        return type(self)(origin + scale * self.center, self.rotation, scale * self.radius, self.hollow)


def sphere_starts(points: FloatArray, normals: FloatArray) -> list[SphereShape]:
    """Return the sphere of the line n = k p + b through points and normals: k = 1 / R, c = -b / k.

    Noise is in n; regressing p on n instead would shrink the radius of a cap.
    """
    offset, turn = points - points.mean(axis=0), normals - normals.mean(axis=0)
    curvature = float((offset * turn).sum() / (offset**2).sum())
    curvature = np.copysign(max(abs(curvature), 1.0 / FLATTEST), curvature)
    center = points.mean(axis=0) - normals.mean(axis=0) / curvature
    return [SphereShape(center, np.eye(3), 1.0 / abs(curvature), curvature < 0.0)]
