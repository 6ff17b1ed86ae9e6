"""Paths that are polygons known beforehand: waypoints, rasters, spirals, and grids of taps."""

import math
from dataclasses import dataclass
from itertools import pairwise

from palpate.controllers.paths.strategy import Point
from palpate.errors import InvalidValueError, positive

_MIN_POINT_DISTANCE = 1e-4
"""Neighbours must be farther apart [m]: as close as a corner counts as reached."""


@dataclass(frozen=True, slots=True)
class Waypoints:
    """Straight lines from point to point.

    Attributes:
        points: In the plane of the path [m], at least two.
    """

    points: tuple[Point, ...]

    def __post_init__(self) -> None:
        if len(self.points) < 2:
            raise InvalidValueError(f"the path has {len(self.points)} points: it needs at least 2")
        for a, b in pairwise(self.points):
            if not _MIN_POINT_DISTANCE < math.dist(a, b) < math.inf:
                raise InvalidValueError(
                    f"points {a} and {b} m: must be finite and more than {_MIN_POINT_DISTANCE:g} m apart to give "
                    "a direction"
                )

    @property
    def length(self) -> float:
        """Length of the path [m]."""
        return sum(math.dist(a, b) for a, b in pairwise(self.points))

    def corners(self) -> tuple[Point, ...]:
        """Return the points."""
        return self.points


_LIKELY_MILLIMETRES = 1.0
"""Spacing from which on it was probably given in millimetres [m]."""


def _check_spacing(path: str, spacing: float, extent_name: str, extent: float) -> None:
    """Refuse lines that are farther apart than the path is large.

    Args:
        path: Name of the path.
        spacing: Distance of its lines [m].
        extent_name: Name of the extent that bounds the spacing, as depth.
        extent: Extent [m].

    Raises:
        InvalidValueError: They are.
    """
    if spacing > extent:
        hint = f"; for {spacing:g} mm give {spacing / 1e3:g}" if spacing >= _LIKELY_MILLIMETRES else ""
        raise InvalidValueError(
            f"{path} spacing = {spacing:g} m: must not exceed the {extent_name} = {extent:g} m{hint}"
        )


@dataclass(frozen=True, slots=True)
class Raster:
    """Rows along u, stepping along v: x and y of the base, unless the path's plane is another.

    Attributes:
        width: Extent along u [m].
        depth: Extent along v [m].
        spacing: Distance between rows [m], an upper bound: the rows are spread evenly.
        center: Middle of the rectangle, in the plane of the path [m].
    """

    width: float
    depth: float
    spacing: float
    center: Point = (0.0, 0.0)

    def __post_init__(self) -> None:
        positive("raster width", self.width, "m")
        positive("raster depth", self.depth, "m")
        positive("raster spacing", self.spacing, "m")
        _check_spacing("raster", self.spacing, "depth", self.depth)

    @property
    def rows(self) -> int:
        """Number of rows."""
        return math.ceil(self.depth / self.spacing - 1e-9) + 1

    def corners(self) -> tuple[Point, ...]:
        """Return the corners of the path, in order."""
        x, y = self.center
        corners = []
        for row in range(self.rows):
            along = y - self.depth / 2 + self.depth * row / (self.rows - 1)
            ends = [(x - self.width / 2, along), (x + self.width / 2, along)]
            corners += ends if row % 2 == 0 else ends[::-1]
        return tuple(corners)

    @property
    def length(self) -> float:
        """Length of the path, in its plane [m]."""
        corners = self.corners()
        return sum(math.dist(a, b) for a, b in pairwise(corners))


_NEWTON_STEPS = 20
"""Most steps to the angle at a length of arc; from the start below five are enough for rounding."""


@dataclass(frozen=True, slots=True)
class Spiral:
    """Archimedes' spiral r = spacing theta / (2 pi), cut into chords of equal length of arc.

    Attributes:
        radius: Where it ends [m].
        spacing: Distance between turns [m].
        center: Where it begins, in the plane of the path [m].
        step: Length of arc per chord [m], an upper bound: the chords are even.
    """

    radius: float
    spacing: float
    center: Point = (0.0, 0.0)
    step: float = 2e-4

    def __post_init__(self) -> None:
        positive("spiral radius", self.radius, "m")
        positive("spiral spacing", self.spacing, "m")
        positive("spiral step", self.step, "m")
        _check_spacing("spiral", self.spacing, "radius", self.radius)

    @property
    def length(self) -> float:
        """Length of the spiral itself [m]."""
        return self._arc(self.radius / self._pitch)

    def corners(self) -> tuple[Point, ...]:
        """Return points of the spiral, in order, evenly spaced along it."""
        count = math.ceil(self.length / self.step)
        x, y = self.center
        corners = []
        for k in range(count + 1):
            theta = self._angle(self.length * k / count)
            r = self._pitch * theta
            corners.append((x + r * math.cos(theta), y + r * math.sin(theta)))
        return tuple(corners)

    @property
    def _pitch(self) -> float:
        return self.spacing / (2.0 * math.pi)

    def _arc(self, theta: float) -> float:
        """Length from the middle: integral of pitch sqrt(1 + theta^2) [m]."""
        return 0.5 * self._pitch * (theta * math.hypot(1.0, theta) + math.asinh(theta))

    def _angle(self, arc: float) -> float:
        """The inverse of `_arc`: convex there, so Newton's iteration from above falls steadily."""
        theta = min(arc / self._pitch, math.sqrt(2.0 * arc / self._pitch))
        for _ in range(_NEWTON_STEPS):
            step = (self._arc(theta) - arc) / (self._pitch * math.hypot(1.0, theta))
            theta -= step
            if abs(step) <= 1e-14 * (1.0 + theta):
                break
        return theta
