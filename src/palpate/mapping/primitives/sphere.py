"""A sphere, or a round hollow, fitted to points and normals."""

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from palpate.errors import FloatArray
from palpate.mapping.primitives.shape import LocalGeometry, PrimitiveKind, PrimitiveShape, tangent

FLATTEST = 200.0
"""Largest radius over the root mean square distance of the points from their middle. They then rise by less than
1/200 of their extent: with noise as of touch, a plane."""


@dataclass(frozen=True, slots=True, eq=False)
class SphereShape(PrimitiveShape):
    """A sphere.

    Attributes:
        radius: [m].
        hollow: Whether the object is around it, as around a bowl.
    """

    KIND: ClassVar[PrimitiveKind] = PrimitiveKind.SPHERE
    MOTIONS: ClassVar[tuple[int, ...]] = (0, 1, 2)
    SIZES: ClassVar[tuple[str, ...]] = ("radius",)
    FEWEST_POINTS: ClassVar[int] = 4

    radius: float
    hollow: bool = False

    @property
    def sizes(self) -> FloatArray:
        """The radius, shape (1,) [m]."""
        return np.array([self.radius])

    @property
    def free_sizes(self) -> int:
        """One."""
        return 1

    @property
    def at_limit(self) -> bool:
        """Whether it is as good as flat."""
        return self.radius >= FLATTEST

    def local_geometry(self, points: FloatArray, normals: FloatArray) -> LocalGeometry:
        """Return distance and normal, along the line from the center."""
        side = -1.0 if self.hollow else 1.0
        reach = np.maximum(np.linalg.norm(points, axis=1), np.finfo(float).tiny)
        normal = side * points / reach[:, np.newaxis]
        return LocalGeometry(
            distance=side * (reach - self.radius),
            normal=normal,
            bend=side * tangent(normal) / reach[:, np.newaxis, np.newaxis],
            distance_by_size=np.full((len(points), 1), -side),
            normal_by_size=np.zeros((len(points), 3, 1)),
        )

    def resized(self, step: FloatArray, center: FloatArray, rotation: FloatArray) -> Self:
        """Return the sphere elsewhere, of another radius."""
        radius = float(np.clip(self.radius + step[0], 0.1 * self.radius, 10.0 * self.radius))
        return type(self)(center, rotation, min(radius, FLATTEST), self.hollow)

    def placed(self, origin: FloatArray, scale: float, touched: FloatArray) -> Self:
        """Return the sphere in the frame of the points."""
        return type(self)(origin + scale * self.center, self.rotation, scale * self.radius, self.hollow)

    def sizes_by_free(self) -> FloatArray:
        """Return which motions are free, and the radius."""
        return np.eye(7)[:, [0, 1, 2, 6]]


def sphere_starts(points: FloatArray, normals: FloatArray) -> list[SphereShape]:
    """Return the sphere of the line n = k p + b through points and normals: k = 1 / R, c = -b / k.

    Noise is in n; regressing p on n instead would shrink the radius of a cap.
    """
    offset, turn = points - points.mean(axis=0), normals - normals.mean(axis=0)
    curvature = float((offset * turn).sum() / (offset**2).sum())
    curvature = np.copysign(max(abs(curvature), 1.0 / FLATTEST), curvature)
    center = points.mean(axis=0) - normals.mean(axis=0) / curvature
    return [SphereShape(center, np.eye(3), 1.0 / abs(curvature), curvature < 0.0)]
