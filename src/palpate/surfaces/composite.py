"""Fingertips made of patches: unions of quadrics, each with the part of space in which it is the surface."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import product

import numpy as np

from palpate.errors import FloatArray, InvalidValueError, numbers, positive, rotation_matrix, vector
from palpate.surfaces.quadric import CenteredQuadric
from palpate.surfaces.shapes import Cylinder, Plane, Sphere

SEAM_TOLERANCE = 1e-9
"""How far beyond its domain a patch still counts, relative to the size of the tip. A strict test would reject up
to two thirds of the contacts exactly on a seam; this is far below any sensor and far above rounding."""


@dataclass(frozen=True, slots=True, eq=False)
class Patch:
    """A quadric and the part of space in which it is the tip's surface.

    Attributes:
        surface: The quadric, in the sensor frame.
        half_spaces: Rows (a, b): the patch lies where a.x <= b for all of them, a of unit length, sensor frame,
            shape (k, 4) [-, m]. No rows: everywhere.
    """

    surface: CenteredQuadric
    half_spaces: FloatArray = field(default_factory=lambda: np.empty((0, 4)))

    def __post_init__(self) -> None:
        if not isinstance(self.surface, CenteredQuadric):
            raise InvalidValueError(
                f"patch surface is a {type(self.surface).__name__}: must be a Sphere, Ellipsoid, Cylinder or Plane"
            )
        rows = numbers("half_spaces", self.half_spaces)
        if rows.ndim != 2 or rows.shape[1] != 4 or not np.isfinite(rows).all():
            raise InvalidValueError(f"half_spaces has shape {rows.shape}: must be (k, 4), rows (a, b), all finite")
        length = np.linalg.norm(rows[:, :3], axis=1)
        if rows.size and np.abs(length - 1.0).max() > 1e-9:
            raise InvalidValueError(f"half_spaces: normals have lengths {length.tolist()}: must be 1")
        rows.setflags(write=False)
        object.__setattr__(self, "half_spaces", rows)


@dataclass(frozen=True, eq=False, repr=False)
class Composite:
    """A convex tip made of patches that join smoothly.

    Where several patches explain a wrench, the one whose contact is least outside its domain counts; if even that
    is outside by more than `SEAM_TOLERANCE`, the wrench touches none of them.

    Attributes:
        patches: At least one.
        packed: Coefficients of every patch, shape (p, Packed.SIZE).
        domains: Half spaces of every patch, filled up with empty rows, shape (p, k, 4).
        centers: Of every patch, and last their mean, shape (p + 1, 3) [m].
        tolerance: Absolute seam tolerance [m].
    """

    patches: Sequence[Patch]
    packed: FloatArray = field(init=False)
    domains: FloatArray = field(init=False)
    centers: FloatArray = field(init=False)
    tolerance: float = field(init=False)
    _text: str = field(init=False)

    def __post_init__(self) -> None:
        try:
            patches = tuple(self.patches)
        except TypeError:
            patches = ()
        if not patches or not all(isinstance(patch, Patch) for patch in patches):
            raise InvalidValueError(f"patches = {self.patches!r}: must be one Patch or more")
        most = max(len(patch.half_spaces) for patch in patches)
        domains = np.zeros((len(patches), most, 4))  # a row of zeros, 0.x <= 0, holds everywhere
        for i, patch in enumerate(patches):
            domains[i, : len(patch.half_spaces)] = patch.half_spaces
        sizes = [min(patch.surface.half_lengths) for patch in patches]
        packed = np.stack([patch.surface.packed for patch in patches])
        own = [patch.surface.center for patch in patches]
        centers = np.array([*own, np.mean(own, axis=0)])
        for array in (domains, packed, centers):
            array.setflags(write=False)
        object.__setattr__(self, "patches", patches)
        object.__setattr__(self, "packed", packed)
        object.__setattr__(self, "domains", domains)
        object.__setattr__(self, "centers", centers)
        object.__setattr__(self, "tolerance", SEAM_TOLERANCE * max(sizes))

    def __repr__(self) -> str:
        """Name it and count its patches."""
        return f"{type(self).__name__} of {len(self.patches)} patches"


class Capsule(Composite):
    """A thimble: a hemisphere on top of a cylinder that reaches down to z = -length in its own frame.

    Args:
        radius: Of both [m].
        length: Of the cylinder [m].
        center: Of the hemisphere, sensor frame, shape (3,) [m].
        rotation: Columns are the tip's axes in sensor coordinates; the third points out of the fingertip.
    """

    radius: float
    length: float
    center: FloatArray
    rotation: FloatArray

    def __init__(
        self,
        radius: float,
        length: float,
        center: Sequence[float] | FloatArray = (0.0, 0.0, 0.0),
        rotation: Sequence[Sequence[float]] | FloatArray = ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    ) -> None:
        frame = _Frame.of(center, rotation)
        length = positive("length", length, "m")
        frame.keep(self, radius=radius, length=length)
        sphere = Sphere(radius, center=frame.center, rotation=frame.rotation)
        cylinder = Cylinder(radius, center=frame.center, rotation=frame.rotation)
        object.__setattr__(self, "_text", f"Capsule(radius={radius!r}, length={length!r}{frame.text})")
        up, down = (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)
        super().__init__(
            (
                Patch(sphere, frame.half_spaces([(down, 0.0)])),
                Patch(cylinder, frame.half_spaces([(up, 0.0), (down, length)])),
            )
        )

    def __repr__(self) -> str:
        """Show what was given."""
        return self._text


class RoundedBox(Composite):
    """A box with rounded edges and corners: 3 pairs of faces, 12 edges, 8 corners.

    Args:
        half_lengths: Half of its length, width and height, rounding included [m].
        radius: Of edges and corners [m], less than every half length.
        center: Sensor frame, shape (3,) [m].
        rotation: Columns are the box's axes in sensor coordinates.
    """

    half_lengths: FloatArray
    radius: float
    center: FloatArray
    rotation: FloatArray

    def __init__(
        self,
        half_lengths: Sequence[float],
        radius: float,
        center: Sequence[float] | FloatArray = (0.0, 0.0, 0.0),
        rotation: Sequence[Sequence[float]] | FloatArray = ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    ) -> None:
        frame = _Frame.of(center, rotation)
        half = vector("half_lengths", half_lengths, 3, "m")
        positive("radius", radius, "m")
        if not (half > radius).all():
            raise InvalidValueError(
                f"radius = {radius:g} m: must be less than every half length, {half.tolist()} m; "
                "for equal ones take a Capsule or a Sphere"
            )
        frame.keep(self, half_lengths=half, radius=radius)
        text = f"RoundedBox(half_lengths={half.tolist()}, radius={radius!r}{frame.text})"
        object.__setattr__(self, "_text", text)
        inner = half - radius
        unit = np.eye(3)
        patches = []
        for axis in range(3):  # faces: a pair of planes, over the inner rectangle
            turn = np.roll(unit, 2 - axis, axis=1)  # a rotation whose third column is this axis
            others = [i for i in range(3) if i != axis]
            bounds = [(sign * unit[i], inner[i]) for i in others for sign in (1.0, -1.0)]
            patches.append(
                Patch(
                    Plane(half[axis], center=frame.center, rotation=frame.rotation @ turn),
                    frame.half_spaces(bounds),
                )
            )
        for axis in range(3):  # edges along this axis
            turn = np.roll(unit, 2 - axis, axis=1)
            others = [i for i in range(3) if i != axis]
            for signs in product((1.0, -1.0), repeat=2):
                offset = np.zeros(3)
                offset[others] = np.multiply(signs, inner[others])
                bounds = [(unit[axis], inner[axis]), (-unit[axis], inner[axis])]
                bounds += [(-sign * unit[i], -inner[i]) for sign, i in zip(signs, others, strict=True)]
                patches.append(
                    Patch(
                        Cylinder(radius, center=frame.point(offset), rotation=frame.rotation @ turn),
                        frame.half_spaces(bounds),
                    )
                )
        for signs in product((1.0, -1.0), repeat=3):
            bounds = [(-sign * unit[i], -inner[i]) for i, sign in enumerate(signs)]
            corner = frame.point(np.multiply(signs, inner))
            patches.append(Patch(Sphere(radius, center=corner), frame.half_spaces(bounds)))
        super().__init__(patches)

    def __repr__(self) -> str:
        """Show what was given."""
        return self._text


@dataclass(frozen=True, slots=True, eq=False)
class _Frame:
    """The frame of a composite tip in the sensor frame."""

    center: FloatArray
    rotation: FloatArray

    @classmethod
    def of(
        cls, center: Sequence[float] | FloatArray, rotation: Sequence[Sequence[float]] | FloatArray
    ) -> "_Frame":
        """Check and take a frame."""
        return cls(vector("center", center, 3, "m"), rotation_matrix("rotation", rotation))

    def keep(self, tip: Composite, **given: object) -> None:
        """Make what a tip was given, this frame with it, its attributes."""
        for name, value in {**given, "center": self.center, "rotation": self.rotation}.items():
            object.__setattr__(tip, name, value)

    @property
    def text(self) -> str:
        """The frame as arguments, where it is not the sensor's own."""
        center = f", center={self.center.tolist()}" if self.center.any() else ""
        turned = (self.rotation != np.eye(3)).any()
        return center + (f", rotation={self.rotation.tolist()}" if turned else "")

    def point(self, local: FloatArray) -> FloatArray:
        """Map a point of the tip's frame to the sensor frame."""
        return np.asarray(self.center + self.rotation @ local)

    def half_spaces(self, bounds: Iterable[tuple[Sequence[float] | FloatArray, float]]) -> FloatArray:
        """Map half spaces (a, b) of the tip's frame to the sensor frame."""
        rows = []
        for normal, bound in bounds:
            turned = self.rotation @ np.asarray(normal)
            rows.append([*turned, bound + turned @ self.center])
        return np.array(rows)
