"""What a sphere and a cylinder share: one radius, about a point or a line."""

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from palpate.errors import FloatArray
from palpate.mapping.primitives.kernel import NEAREST
from palpate.mapping.primitives.shape import LocalGeometry, PrimitiveShape

FLATTEST = 200.0
"""Largest radius over the root mean square distance of the points from their middle. They then rise by less than
1/200 of their extent: with noise as of touch, a plane."""


@dataclass(frozen=True, slots=True, eq=False)
class RoundShape(PrimitiveShape):
    """A sphere or cylinder.

    Attributes:
        radius: [m].
        hollow: Whether the object is around it, as around a bowl or a bore.
    """

    SIZES: ClassVar[tuple[str, ...]] = ("radius",)
    ACROSS: ClassVar[tuple[float, float, float]]
    """1 for the shape's axes along which it is bent, 0 along a cylinder."""

    radius: float
    hollow: bool = False

    @property
    def sizes(self) -> FloatArray:
        """The radius, shape (1,) [m]."""
        return np.array([self.radius])

    @property
    def at_limit(self) -> bool:
        """Whether it is as good as flat."""
        return self.radius >= FLATTEST

    def local_geometry(self, points: FloatArray, normals: FloatArray) -> LocalGeometry:
        """Return distance and normal, along the line from the center or across the axis."""
        side = -1.0 if self.hollow else 1.0
        across = points * self.ACROSS
        reach = np.maximum(np.linalg.norm(across, axis=1), NEAREST)
        normal = side * across / reach[:, np.newaxis]
        bent = np.diag(self.ACROSS) - normal[:, :, np.newaxis] * normal[:, np.newaxis, :]
        return LocalGeometry(
            distance=side * (reach - self.radius),
            normal=normal,
            bend=side * bent / reach[:, np.newaxis, np.newaxis],
            distance_by_size=np.full((len(points), 1), -side),
            normal_by_size=np.zeros((len(points), 3, 1)),
        )

    def resized(self, step: FloatArray, center: FloatArray, rotation: FloatArray) -> Self:
        """Return the shape elsewhere, of another radius."""
        radius = min(max(self.radius + float(step[0]), 0.1 * self.radius), 10.0 * self.radius)
        return type(self)(center, rotation, min(radius, FLATTEST), self.hollow)

    def sizes_by_free(self) -> FloatArray:
        """Return which motions are free, and the radius."""
        return np.eye(7)[:, [*self.MOTIONS, 6]]
