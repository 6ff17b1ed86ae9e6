"""A box with sharp or rounded edges, fitted to points and normals."""

import math
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray
from palpate.mapping.primitives.shape import TURNS, LocalGeometry, PrimitiveShape

ALONG = math.cos(math.radians(12.0))
"""A normal within 12 degrees of an axis of the box is taken to be on a face, to begin with."""

LEANING = math.sin(math.radians(12.0))
"""A normal that leans so much towards a face is on it or on the edge that leads to it, and tells where it is; by
chance it would be off by 24 times the error of a usual sensor."""

MIN_ON_FACE = 3
"""Points that two faces must have each for a box to be looked for: three determine a plane."""

SAME_EDGE = 0.02
"""How far from a face, over the largest half length, the measured normal may still claim a point for it: one on a
sharp edge is on both faces, whichever its error has carried it to."""

STARTING_ROUNDINGS = (0.02, 0.25)
"""Roundings to begin with, over the root mean square distance of the points from their middle."""


@dataclass(frozen=True, slots=True, eq=False)
class BoxShape(PrimitiveShape):
    """A box, of which some faces may not have been touched.

    Attributes:
        half_sizes: Half its lengths along the columns of `rotation`, shape (3,) [m]; from the touched to the
            farthest touched point where the opposite face has not been felt, so at least so much.
        rounding: Radius of its edges [m].
        touched: Which faces have been touched: lower x, y, z, then upper, shape (6,).
    """

    MOTIONS: ClassVar[tuple[int, ...]] = TURNS
    SIZES: ClassVar[tuple[str, ...]] = ("half_size_1", "half_size_2", "half_size_3", "rounding")
    MIN_POINTS: ClassVar[int] = 9

    half_sizes: FloatArray
    rounding: float
    touched: npt.NDArray[np.bool_]

    @property
    def sizes(self) -> FloatArray:
        """Half lengths and rounding, shape (4,) [m]."""
        return np.append(self.half_sizes, self.rounding)

    @property
    def at_limit(self) -> bool:
        """Whether the touched faces leave a size open."""
        return not bool(self.touched.reshape(2, 3).any(axis=0).all())

    def local_geometry(self, points: FloatArray, normals: FloatArray) -> LocalGeometry:
        """Return the distance from the core (the box less its rounding), less the rounding.

        Where only one face, or none, is nearest, face and measured normal have to agree (see `SAME_EDGE`).
        """
        count = len(points)
        r, low, high = self.rounding, *self._bounds()
        core_low, core_high = low + r, high - r
        core = np.clip(points, core_low, core_high)
        away = points - core
        reach = np.linalg.norm(away, axis=1)
        beyond = (away != 0.0).astype(np.float64)
        # beyond at most one bound, an error of the point may have carried it across a sharp edge
        depth = np.column_stack([points - low, high - points])  # below each face, lower ones first
        far = depth / (SAME_EDGE * float(self.half_sizes.max()))
        score = np.column_stack([-normals, normals]) - 0.5 * far**2
        face = np.where(self.touched, score, -np.inf).argmax(axis=1)
        flat = beyond.sum(axis=1) < 2.0
        safe = np.where(flat, 1.0, reach)
        normal = away / safe[:, np.newaxis]
        rows = np.arange(count)
        outward = np.where(face < 3, -1.0, 1.0)
        normal[flat] = 0.0
        normal[rows[flat], face[flat] % 3] = outward[flat]
        distance = np.where(flat, -depth[rows, face], reach - r)
        # Only directions in which the point is beyond the core bend the normal.
        bend = (np.eye(3) * beyond[:, np.newaxis, :] - normal[:, :, np.newaxis] * normal[:, np.newaxis, :]) / safe[
            :, np.newaxis, np.newaxis
        ]
        bend[flat] = 0.0
        # a face shifted outwards by 1 moves the core's bound of its axis, for points beyond that bound
        shifted = np.zeros((count, 3, 7))
        for side, (bound, sign) in enumerate(((core_low, 1.0), (core_high, -1.0))):
            for k in range(3):
                outside = ~flat & ((points[:, k] - bound[k]) * sign < 0.0)
                own = flat & (face == 3 * side + k)
                moved = np.where(outside | own, -sign, 0.0)
                shifted[:, k, 3 * side + k] = moved
                # the rounding moves the bound of the core inwards
                shifted[:, k, 6] += np.where(outside, sign, 0.0)
        free = np.append(self.touched, True)
        shifted = shifted[:, :, free]
        by_size = -np.einsum("ni,nis->ns", normal, shifted)
        by_size[~flat, -1] -= 1.0
        return LocalGeometry(distance, normal, bend, by_size, -np.einsum("nij,njs->nis", bend, shifted))

    def resized(self, step: FloatArray, center: FloatArray, rotation: FloatArray) -> Self:
        """Return the box turned about its center, its touched faces and rounding changed."""
        out = np.zeros(6)
        out[self.touched] = step[:-1]
        low, high = -self.half_sizes - out[:3], self.half_sizes + out[3:]
        half = np.maximum(0.5 * (high - low), 0.2 * self.half_sizes)
        center = center + rotation @ (0.5 * (low + high))
        both = self.touched.reshape(2, 3).all(axis=0)
        largest = float(np.min(half[both], initial=10.0 * float(half.max())))
        rounding = float(np.clip(self.rounding + step[-1], 0.1 * self.rounding, max(largest, 1e-12)))
        return type(self)(center, rotation, half, rounding, self.touched)

    def placed(self, origin: FloatArray, scale: float, touched: FloatArray) -> Self:
        """Return the box in the frame of the points, its open ends where they end."""
        center = origin + scale * self.center
        low, high = -scale * self.half_sizes, scale * self.half_sizes
        local = (touched - center) @ self.rotation
        faces = self.touched.reshape(2, 3)
        low = np.where(faces[0], low, np.minimum(local.min(axis=0), high))
        high = np.where(faces[1], high, np.maximum(local.max(axis=0), low))
        center = center + self.rotation @ (0.5 * (low + high))
        return type(self)(center, self.rotation, 0.5 * (high - low), scale * self.rounding, self.touched)

    def sizes_by_free(self) -> FloatArray:
        """Return turns, and shifts and half lengths per touched face; its rounding."""
        table = np.zeros((10, 10))
        table[3:6, 0:3] = np.eye(3)
        for k in range(3):
            table[k, 3 + k], table[k, 6 + k] = -0.5, 0.5
            table[6 + k, 3 + k], table[6 + k, 6 + k] = 0.5, 0.5
        table[9, 9] = 1.0
        return table[:, np.concatenate([np.ones(3, dtype=bool), self.touched, [True]])]

    def _bounds(self) -> tuple[FloatArray, FloatArray]:
        """Where the faces are, in the box's axes; infinitely far those that were not touched."""
        faces = self.touched.reshape(2, 3)
        return np.where(faces[0], -self.half_sizes, -np.inf), np.where(faces[1], self.half_sizes, np.inf)


