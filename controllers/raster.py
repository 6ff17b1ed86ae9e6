"""A raster: parallel rows over a rectangle, joined at alternate ends."""

import math
from dataclasses import dataclass
from itertools import pairwise

from palpate.errors import InvalidValueError, positive

Point = tuple[float, float]
"""(x, y) in base coordinates [m]."""


@dataclass(frozen=True, slots=True)
class Raster:
    """Rows along x, stepping along y.

    Attributes:
        width: Extent along x [m].
        depth: Extent along y [m].
        spacing: Distance between rows [m], an upper bound: the rows are spread evenly.
        center: Middle of the rectangle (x, y), base frame [m].
    """

    width: float
    depth: float
    spacing: float
    center: Point = (0.0, 0.0)

    def __post_init__(self) -> None:
        positive("raster width", self.width, "m")
        positive("raster depth", self.depth, "m")
        positive("raster spacing", self.spacing, "m")
        if self.spacing > self.depth:
            raise InvalidValueError(
                f"raster spacing = {self.spacing:g} m: must not exceed the depth = {self.depth:g} m"
            )

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
        """Length of the path, seen from above [m]."""
        corners = self.corners()
        return sum(math.dist(a, b) for a, b in pairwise(corners))


class PathFollower:
    """Follows a polygon in the x-y plane with bounded acceleration, stopping briefly at every corner.

    On each leg the tip is steered back to the line with a rate of `STEERING`. The speed towards a corner is
    bounded by sqrt(2 a d), from which a can still stop it where it counts as arrived.
    """

    STEERING = 5.0
    """Rate at which an offset from the line is taken back [1/s]: a tenth of what a 100 rad/s servo allows."""

    ARRIVED = 1e-4
    """A corner counts as reached this close to it [m]."""

    SLOWEST = 1e-3
    """Least speed on the way to a corner [m/s]: without it the last tenth of a millimetre would take for ever."""

    def __init__(self, corners: tuple[Point, ...], acceleration: float) -> None:
        """Take a path of at least two corners and a bound on acceleration [m/s^2]."""
        if len(corners) < 2:
            raise InvalidValueError(f"the path has {len(corners)} corners: it needs at least 2")
        headings = []
        for a, b in pairwise(corners):
            length = math.dist(a, b)
            if length <= self.ARRIVED:
                raise InvalidValueError(
                    f"corners {a} and {b} m: must be more than {self.ARRIVED:g} m apart to give a direction"
                )
            headings.append(((b[0] - a[0]) / length, (b[1] - a[1]) / length))
        self._headings = tuple(headings)
        self._corners = corners
        self._acceleration = positive("acceleration", acceleration, "m/s^2")
        self._target = 1
        self._current = 0.0

    def stop(self) -> None:
        """Begin again from rest: something else has moved the tip."""
        self._current = 0.0

    @property
    def finished(self) -> bool:
        """Whether the last corner was reached."""
        return self._target >= len(self._corners)

    @property
    def heading(self) -> Point:
        """Unit direction of the present leg; zero when finished."""
        return (0.0, 0.0) if self.finished else self._headings[self._target - 1]

    def velocity(self, position: Point, slope: float, speed: float, period: float) -> Point:
        """Return the horizontal velocity from here [m/s].

        Args:
            position: Where the tip is (x, y) [m].
            slope: Horizontal distance per distance along the surface, in (0, 1]: the path is followed with the
                wanted speed along the surface.
            speed: That wanted speed [m/s]. It may change: a rise is spread out here; a fall is followed at once,
                so whoever lowers it keeps to the acceleration.
            period: Time until the next call [s].
        """
        if self.finished:
            return (0.0, 0.0)
        (ux, uy), b = self.heading, self._corners[self._target]
        dx, dy = b[0] - position[0], b[1] - position[1]
        remaining = dx * ux + dy * uy
        if remaining < self.ARRIVED:
            self._target += 1
            self._current = 0.0
            return (0.0, 0.0)
        # from v, braking by a T in every period T, the tip stops within v^2 / 2a + v T / 2
        step = 0.5 * self._acceleration * period
        allowed = math.sqrt(step * step + 2.0 * self._acceleration * (remaining - self.ARRIVED)) - step
        self._current = min(self._current + self._acceleration * period, speed, max(allowed, self.SLOWEST))
        offset = self.STEERING * (dy * ux - dx * uy)
        # both together keep to the speed: far from its line the tip first goes back to it
        fastest = speed * slope
        offset = min(max(offset, -fastest), fastest)
        forward = min(self._current * slope, math.sqrt(fastest**2 - offset**2))
        return (forward * ux - offset * uy, forward * uy + offset * ux)
