"""Fingertips in robot files: what `fingers[].surface` may be."""

from pathlib import Path
from typing import ClassVar

import msgspec
import numpy as np
from scipy.spatial.transform import Rotation

from palpate.errors import FloatArray, InvalidValueError
from palpate.open_kinds import OpenKind, Settings, name_of_kind
from palpate.runtime.robot_ranges import at_most, within
from palpate.sensing.solver import Surface
from palpate.sim.tip import REACH
from palpate.spatial import ZERO, Vector
from palpate.surfaces import (
    Capsule,
    CenteredQuadric,
    CompliantTip,
    Cylinder,
    Ellipsoid,
    NearSphere,
    Paraboloid,
    Plane,
    RoundedBox,
    Sphere,
    Superellipsoid,
)
from palpate.surfaces.implicit import Implicit
from palpate.surfaces.parallel import half_extents

SMALLEST_TIP, LARGEST_TIP = 1e-6, 0.5
"""[m] of a fingertip's radius: beyond, it is a number in another unit."""

LARGEST_OFFSET = 2.0
"""[m] from the sensor to the surface's centre, likewise (as in sensor files)."""


class SurfaceKind(OpenKind):
    """A fingertip, in the sensor frame.

    Attributes:
        center: Of the surface [m], by which simulations and hands place it: the sensor's origin.
        reach: How far from its centre a simulation ends it along directions in which it has no end [m].
    """

    __slots__ = ()
    GROUP = "palpate.surfaces"
    METHODS = ("surface",)

    center: Vector = ZERO
    reach: float = REACH

    @property
    def rotation(self) -> FloatArray:
        """Columns are the surface's axes in sensor coordinates, shape (3, 3): those of the sensor."""
        return np.eye(3)

    def surface(self) -> Surface:
        """Return the fingertip.

        Raises:
            InvalidValueError: It cannot be built.
        """
        raise NotImplementedError

    @property
    def file(self) -> Path | None:
        """Of what it names, relative to the robot file; None if it is described by its settings alone."""
        return None

    def text_of(self, path: Path) -> str:
        """Return what a log keeps of that file.

        Raises:
            InvalidValueError: It cannot be read.
        """
        raise NotImplementedError

    def given(self, text: str) -> "SurfaceKind":
        """Return this fingertip with what `text_of` has read.

        Raises:
            InvalidValueError: It is no such fingertip.
        """
        raise NotImplementedError

    @property
    def half_extents(self) -> tuple[float, ...]:
        """Half lengths [m] of the ellipsoid about `center` by which paths are planned; one of a sphere.

        Contacts are sensed on the surface itself.
        """
        surface = self.surface()
        return (surface.radius,) if isinstance(surface, Sphere) else half_extents(surface)


class PlacedSurface(SurfaceKind, Settings, frozen=True, kw_only=True):
    """Where a fingertip's surface sits in the sensor frame; what it is, the kinds below say.

    Attributes:
        center: Of the surface [m]; of a capsule, of its hemisphere; of a paraboloid, its apex.
        rotvec: How its axes are turned against the sensor's: axis times angle [rad].
    """

    center: Vector = msgspec.field(name="center_m", default=ZERO)
    rotvec: Vector = msgspec.field(name="rotvec_rad", default=ZERO)

    LENGTHS: ClassVar[tuple[tuple[str, str], ...]] = ()
    """(attribute, key) of everything that is one or several lengths."""

    def __post_init__(self) -> None:
        for attribute, key in self.LENGTHS:
            value = getattr(self, attribute)
            for length in value if isinstance(value, tuple) else (value,):
                within(key, length, SMALLEST_TIP, LARGEST_TIP, "m")
        self.check_place()
        self.surface()  # refuses what only all of it together shows

    def check_place(self) -> None:
        """Refuse a place and a turn out of range.

        Raises:
            InvalidValueError: It is such a one.
        """
        for coordinate in self.center:
            at_most("center_m", coordinate, LARGEST_OFFSET, "m")
        for angle in self.rotvec:
            at_most("rotvec_rad", angle, 2.0 * np.pi, "rad")

    @property
    def rotation(self) -> FloatArray:
        """Columns are the surface's axes in sensor coordinates, shape (3, 3)."""
        return np.asarray(Rotation.from_rotvec(self.rotvec).as_matrix()) if any(self.rotvec) else np.eye(3)


class SphereEntry(PlacedSurface, frozen=True, kw_only=True):
    """A sphere of this radius [m]."""

    radius: float = msgspec.field(name="radius_m")
    LENGTHS = (("radius", "radius_m"),)

    def surface(self) -> Sphere:
        """See `SurfaceKind`."""
        return Sphere(self.radius, center=np.array(self.center), rotation=self.rotation)


class EllipsoidEntry(PlacedSurface, frozen=True, kw_only=True):
    """An ellipsoid with these semi-axes [m]."""

    semi_axes: Vector = msgspec.field(name="semi_axes_m")
    LENGTHS = (("semi_axes", "semi_axes_m"),)

    def surface(self) -> Ellipsoid:
        """See `SurfaceKind`."""
        return Ellipsoid(self.semi_axes, center=np.array(self.center), rotation=self.rotation)