def box_starts(points: FloatArray, normals: FloatArray) -> list[BoxShape]:
    """Return boxes along the direction that most normals share, and the next one across it.

    Empty where the normals gather on no two such directions: the points then show one face, or no box.
    """
    near = np.abs(normals @ normals.T) > ALONG
    first = _gathered(normals, near.sum(axis=1))
    across = np.abs(normals @ first) < LEANING
    counts = (near & across[:, np.newaxis] & across).sum(axis=1) * across
    if counts.max() < MIN_ON_FACE:
        return []
    second = _gathered(normals, counts)
    second = second - (second @ first) * first
    second /= np.linalg.norm(second)
    rotation = np.column_stack([first, second, np.cross(first, second)])
    local, facing = points @ rotation, normals @ rotation
    towards = np.column_stack([-facing, facing])
    on_face, touched = towards > ALONG, np.asarray((towards > LEANING).any(axis=0))
    ends = np.concatenate([local.min(axis=0), local.max(axis=0)])
    for face in np.flatnonzero(on_face.any(axis=0)):
        ends[face] = np.median(local[on_face[:, face], face % 3])
    low, high = np.minimum(ends[:3], ends[3:]), np.maximum(ends[:3], ends[3:])
    half = np.maximum(0.5 * (high - low), 1e-3)
    center = rotation @ (0.5 * (low + high))
    return [BoxShape(center, rotation, half, min(r, 0.9 * half.min()), touched) for r in STARTING_ROUNDINGS]


def _gathered(normals: FloatArray, counts: npt.NDArray[np.int_]) -> FloatArray:
    """Return the mean of the normals about the one with the most neighbours."""
    seed = normals[int(counts.argmax())]
    cosine = normals @ seed
    mean = (np.sign(cosine)[:, np.newaxis] * normals)[np.abs(cosine) > ALONG].mean(axis=0)
    return np.asarray(mean / np.linalg.norm(mean))
