"""A spiral from the middle of a disc outwards, with turns a constant distance apart."""

import math
from dataclasses import dataclass

from palpate.controllers.paths.plane import Point
from palpate.controllers.paths.spacing import check_spacing
from palpate.errors import positive

NEWTON_STEPS = 20
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
        check_spacing("spiral", self.spacing, "radius", self.radius)

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
        for _ in range(NEWTON_STEPS):
            step = (self._arc(theta) - arc) / (self._pitch * math.hypot(1.0, theta))
            theta -= step
            if abs(step) <= 1e-14 * (1.0 + theta):
                break
        return theta
