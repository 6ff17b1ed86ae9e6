"""A plane, fitted to points and normals."""

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from palpate.errors import FloatArray
from palpate.mapping.primitives.shape import LocalGeometry, PrimitiveShape, axes_along


@dataclass(frozen=True, slots=True, eq=False)
class PlaneShape(PrimitiveShape):
    """The plane through `center` across the third axis of `rotation`, which points out of the object."""

    MOTIONS: ClassVar[tuple[int, ...]] = (2, 3, 4)
    SIZES: ClassVar[tuple[str, ...]] = ()
    MIN_POINTS: ClassVar[int] = 3

    @property
    def sizes(self) -> FloatArray:
        """Nothing: a plane has no size."""
        return np.zeros(0)

    @property
    def at_limit(self) -> bool:
        """Never."""
        return False

    def local_geometry(self, points: FloatArray, normals: FloatArray) -> LocalGeometry:
        """Return the height above the plane and its one normal."""
        count = len(points)
        return LocalGeometry(
            distance=points[:, 2].copy(),
            normal=np.tile([0.0, 0.0, 1.0], (count, 1)),
            bend=np.zeros((count, 3, 3)),
            distance_by_size=np.zeros((count, 0)),
            normal_by_size=np.zeros((count, 3, 0)),
        )

    def resized(self, step: FloatArray, center: FloatArray, rotation: FloatArray) -> Self:
        """Return the plane elsewhere."""
        return type(self)(center, rotation)

    def placed(self, origin: FloatArray, scale: float, touched: FloatArray) -> Self:
        """Return the plane in the frame of the points, its center amid them."""
        center = origin + scale * self.center
        z = self.rotation[:, 2]
        middle = touched.mean(axis=0)
        return type(self)(middle + ((center - middle) @ z) * z, self.rotation)

    def sizes_by_free(self) -> FloatArray:
        """Return which motions are free."""
        return np.eye(6)[:, list(self.MOTIONS)]


def plane_starts(points: FloatArray, normals: FloatArray) -> list[PlaneShape]:
    """Return the plane across the direction in which points and normals vary least, facing as the normals do."""
    centred = points - points.mean(axis=0)
    # normals as long as the points spread: the plane is across what both agree on
    spread = np.sqrt((centred**2).sum(axis=1).mean())
    mean = normals.mean(axis=0)
    moments = centred.T @ centred / len(points) - spread**2 * np.outer(mean, mean)
    z = np.linalg.eigh(moments)[1][:, 0]
    z = -z if z @ mean < 0.0 else z
    return [PlaneShape(points.mean(axis=0), axes_along(z))]
