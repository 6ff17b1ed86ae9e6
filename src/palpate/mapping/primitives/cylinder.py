"""A circular cylinder, or a bore, fitted to points and normals."""

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from palpate.errors import FloatArray
from palpate.mapping.primitives.shape import (
    LocalGeometry,
    PrimitiveKind,
    PrimitiveShape,
    axes_along,
    tangent,
)
from palpate.mapping.primitives.sphere import FLATTEST


@dataclass(frozen=True, slots=True, eq=False)
class CylinderShape(PrimitiveShape):
    """An endless cylinder about the third axis of `rotation`.

    Attributes:
        radius: [m].
        hollow: Whether the object is around it, as around a bore.
    """

    KIND: ClassVar[PrimitiveKind] = PrimitiveKind.CYLINDER
    MOTIONS: ClassVar[tuple[int, ...]] = (0, 1, 3, 4)
    SIZES: ClassVar[tuple[str, ...]] = ("radius",)
    FEWEST_POINTS: ClassVar[int] = 5

    radius: float
    hollow: bool = False

    @property
    def axis(self) -> FloatArray:
        """Direction of the axis, shape (3,)."""
        return self.rotation[:, 2]

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
        """Return distance and normal, across the axis."""
        side = -1.0 if self.hollow else 1.0
        across = points * [1.0, 1.0, 0.0]
        reach = np.maximum(np.linalg.norm(across, axis=1), np.finfo(float).tiny)
        normal = side * across / reach[:, np.newaxis]
        bend = tangent(normal)
        bend[:, 2, 2] = 0.0
        return LocalGeometry(
            distance=side * (reach - self.radius),
            normal=normal,
            bend=side * bend / reach[:, np.newaxis, np.newaxis],
            distance_by_size=np.full((len(points), 1), -side),
            normal_by_size=np.zeros((len(points), 3, 1)),
        )

    def resized(self, step: FloatArray, center: FloatArray, rotation: FloatArray) -> Self:
        """Return the cylinder elsewhere, of another radius."""
        radius = float(np.clip(self.radius + step[0], 0.1 * self.radius, 10.0 * self.radius))
        return type(self)(center, rotation, min(radius, FLATTEST), self.hollow)

    def placed(self, origin: FloatArray, scale: float, touched: FloatArray) -> Self:
        """Return the cylinder in the frame of the points, its center beside their middle."""
        center = origin + scale * self.center
        center = center + ((touched.mean(axis=0) - center) @ self.axis) * self.axis
        return type(self)(center, self.rotation, scale * self.radius, self.hollow)

    def sizes_by_free(self) -> FloatArray:
        """Return which motions are free, and the radius."""
        return np.eye(7)[:, [0, 1, 3, 4, 6]]


def cylinder_starts(points: FloatArray, normals: FloatArray) -> list[CylinderShape]:
    """Return cylinders about the two directions that the normals avoid most, and about the straightest one.

    The circle across an axis is that of `sphere_starts`, in two dimensions.
    """
    offset, turn = points - points.mean(axis=0), normals - normals.mean(axis=0)
    avoided = np.linalg.eigh(normals.T @ normals)[1]
    # n = S p + b: the direction along which the normal changes least (a ridge keeps untouched directions at 0)
    ridge = 1e-6 * float((offset**2).sum()) * np.eye(3)
    S = np.linalg.solve(offset.T @ offset + ridge, offset.T @ turn)
    straight = np.linalg.svd(S.T)[2][2]
    return [_about(axis, points, offset, turn, normals) for axis in (avoided[:, 0], avoided[:, 1], straight)]


def _about(
    axis: FloatArray, points: FloatArray, offset: FloatArray, turn: FloatArray, normals: FloatArray
) -> CylinderShape:
    across = np.eye(3) - np.outer(axis, axis)
    spread = max(float(((offset @ across) ** 2).sum()), np.finfo(float).tiny)
    curvature = float(((offset @ across) * turn).sum()) / spread
    curvature = float(np.copysign(max(abs(curvature), 1.0 / FLATTEST), curvature))
    center = points.mean(axis=0) - across @ normals.mean(axis=0) / curvature
    return CylinderShape(center, axes_along(axis), 1.0 / abs(curvature), curvature < 0.0)
