"""The interface of exploration strategies: planes, legs, marks, steering."""

import math
from dataclasses import dataclass
from enum import Enum, StrEnum
from typing import Protocol

from palpate.errors import InvalidValueError, positive, rotation_matrix, vector
from palpate.quick_init import quick_init
from palpate.spatial import IDENTITY, ZERO, Matrix, Vector, add, dot, rotate, rotate_back, subtract

Point = tuple[float, float]
"""(u, v) in the plane of the path [m]; in the default plane x and y of the base."""

_MIN_NORMAL_COS = 0.05
"""Least cosine between normal and axis for which a slope is given: 87 degrees; a height is no function beyond."""


@dataclass(frozen=True, slots=True)
class PathPlane:
    """Where u, v and the height above them lie in the base frame.

    Attributes:
        origin: Where u = v = 0 and the height is 0, base frame [m].
        rotation_base_plane: Maps (u, v, height) to base coordinates; its third column is the axis, which points
            away from the object: the tip approaches against it.
    """

    origin: Vector = ZERO
    rotation_base_plane: Matrix = IDENTITY

    def __post_init__(self) -> None:
        vector("origin", self.origin, 3, "m")
        rotation_matrix("rotation_base_plane", self.rotation_base_plane)

    @property
    def axis(self) -> Vector:
        """Unit vector away from the object, base frame."""
        a, b, c = self.rotation_base_plane
        return (a[2], b[2], c[2])

    def base(self, point: Point, height: float = 0.0) -> Vector:
        """Return a point of the plane in base coordinates [m]."""
        return add(self.origin, rotate(self.rotation_base_plane, (point[0], point[1], height)))

    def flat(self, position: Vector) -> Vector:
        """Return (u, v, height) of a position in base coordinates [m]."""
        return rotate_back(self.rotation_base_plane, subtract(position, self.origin))

    def slopes(self, normal: Vector) -> Point | None:
        """Return (dh/du, dh/dv) of a surface with this outward normal (base); None where it is too steep."""
        u, v, h = rotate_back(self.rotation_base_plane, normal)
        return None if h < _MIN_NORMAL_COS else (-u / h, -v / h)

    def steepness(self, normal: Vector) -> float:
        """Return the angle between the outward normal (base) and the axis [rad]."""
        return math.acos(min(max(dot(normal, self.axis), -1.0), 1.0))


@quick_init
@dataclass(frozen=True, slots=True)
class ContactPeriod:
    """One period in contact.

    Attributes:
        tip: Origin of the tip frame, base coordinates [m].
        contact: Contact centroid, base coordinates [m].
        normal: The object's outward unit normal there, base coordinates: minus that of the finger's contact.
    """

    tip: Vector
    contact: Vector
    normal: Vector


class PathEvent(StrEnum):
    """Event on a path."""

    EDGE = "edge"
    """The tip rolled over a convex edge: the contact hardly moved while the normal turned."""
    STEP = "step"
    """An edge and a corner close together, and another height beyond."""
    HOLE = "hole"
    """An edge, a jump and an edge, and the same height beyond: narrower than the tip."""
    TIGHT = "tight"
    """A concavity tighter than the tip: the contact jumped across the tip, what lies between was not felt."""
    FILLET = "fillet"
    """A concavity little wider than the tip, which followed it."""
    STEEP = "steep"
    """Too steep to follow: the rest of the leg was left out."""
    LOST = "lost"
    """The surface was lost and not found again by one slow bounded search."""
    UNREACHABLE = "unreachable"
    """Nothing was met where the tip should have landed, or the robot cannot go there."""
    BLOCKED = "blocked"
    """The force rose against the motion: the rest of the leg was left out."""
    OPEN = "open"
    """A contour that should close did not."""


@dataclass(frozen=True, slots=True)
class Mark:
    """One event, for the map.

    Attributes:
        event: Kind of the event.
        position: Where, base frame [m]: the contact if there was one, otherwise the tip's origin.
        reason: A sentence for the report.
        radius: Radius of the surface across an edge or a concavity, positive where it is convex [m]; NaN if
            unknown. For a concavity sharper than the tip it is minus the radius of the tip, a bound.
    """

    event: PathEvent
    position: Vector
    reason: str
    radius: float = math.nan


class Steering(Protocol):
    """Gives a direction in every period; pure, so that it can be replayed."""

    def offset(self, felt: ContactPeriod) -> float:
        """Return how far the tip is off the curve that is followed [m], positive along the axis."""
        ...

    def direction(self, felt: ContactPeriod) -> Vector | None:
        """Return the unit direction in which to slide, tangent to the surface, base frame; None: nowhere."""
        ...


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
    """Slide in contact along a polygon, from the present place of the tip to its first corner and on.

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
    """Slide in contact along the surface: the direction comes from the contact.

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
        how: Way in which the leg ended.
        tip: Where the tip is now, base frame [m].
    """

    how: LegEnd
    tip: Vector


class Strategy(Protocol):
    """Decides on the path of the tip leg by leg, from its contacts.

    A controller calls `feel` in every period in which the tip sweeps or a touch rests (microseconds), and `next`
    between legs, when the tip is commanded to rest: on the surface under force control, or lifted. (After a loss
    it is just stopping from landing speed: 10 ms are 0.05 mm.) `next` should take a period at most, and 10 ms at
    worst: for that long the robot keeps to its last command, and a real-time loop is late and, unless it is set to
    stop at that, skips the periods it missed. At 100 ms between samples the supervisor ends the run. A strategy
    depends on these calls only: given the same calls after `start`, it requests the same legs.
    """

    @property
    def plane(self) -> PathPlane:
        """In which the points of legs lie, and along whose axis the tip comes and goes."""
        ...

    @property
    def marks(self) -> tuple[Mark, ...]:
        """Marks for the map, in order."""
        ...

    def start(self) -> None:
        """Forget everything."""
        ...

    def feel(self, felt: ContactPeriod) -> bool:
        """Take one period in contact; return whether the present leg has now found its end.

        The controller does not call `feel` during landings, which settle and do not sweep.
        """
        ...

    def next(self, ended: LegResult | None) -> Leg | None:
        """Return the next leg, or None at the end.

        Args:
            ended: Result of the last leg; None at the beginning.
        """
        ...
