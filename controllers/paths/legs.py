"""Legs that a strategy requests, and the results it gets back."""

from dataclasses import dataclass
from enum import Enum

from palpate.controllers.paths.plane import Point
from palpate.controllers.paths.steering import Steering
from palpate.errors import InvalidValueError, positive
from palpate.spatial import Vector


@dataclass(frozen=True, slots=True)
class Hop:
    """Lift off, travel above the object at the height at which the run began, and land.

    It ends as REACHED in contact and settled; as MISSED, with the tip still down there, if nothing is met within
    the approach distance; as BLOCKED if the travel to it is.

    Attributes:
        to: Where to land, in the plane of the path [m].
    """

    to: Point


@dataclass(frozen=True, slots=True)
class Stroke:
    """Slide in contact along a polygon, from wherever the tip is to its first corner and on.

    A tip that is off the surface first lands where it is. A lost surface is sought once per leg.

    Attributes:
        corners: In the plane of the path [m], at least one.
    """

    corners: tuple[Point, ...]

    def __post_init__(self) -> None:
        if not self.corners:
            raise InvalidValueError("a stroke has no corners: it needs at least 1")


@dataclass(frozen=True, slots=True)
class SingleTouch:
    """Approach along the axis, touch once, and retreat along it; from touch to touch travel at that height.

    Attributes:
        at: In the plane of the path [m].
        retreat: How far to go back [m].
    """

    at: Point
    retreat: float

    def __post_init__(self) -> None:
        positive("retreat", self.retreat, "m")


@dataclass(frozen=True, slots=True)
class Circuit:
    """Slide in contact wherever the surface leads: the direction comes from what is felt.

    Attributes:
        steering: Gives the direction in every period.
        longest: The leg ends as OVERLONG after this path length [m].
    """

    steering: Steering
    longest: float

    def __post_init__(self) -> None:
        positive("longest", self.longest, "m")


Leg = Hop | Stroke | SingleTouch | Circuit


class LegEnd(Enum):
    """How a leg ended."""

    REACHED = "reached"
    """At its end; a touch: the surface was felt."""
    MISSED = "missed"
    """Nothing was met within the approach distance."""
    LOST = "lost"
    """The surface was lost, and one slow bounded search did not find it again."""
    STEEP = "steep"
    """The surface became too steep to follow."""
    BLOCKED = "blocked"
    """The tip was commanded to slide and did not move; an obstacle in a flight could not be avoided; or
    the tip would have left its room."""
    OVERLONG = "overlong"
    """A circuit did not end by itself."""


@dataclass(frozen=True, slots=True)
class LegResult:
    """The end of a leg.

    Attributes:
        how: As it says.
        tip: Where the tip is now, base frame [m].
    """

    how: LegEnd
    tip: Vector