class NearSphereEntry(PlacedSurface, frozen=True, kw_only=True):
    """A sphere of this radius [m] with small deviations [m]: see `palpate.surfaces.NearSphere`."""

    radius: float = msgspec.field(name="radius_m")
    deviations: tuple[float, ...] = msgspec.field(name="deviations_m")
    LENGTHS = (("radius", "radius_m"),)

    def surface(self) -> NearSphere:
        """See `SurfaceKind`."""
        return NearSphere(self.radius, self.deviations, center=np.array(self.center), rotation=self.rotation)


class CylinderEntry(PlacedSurface, frozen=True, kw_only=True):
    """An endless cylinder about z with this radius [m]."""

    radius: float = msgspec.field(name="radius_m")
    LENGTHS = (("radius", "radius_m"),)

    def surface(self) -> Cylinder:
        """See `SurfaceKind`."""
        return Cylinder(self.radius, center=np.array(self.center), rotation=self.rotation)


class PlaneEntry(PlacedSurface, frozen=True, kw_only=True):
    """Flat at z = +- this distance [m]; simulated, it ends where `reach` says."""

    distance: float = msgspec.field(name="distance_m")
    reach: float = msgspec.field(name="reach_m", default=REACH)
    LENGTHS = (("distance", "distance_m"), ("reach", "reach_m"))

    def surface(self) -> Plane:
        """See `SurfaceKind`."""
        return Plane(self.distance, center=np.array(self.center), rotation=self.rotation)


class ParaboloidEntry(PlacedSurface, frozen=True, kw_only=True):
    """A paraboloid that opens along -z, with these radii of curvature at its apex [m]."""

    radii: tuple[float, float] = msgspec.field(name="radii_m")
    LENGTHS = (("radii", "radii_m"),)

    def surface(self) -> Paraboloid:
        """See `SurfaceKind`."""
        return Paraboloid(self.radii, center=np.array(self.center), rotation=self.rotation)


class CapsuleEntry(PlacedSurface, frozen=True, kw_only=True):
    """A thimble: a hemisphere of this radius on a cylinder down to z = -length [m]."""

    radius: float = msgspec.field(name="radius_m")
    length: float = msgspec.field(name="length_m")
    LENGTHS = (("radius", "radius_m"), ("length", "length_m"))

    def surface(self) -> Capsule:
        """See `SurfaceKind`."""
        return Capsule(self.radius, self.length, self.center, self.rotation)


class SuperellipsoidEntry(PlacedSurface, frozen=True, kw_only=True):
    """|x/a|^p + |y/b|^p + |z/c|^p = 1 with these semi-axes [m]: a box with round edges for large p."""

    semi_axes: Vector = msgspec.field(name="semi_axes_m")
    exponent: float
    LENGTHS = (("semi_axes", "semi_axes_m"),)

    def surface(self) -> Superellipsoid:
        """See `SurfaceKind`."""
        return Superellipsoid(self.semi_axes, self.exponent, center=np.array(self.center), rotation=self.rotation)


class CompliantEntry(SurfaceKind, Settings, frozen=True, kw_only=True):
    """A skin that yields, on a closed tip: see `palpate.surfaces.CompliantTip`.

    Attributes:
        tip: Undeformed, where it sits in the sensor frame.
        stiffness: [N/m^(1/exponent)].
        exponent: Of the law: 1 in proportion to the force, 2/3 of elastic bodies that touch in a point (Hertz).
    """

    tip: SurfaceKind
    stiffness: float = msgspec.field(name="stiffness_N_per_m")
    exponent: float = 1.0

    def __post_init__(self) -> None:
        """Refuse what cannot be, once it is read."""
        if self.tip.file is None:
            self.surface()

    @property
    def file(self) -> Path | None:
        """See `SurfaceKind`: that of the tip."""
        return self.tip.file

    def text_of(self, path: Path) -> str:
        """See `SurfaceKind`."""
        return self.tip.text_of(path)

    def given(self, text: str) -> SurfaceKind:
        """See `SurfaceKind`."""
        found = msgspec.structs.replace(self, tip=self.tip.given(text))
        found.surface()
        return found

    @property
    def center(self) -> Vector:  # type: ignore[override]  # read from the tip; nobody writes a frozen one
        """Of the undeformed tip [m]."""
        return self.tip.center

    @property
    def rotation(self) -> FloatArray:
        """Of the undeformed tip."""
        return self.tip.rotation

    def surface(self) -> CompliantTip:
        """See `SurfaceKind`.

        Raises:
            InvalidValueError: The tip is not closed, or the law cannot be.
        """
        tip = self.tip.surface()
        if not isinstance(tip, CenteredQuadric | Implicit):
            raise InvalidValueError(
                f"tip.kind = {name_of_kind(self.tip)}: a skin is on a closed tip: sphere, ellipsoid, "
                "superellipsoid or an implicit surface"
            )
        return CompliantTip(tip, self.stiffness, self.exponent)


class RoundedBoxEntry(PlacedSurface, frozen=True, kw_only=True):
    """A box of these half lengths, rounding included, with edges of this radius [m]."""

    half_lengths: Vector = msgspec.field(name="half_lengths_m")
    radius: float = msgspec.field(name="radius_m")
    LENGTHS = (("half_lengths", "half_lengths_m"), ("radius", "radius_m"))

    def surface(self) -> RoundedBox:
        """See `SurfaceKind`."""
        return RoundedBox(self.half_lengths, self.radius, self.center, self.rotation)
