"""What the fits ask of a shape: signed distance and outward normal near a point, and how both change."""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from enum import Enum
from typing import ClassVar, Self

import numpy as np

from palpate.errors import FloatArray

TURNS = (3, 4, 5)
"""Of the six motions of a shape (three shifts, then three turns), those that turn it."""


class PrimitiveKind(Enum):
    """The shapes that can be fitted."""

    PLANE = "plane"
    SPHERE = "sphere"
    CYLINDER = "cylinder"
    ELLIPSOID = "ellipsoid"
    BOX = "box"
    TORUS = "torus"


@dataclass(frozen=True, slots=True, eq=False)
class LocalGeometry:
    """A shape seen from n points, in the shape's own axes.

    Attributes:
        distance: Signed, positive outside the object, shape (n,) [m].
        normal: Outward unit normal at the nearest point, shape (n, 3).
        bend: How the normal changes with the point (Hessian of the distance), shape (n, 3, 3) [1/m].
        distance_by_size: Change of the distance per unit of each free size, shape (n, s).
        normal_by_size: Change of the normal likewise, shape (n, 3, s).
    """

    distance: FloatArray
    normal: FloatArray
    bend: FloatArray
    distance_by_size: FloatArray
    normal_by_size: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class PrimitiveShape(ABC):
    """A shape and where it is.

    Attributes:
        center: Shape (3,) [m], in the frame of the points.
        rotation: Columns are the shape's axes, shape (3, 3).
    """

    MOTIONS: ClassVar[tuple[int, ...]]
    """Which of (shift x y z, turn x y z), along and about the shape's axes, move the surface."""
    SIZES: ClassVar[tuple[str, ...]]
    """Names of `sizes`."""
    MIN_POINTS: ClassVar[int]
    """Unknowns of the shape: fewer points leave nothing to judge a fit by."""

    center: FloatArray
    rotation: FloatArray

    @property
    @abstractmethod
    def sizes(self) -> FloatArray:
        """Lengths that do not depend on the pose, in the order of `SIZES` [m]."""

    @abstractmethod
    def local_geometry(self, points: FloatArray, normals: FloatArray) -> LocalGeometry:
        """Return what the shape looks like from `points` (n, 3), in its own axes.

        `normals` (n, 3), as measured, only tell apart the faces that meet at a sharp edge.
        """

    @abstractmethod
    def resized(self, step: FloatArray, center: FloatArray, rotation: FloatArray) -> Self:
        """Return the shape elsewhere, its free sizes changed by `step`, kept within its limits."""

    @abstractmethod
    def placed(self, origin: FloatArray, scale: float, touched: FloatArray) -> Self:
        """Return the shape of `origin + scale * x`; `touched` (n, 3) are the points, to center it where felt."""

    @property
    @abstractmethod
    def at_limit(self) -> bool:
        """Whether a size has run to its limit, in the scaled units of the fit: the points do not bound it."""

    @abstractmethod
    def sizes_by_free(self) -> FloatArray:
        """Return the change of (shift 3, turn 3, sizes) per unit of (`MOTIONS`, free sizes)."""

    def distance(self, points: FloatArray) -> FloatArray:
        """Return the signed distance of `points` (n, 3) from the surface, positive outside, shape (n,) [m]."""
        local = (np.asarray(points, dtype=np.float64) - self.center) @ self.rotation
        return self.local_geometry(local, np.zeros_like(local)).distance

    def normal(self, points: FloatArray) -> FloatArray:
        """Return the outward unit normals at the points nearest to `points` (n, 3), shape (n, 3)."""
        local = (np.asarray(points, dtype=np.float64) - self.center) @ self.rotation
        return self.local_geometry(local, np.zeros_like(local)).normal @ self.rotation.T


def axes_along(z: FloatArray) -> FloatArray:
    """Return a rotation (3, 3) whose third column is `z` (3,), of unit length."""
    x = np.cross(z, np.eye(3)[int(np.abs(z).argmin())])
    x /= np.linalg.norm(x)
    return np.asarray(np.column_stack([x, np.cross(z, x), z]), dtype=np.float64)


def turned(rotation: FloatArray, rotvec: FloatArray) -> FloatArray:
    """Return `rotation`, turned by `rotvec` (3,) [rad] about its own axes (Rodrigues)."""
    x, y, z = rotvec.tolist()
    angle = math.sqrt(x * x + y * y + z * z)
    if angle == 0.0:
        return rotation
    x, y, z = x / angle, y / angle, z / angle
    s, c = math.sin(angle), 1.0 - math.cos(angle)
    turn = [
        [1.0 - c * (y * y + z * z), c * x * y - s * z, c * x * z + s * y],
        [c * x * y + s * z, 1.0 - c * (x * x + z * z), c * y * z - s * x],
        [c * x * z - s * y, c * y * z + s * x, 1.0 - c * (x * x + y * y)],
    ]
    return np.asarray(rotation @ np.array(turn))
