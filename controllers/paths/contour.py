"""Once round an object: along a curve of constant height or an edge."""

import math
from dataclasses import dataclass
from enum import IntEnum
from functools import cache
from typing import Any

from palpate.compiling import machine_code, njit
from palpate.controllers import small_vectors as vectors
from palpate.controllers.paths.features import FeatureLimits, MarkingStrategy, MarkRecorder
from palpate.controllers.paths.strategy import (
    Circuit,
    ContactPeriod,
    Hop,
    Leg,
    LegEnd,
    LegResult,
    PathPlane,
    Point,
    Steering,
)
from palpate.errors import InvalidValueError, check_positive, positive
from palpate.spatial import ZERO, Vector, add_scaled, cross, dot, norm, subtract, unit

_LEVEL_COS = math.cos(math.radians(1.0))
"""A surface closer to level than this has no direction of its own around it: noise of normals is half a degree."""


class Turn(IntEnum):
    """The sense of going round an object, seen against the axis (from above)."""

    LEFT = 1
    RIGHT = -1


@dataclass(frozen=True, slots=True)
class LevelSteering:
    """Around an object at a constant height of the tip: along the section of a plane.

    Line-of-sight guidance: the tip heads for the point of the section `lookahead` in front of it, so an offset of
    the height dies out over that length.

    Attributes:
        plane: Plane whose height 0 is the level of the tip.
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
        """Return the unit direction in which to slide; None where the surface is level."""
        return _around(felt.normal, self.plane.axis, self.turn, self.offset(felt), self.lookahead)


@dataclass(frozen=True, slots=True)
class EdgeSteering:
    """Along a convex edge, hanging over it by a constant angle.

    With its normal leant by `lean` from the axis the tip of radius R touches the edge, or the rounding of it, and
    its middle runs R sin(lean) outside: that is the offset at which the edge is followed.

    Attributes:
        plane: Plane whose axis is the normal of the face that the edge bounds.
        lean: Angle between axis and felt normal that is kept [rad], between 5 and 85 degrees.
        radius: Radius of the tip near the contact [m]; turns an error of the angle into one of length.
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
        """Return the unit direction in which to slide."""
        axis = self.plane.axis
        if dot(felt.normal, axis) > _LEVEL_COS:
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
    if size * size < 1.0 - _LEVEL_COS * _LEVEL_COS:
        return False, normal
    along = turn / size
    # of the two tangents across the path, the one that points along the axis
    upward = vectors.unit(vectors.add_scaled(axis, -vectors.dot(axis, normal), normal))
    return True, vectors.unit(vectors.add_scaled((along * x, along * y, along * z), -above / lookahead, upward))


@cache
def _kernel() -> Any:
    return machine_code(_section, ZERO, ZERO, 0.0, 0.0, 0.0)


def prepare_steering() -> None:
    """Compile what steering would otherwise wait for in its first period."""
    _kernel()


_MIN_CLOSED_TURN = 1.5 * math.pi
"""A simple closed curve turns by 2 pi; less than three quarters of it is a bend that passes by the beginning."""

_LEFT_TOLERANCES = 5.0
"""The tip must have been this many tolerances away from the beginning before it can return."""

_MEETING_SHARE = 0.2
"""The beginning is where the tip first came this much of the tolerance near to the curve: one that is itself off
by a tolerance would be passed by."""

_HEADING_SHARE = 0.5
"""Headings are taken over this part of the tolerance: from period to period they would be noise."""


class Contour(MarkingStrategy):
    """Lands, slides to the curve, follows it, and ends where it closes.

    If it does not close within `longest`, that is marked; so are loss and steepness, which end it too.

    Attributes:
        closed: Whether it came back to where it began.
        beginning: Tip where the curve was first met within the tolerance, base frame [m]; None: never.
        gone: Way of the tip along the curve since then [m].
    """

    def __init__(
        self, at: Point, steering: Steering, plane: PathPlane, longest: float, tolerance: float = 1e-3
    ) -> None:
        """Take where to land [m], how to steer, the longest path [m], and how close counts as closed [m]."""
        self.plane = plane
        self._legs: tuple[Leg, ...] = (Hop(at), Circuit(steering, positive("longest", longest, "m")))
        self._steering = steering
        self._tolerance = positive("tolerance", tolerance, "m")
        self.start()

    def start(self) -> None:
        """Forget all contacts and begin again."""
        self._mark_recorder = MarkRecorder(FeatureLimits(together=0.0))
        self._next = 0
        self.closed = False
        self.beginning: Vector | None = None
        self.gone = 0.0
        self._turned = 0.0
        self._left = False
        self._last: Vector | None = None
        self._heading: Vector | None = None

    def feel(self, felt: ContactPeriod) -> bool:
        """Record one period in contact; return True where the curve closes."""
        self._mark_recorder.feel(felt)
        if self._next < 2 or self.closed:
            return self.closed
        if self.beginning is None:
            if abs(self._steering.offset(felt)) <= _MEETING_SHARE * self._tolerance:
                self.beginning = self._last = felt.tip
            return False
        self._follow(felt.tip)
        away = norm(subtract(felt.tip, self.beginning))
        self._left = self._left or away > _LEFT_TOLERANCES * self._tolerance
        self.closed = self._left and away <= self._tolerance and abs(self._turned) > _MIN_CLOSED_TURN
        return self.closed

    def next(self, ended: LegResult | None) -> Leg | None:
        """Return the next leg, or None at the end."""
        if ended is not None:
            leg = self._legs[self._next - 1]
            height = self.plane.flat(ended.tip)[2]
            self._mark_recorder.end(ended, self.plane.base(leg.to, height) if isinstance(leg, Hop) else None)
            if ended.how is not LegEnd.REACHED:
                return None
        if self._next == len(self._legs):
            return None
        self._next += 1
        return self._legs[self._next - 1]

    def _follow(self, tip: Vector) -> None:
        """Add up the path length and the turn of the heading about the axis."""
        last = self._last
        if last is None:
            return
        axis = self.plane.axis
        step = subtract(tip, last)
        size = norm(step)
        if size < _HEADING_SHARE * self._tolerance:
            return
        self.gone += size
        self._last = tip
        flat = add_scaled(step, -dot(step, axis), axis)
        before, self._heading = self._heading, flat
        if before is not None:
            side = (
                before[1] * flat[2] - before[2] * flat[1],
                before[2] * flat[0] - before[0] * flat[2],
                before[0] * flat[1] - before[1] * flat[0],
            )
            self._turned += math.atan2(dot(side, axis), dot(before, flat))
