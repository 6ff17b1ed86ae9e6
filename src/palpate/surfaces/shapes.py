"""Common fingertips that are centred quadrics."""

import math
from dataclasses import dataclass

from palpate.errors import FloatArray, InvalidValueError, positive
from palpate.surfaces.quadric import CenteredQuadric


@dataclass(frozen=True, eq=False, repr=False)
class Sphere(CenteredQuadric):
    """A sphere.

    Args:
        radius: Radius [m].
        center: Centre in the sensor frame, shape (3,) [m].
        rotation: Accepted for uniformity; a sphere has no axes.

    Raises:
        InvalidValueError: `radius` is not a finite number above zero.
    """

    radius: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", positive("radius", self.radius, "m"))
        super().__post_init__()

    @property
    def half_lengths(self) -> tuple[float, float, float]:
        """Three times the radius [m]."""
        return (self.radius, self.radius, self.radius)


@dataclass(frozen=True, eq=False, repr=False)
class Ellipsoid(CenteredQuadric):
    """An ellipsoid; infinite semi-axes make it an elliptic cylinder or a slab.

    Args:
        semi_axes: Half lengths along x, y, z of the surface's own axes, shape (3,) [m]; at least one finite.
        center: Centre in the sensor frame, shape (3,) [m].
        rotation: Columns are the surface's axes in sensor coordinates, shape (3, 3).

    Raises:
        InvalidValueError: A semi-axis is not a number above zero, or none is finite.
    """

    semi_axes: tuple[float, float, float]

    def __post_init__(self) -> None:
        axes: tuple[float, ...] | FloatArray
        try:
            axes = tuple(self.semi_axes)
        except TypeError:
            axes = ()
        if len(axes) != 3:
            raise InvalidValueError(f"semi_axes = {self.semi_axes!r}: must be three lengths [m]")
        lengths = tuple(
            positive(f"semi_axes[{i}]", length, "m", infinite_allowed=True) for i, length in enumerate(axes)
        )
        object.__setattr__(self, "semi_axes", lengths)
        super().__post_init__()

    @property
    def half_lengths(self) -> tuple[float, float, float]:
        """The semi-axes [m]."""
        return self.semi_axes


@dataclass(frozen=True, eq=False, repr=False)
class Cylinder(CenteredQuadric):
    """An infinite circular cylinder about the z axis of its own frame.

    Args:
        radius: Radius [m].
        center: Any point on its axis, in the sensor frame, shape (3,) [m].
        rotation: Columns are the surface's axes in sensor coordinates, shape (3, 3).

    Raises:
        InvalidValueError: `radius` is not a finite number above zero.
    """

    radius: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", positive("radius", self.radius, "m"))
        super().__post_init__()

    @property
    def half_lengths(self) -> tuple[float, float, float]:
        """(radius, radius, infinity) [m]."""
        return (self.radius, self.radius, math.inf)


@dataclass(frozen=True, eq=False, repr=False)
class Plane(CenteredQuadric):
    """A pair of parallel planes at z = +-distance in its own frame; the force says which one is touched.

    Args:
        distance: Distance of each from the centre [m].
        center: A point half-way between them, in the sensor frame, shape (3,) [m].
        rotation: Columns are the surface's axes in sensor coordinates, shape (3, 3).

    Raises:
        InvalidValueError: `distance` is not a finite number above zero.
    """

    distance: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "distance", positive("distance", self.distance, "m"))
        super().__post_init__()

    @property
    def half_lengths(self) -> tuple[float, float, float]:
        """(infinity, infinity, distance) [m]."""
        return (math.inf, math.inf, self.distance)
