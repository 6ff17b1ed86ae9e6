"""An ellipsoid, fitted to points and normals by exact distance."""

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from palpate.errors import FloatArray
from palpate.mapping.primitives.kernel import around_ellipsoid
from palpate.mapping.primitives.shape import LocalGeometry, PrimitiveShape
from palpate.mapping.primitives.sphere import sphere_starts

SMALLEST, LARGEST = 0.02, 50.0
"""Limits of the semi-axes over the root mean square distance of the points from their middle. A cap says little
about the axis that points into it, and noise can carry it off to infinity, or to nothing."""


@dataclass(frozen=True, slots=True, eq=False)
class EllipsoidShape(PrimitiveShape):
    """An ellipsoid.

    Attributes:
        semi_axes: Along the columns of `rotation`, shape (3,) [m]; from a fit the largest first.
        hollow: Whether the object is around it.
    """

    MOTIONS: ClassVar[tuple[int, ...]] = (0, 1, 2, 3, 4, 5)
    SIZES: ClassVar[tuple[str, ...]] = ("semi_axis_1", "semi_axis_2", "semi_axis_3")
    MIN_POINTS: ClassVar[int] = 9

    semi_axes: FloatArray
    hollow: bool = False

    @property
    def sizes(self) -> FloatArray:
        """The semi-axes, shape (3,) [m]."""
        return self.semi_axes

    @property
    def at_limit(self) -> bool:
        """Whether a semi-axis is as large, or as small, as is allowed."""
        # a hair within: the limits are set through a logarithm
        return bool(self.semi_axes.max() > 0.999 * LARGEST or self.semi_axes.min() < 1.001 * SMALLEST)

    def local_geometry(self, points: FloatArray, normals: FloatArray) -> LocalGeometry:
        """Return distance and normal from the nearest point x of each point u.

        With the multiplier t, x_i = a_i^2 u_i / (a_i^2 + t), and t solves G = sum (a_i u_i / (a_i^2 + t))^2 = 1
        (Eberly, "Distance from a point to an ellipse, an ellipsoid, or a hyperellipsoid"). The gradient
        g_i = u_i / (a_i^2 + t) gives the normal; all changes follow from implicit differentiation of G = 1.
        """
        return LocalGeometry(*around_ellipsoid(points, self.semi_axes, -1.0 if self.hollow else 1.0))

    def resized(self, step: FloatArray, center: FloatArray, rotation: FloatArray) -> Self:
        """Return the ellipsoid elsewhere, the logarithms of its semi-axes changed."""
        axes = self.semi_axes * np.exp(np.minimum(np.maximum(step, -1.0), 1.0))
        return type(self)(center, rotation, np.minimum(np.maximum(axes, SMALLEST), LARGEST), self.hollow)

    def placed(self, origin: FloatArray, scale: float, touched: FloatArray) -> Self:
        """Return the ellipsoid in the frame of the points."""
        center, axes = origin + scale * self.center, scale * self.semi_axes
        return type(self)(center, self.rotation, axes, self.hollow)

    def sorted_axes(self) -> Self:
        """Return the same ellipsoid, its largest semi-axis first."""
        order = np.argsort(-self.semi_axes)
        rotation = self.rotation[:, order]
        if np.linalg.det(rotation) < 0.0:
            rotation[:, 2] *= -1.0
        return type(self)(self.center, rotation, self.semi_axes[order], self.hollow)

    def sizes_by_free(self) -> FloatArray:
        """Return all motions, and semi-axes per logarithm."""
        return np.diag(np.concatenate([np.ones(6), self.semi_axes]))


def ellipsoid_starts(points: FloatArray, normals: FloatArray) -> list[EllipsoidShape]:
    """Return the ellipsoid nearest to the algebraic quadric, and a ball.

    The quadric F = p'Q p + 2 b'p + k has F = 0 and gradients along the normals (n x grad F = 0) in the sense of
    least squares, with the mean of |grad F|^2 fixed (Taubin, "Estimation of planar curves, surfaces, and
    nonplanar space curves", 1991).
    """
    x, y, z = points.T
    one, zero = np.ones(len(points)), np.zeros(len(points))
    value = np.column_stack([x * x, y * y, z * z, x * y, x * z, y * z, x, y, z, one])
    gradient = np.stack(
        [
            np.column_stack([2 * x, zero, zero, y, z, zero, one, zero, zero, zero]),
            np.column_stack([zero, 2 * y, zero, x, zero, z, zero, one, zero, zero]),
            np.column_stack([zero, zero, 2 * z, zero, x, y, zero, zero, one, zero]),
        ],
        axis=1,
    )
    crossed = np.cross(normals[:, :, np.newaxis], gradient, axis=1).reshape(-1, 10)
    size = (gradient.reshape(-1, 10).T @ gradient.reshape(-1, 10)) / len(points)
    misfit = (value.T @ value + 0.1 * crossed.T @ crossed) / len(points)
    # the largest ratio of size to misfit, as the misfit is positive definite and size is not
    misfit += 1e-14 * np.trace(misfit) * np.eye(10)
    root = np.linalg.inv(np.linalg.cholesky(misfit))
    best = root.T @ np.linalg.eigh(root @ size @ root.T)[1][:, -1]
    ball = sphere_starts(points, normals)[0]
    radius = float(np.clip(ball.radius, SMALLEST, LARGEST / 5.0))
    middle, facing = points.mean(axis=0), normals.mean(axis=0)
    center = ball.center if np.linalg.norm(ball.center) < LARGEST else middle - radius * facing
    axes = np.linalg.eigh(np.cov(points.T))[1]
    if np.linalg.det(axes) < 0.0:
        axes[:, 0] *= -1.0
    starts = [EllipsoidShape(center, axes, radius * np.array([1.05, 1.0, 0.95]), ball.hollow)]
    quadric = _from_quadric(best, points, normals)
    return starts if quadric is None else [quadric, *starts]


def _from_quadric(f: FloatArray, points: FloatArray, normals: FloatArray) -> EllipsoidShape | None:
    """Return the quadric as an ellipsoid; semi-axes that are not real, or too long, get the largest length."""
    Q = np.array([[2 * f[0], f[3], f[4]], [f[3], 2 * f[1], f[5]], [f[4], f[5], 2 * f[2]]]) / 2.0
    b, k = f[6:9] / 2.0, f[9]
    if np.trace(Q) < 0.0:
        Q, b, k = -Q, -b, -k
    values, axes = np.linalg.eigh(Q)
    if values[2] <= 0.0:
        return None
    values = np.maximum(values, 1e-3 * values[2])
    along = axes.T @ b
    center = -axes @ (along / values)
    level = float((along**2 / values).sum() - k)
    if level <= 0.0:
        return None
    semi = np.clip(np.sqrt(level / values), SMALLEST, 0.5 * LARGEST)
    if np.linalg.det(axes) < 0.0:
        axes[:, 0] *= -1.0
    inward = ((points - center) * normals).sum() < 0.0
    return EllipsoidShape(center, axes, semi, bool(inward))
