"""A circular cylinder, or a bore, fitted to points and normals."""

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from palpate.errors import FloatArray
from palpate.mapping.primitives.round import FLATTEST, RoundShape
from palpate.mapping.primitives.shape import axes_along


@dataclass(frozen=True, slots=True, eq=False)
class CylinderShape(RoundShape):
    """An endless cylinder about the third axis of `rotation`."""

    MOTIONS: ClassVar[tuple[int, ...]] = (0, 1, 3, 4)
    MIN_POINTS: ClassVar[int] = 5
    ACROSS: ClassVar[tuple[float, float, float]] = (1.0, 1.0, 0.0)

    @property
    def axis(self) -> FloatArray:
        """Direction of the axis, shape (3,)."""
        return self.rotation[:, 2]

    def placed(self, origin: FloatArray, scale: float, touched: FloatArray) -> Self:
        """Return the cylinder in the frame of the points, its center beside their middle."""
        center = origin + scale * self.center
        center = center + ((touched.mean(axis=0) - center) @ self.axis) * self.axis
        return type(self)(center, self.rotation, scale * self.radius, self.hollow)


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
