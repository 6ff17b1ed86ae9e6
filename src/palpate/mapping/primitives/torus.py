"""A torus, or a groove round an axis, fitted to points and normals."""

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from palpate.errors import FloatArray
from palpate.mapping.primitives.kernel import NEAREST, around_torus
from palpate.mapping.primitives.round import FLATTEST
from palpate.mapping.primitives.shape import LocalGeometry, PrimitiveShape, axes_along

NARROWEST = 0.02
"""Least radius of the ring over the root mean square distance of the points from their middle: a sphere nearly."""


@dataclass(frozen=True, slots=True, eq=False)
class TorusShape(PrimitiveShape):
    """A torus about the third axis of `rotation`.

    Attributes:
        ring_radius: From the axis to the middle of the tube [m].
        tube_radius: [m].
        hollow: Whether the object is around the tube, as around the groove of a ball bearing.
    """

    MOTIONS: ClassVar[tuple[int, ...]] = (0, 1, 2, 3, 4)
    SIZES: ClassVar[tuple[str, ...]] = ("ring_radius", "tube_radius")
    MIN_POINTS: ClassVar[int] = 7

    ring_radius: float
    tube_radius: float
    hollow: bool = False

    @property
    def sizes(self) -> FloatArray:
        """Radii of ring and tube, shape (2,) [m]."""
        return np.array([self.ring_radius, self.tube_radius])

    @property
    def at_limit(self) -> bool:
        """Whether it is as good as a cylinder, a sphere or a plane."""
        return self.ring_radius <= NARROWEST or max(self.ring_radius, self.tube_radius) >= FLATTEST

    def local_geometry(self, points: FloatArray, normals: FloatArray) -> LocalGeometry:
        """Return distance and normal, along the line from the nearest point of the ring."""
        side = -1.0 if self.hollow else 1.0
        return LocalGeometry(*around_torus(points, self.ring_radius, self.tube_radius, side))

    def resized(self, step: FloatArray, center: FloatArray, rotation: FloatArray) -> Self:
        """Return the torus elsewhere, of other radii."""
        ring = min(max(self.ring_radius + float(step[0]), max(0.1 * self.ring_radius, NARROWEST)), FLATTEST)
        tube = min(max(self.tube_radius + float(step[1]), 0.1 * self.tube_radius), 10.0 * self.tube_radius)
        return type(self)(center, rotation, ring, min(tube, FLATTEST), self.hollow)

    def placed(self, origin: FloatArray, scale: float, touched: FloatArray) -> Self:
        """Return the torus in the frame of the points."""
        radii = (scale * self.ring_radius, scale * self.tube_radius)
        return type(self)(origin + scale * self.center, self.rotation, *radii, self.hollow)

    def sizes_by_free(self) -> FloatArray:
        """Return which motions are free, and both radii."""
        return np.eye(8)[:, [*self.MOTIONS, 6, 7]]


def torus_starts(points: FloatArray, normals: FloatArray) -> list[TorusShape]:
    """Return tori about the lines that the normals' lines come nearest to, and about the main axes of the points.

    All normals of a surface of revolution meet its axis: with direction a and moment m of the axis,
    a.(p x n) + m.n = 0 (Pottmann and Wallner, "Computational line geometry", 2001).
    """
    moments = np.cross(points, normals)
    facing = np.linalg.inv(normals.T @ normals + 1e-6 * len(points) * np.eye(3))
    left = moments.T @ moments - moments.T @ normals @ facing @ normals.T @ moments
    axes = [*np.linalg.eigh(left)[1].T[:2], *np.linalg.eigh(points.T @ points)[1].T]
    return [_about(axis, points, normals, moments) for axis in axes]


def _about(axis: FloatArray, points: FloatArray, normals: FloatArray, moments: FloatArray) -> TorusShape:
    """Return the torus about a direction: its axis nearest to the normals' lines, its tube a circle's section."""
    rotation = axes_along(axis)
    across = np.cross(axis, normals) @ rotation[:, :2]
    ridge = 1e-6 * len(points) * np.eye(2)
    middle = rotation[:, :2] @ np.linalg.solve(across.T @ across + ridge, -across.T @ (moments @ axis))
    local, facing = (points - middle) @ rotation, normals @ rotation
    out = np.maximum(np.hypot(local[:, 0], local[:, 1]), NEAREST)
    section = np.column_stack([out, local[:, 2]])
    turn = np.column_stack([(local[:, :2] * facing[:, :2]).sum(axis=1) / out, facing[:, 2]])
    offset = section - section.mean(axis=0)
    curvature = float((offset * (turn - turn.mean(axis=0))).sum() / max((offset**2).sum(), NEAREST))
    curvature = float(np.copysign(max(abs(curvature), 1.0 / FLATTEST), curvature))
    ring, height = (section.mean(axis=0) - turn.mean(axis=0) / curvature).tolist()
    return TorusShape(
        middle + height * axis,
        rotation,
        float(np.clip(ring, 2.0 * NARROWEST, FLATTEST / 2.0)),
        1.0 / abs(curvature),
        curvature < 0.0,
    )
