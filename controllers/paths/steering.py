"""Where to slide, from what is felt: along a level curve of a surface, or along its edge."""

import math
from dataclasses import dataclass
from enum import IntEnum
from functools import cache
from typing import Any, Protocol

from palpate.compiling import machine_code, njit
from palpate.controllers import small_vectors as vectors
from palpate.controllers.paths.contact_period import ContactPeriod
from palpate.controllers.paths.plane import PathPlane
from palpate.errors import InvalidValueError, check_positive, positive
from palpate.spatial import ZERO, Vector, add_scaled, cross, dot, norm, unit

LEVEL_COS = math.cos(math.radians(1.0))
"""A surface closer to level than this has no direction of its own around it: noise of normals is half a degree."""


class Turn(IntEnum):
    """The sense of going round an object, seen against the axis (from above)."""

    LEFT = 1
    RIGHT = -1


class Steering(Protocol):
    """Gives a direction in every period; pure, so that it can be replayed."""

    def offset(self, felt: ContactPeriod) -> float:
        """Return how far the tip is off the curve that is followed [m], positive along the axis."""
        ...

    def direction(self, felt: ContactPeriod) -> Vector | None:
        """Return the unit direction in which to slide, tangent to the surface, base frame; None: nowhere."""
        ...


@dataclass(frozen=True, slots=True)
class LevelSteering:
    """Around an object at a constant height of the tip: along the section of a plane.

    Line-of-sight guidance: the tip heads for the point of the section `lookahead` in front of it, so an offset of
    the height dies out over that length.

    Attributes:
        plane: Its height 0 is the level that is kept.
        turn: Sense of rotation.
        lookahead: [m].
    """

    plane: PathPlane
    turn: Turn = Turn.LEFT
    lookahead: float = 2e-3

    def __post_init__(self) -> None:
        positive("lookahead", self.lookahead, "m")

    def offset(self, felt: ContactPeriod) -> float:
        """Return the height above the level [m]."""
        return self.plane.flat(felt.tip)[2]

    def direction(self, felt: ContactPeriod) -> Vector | None:
        """As `Steering`; None where the surface is level."""
        return _around(felt.normal, self.plane.axis, self.turn, self.offset(felt), self.lookahead)


@dataclass(frozen=True, slots=True)
class EdgeSteering:
    """Along a convex edge, hanging over it by a constant angle.

    With its normal leant by `lean` from the axis the tip of radius R touches the edge, or the rounding of it, and
    its middle runs R sin(lean) outside: that is the offset at which the edge is followed.

    Attributes:
        plane: Its axis is the normal of the face that the edge bounds.
        lean: Angle between axis and felt normal that is kept [rad], between 5 and 85 degrees.
        radius: Of the tip near the contact [m]; turns an error of the angle into one of length.
        outward: Towards the edge, base frame: where to go while the face itself is felt.
        turn: Sense of rotation.
        lookahead: [m].
    """

    plane: PathPlane
    lean: float
    radius: float
    outward: Vector
    turn: Turn = Turn.LEFT
    lookahead: float = 2e-3

    def __post_init__(self) -> None:
        check_positive(self, radius="m", lookahead="m")
        if not math.radians(5.0) <= self.lean <= math.radians(85.0):
            raise InvalidValueError(
                f"lean = {self.lean:g} rad: must lie between 0.087 and 1.484 rad (5 and 85 degrees)"
            )
        if norm(cross(self.outward, self.plane.axis)) < 1e-6:
            raise InvalidValueError(f"outward = {self.outward}: must point across the plane's axis")

    @classmethod
    def at_offset(
        cls, plane: PathPlane, offset: float, radius: float, outward: Vector, turn: Turn = Turn.LEFT
    ) -> "EdgeSteering":
        """Return the steering whose tip runs `offset` [m] outside a sharp edge: lean = asin(offset / radius)."""
        if not 0.0 < offset < positive("radius", radius, "m"):
            raise InvalidValueError(
                f"offset = {offset:g} m: must be above 0 and below the tip's radius = {radius:g} m"
            )
        # round a corner of the object the path of the tip turns with the offset as its radius
        return cls(plane, math.asin(offset / radius), radius, outward, turn, min(2e-3, 0.5 * offset))

    def offset(self, felt: ContactPeriod) -> float:
        """Return radius times missing lean [m]: leaning further is further out, and lower."""
        return self.radius * (self.lean - self.plane.steepness(felt.normal))

    def direction(self, felt: ContactPeriod) -> Vector | None:
        """As `Steering`."""
        axis = self.plane.axis
        if dot(felt.normal, axis) > LEVEL_COS:
            away = add_scaled(self.outward, -dot(self.outward, felt.normal), felt.normal)
            return unit(away)
        return _around(felt.normal, axis, self.turn, self.offset(felt), self.lookahead)


def _around(normal: Vector, axis: Vector, turn: Turn, above: float, lookahead: float) -> Vector | None:
    """Return the direction along the section, leaning back to it from `above` [m]."""
    found, direction = _kernel()(normal, axis, turn, above, lookahead)
    return direction if found else None


@njit(cache=True)
def _section(normal: Vector, axis: Vector, turn: float, above: float, lookahead: float) -> tuple[bool, Vector]:
    """Whether there is a direction, and it."""
    x, y, z = (
        axis[1] * normal[2] - axis[2] * normal[1],
        axis[2] * normal[0] - axis[0] * normal[2],
        axis[0] * normal[1] - axis[1] * normal[0],
    )
    size = vectors.length(x, y, z)
    if size * size < 1.0 - LEVEL_COS * LEVEL_COS:
        return False, normal
    along = turn / size
    # of the two tangents across the path, the one that points along the axis
    upward = vectors.unit(vectors.add_scaled(axis, -vectors.dot(axis, normal), normal))
    return True, vectors.unit(vectors.add_scaled((along * x, along * y, along * z), -above / lookahead, upward))


@cache
def _kernel() -> Any:
    return machine_code(_section, ZERO, ZERO, 0.0, 0.0, 0.0)


def prepare() -> None:
    """Compile what steering would otherwise wait for in its first period."""
    _kernel()
