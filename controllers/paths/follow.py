"""Strategies whose path is known beforehand: following a polygon, and single touches."""

import math
from bisect import bisect_right
from itertools import accumulate, pairwise
from typing import Protocol

from palpate.controllers.paths.features import MarkingStrategy, MarkRecorder
from palpate.controllers.paths.path_follower import ARRIVAL_DISTANCE
from palpate.controllers.paths.strategy import (
    ContactPeriod,
    Hop,
    Leg,
    LegEnd,
    LegResult,
    PathPlane,
    Point,
    SingleTouch,
    Stroke,
)
from palpate.errors import InvalidValueError, positive

MIN_LEFT_OUT = 2e-3
"""How much of the path is left out at least after a place that could not be followed [m]."""


class Path(Protocol):
    """A polygon: a raster, a spiral, waypoints."""

    def corners(self) -> tuple[Point, ...]:
        """Return the corners, in order, in the plane of the path [m]."""
        ...


class Follow(MarkingStrategy):
    """Lands at the first corner and slides along the path.

    Where it is too steep or blocked, or nothing is met, the place is marked and the path goes on `left_out`
    further on, and twice as far every time that this leads to nothing either: of a path that lies beside the
    object the number of tries grows with the logarithm of its length. A loss ends it; so does a first landing
    that meets nothing.
    """

    def __init__(self, path: Path, plane: PathPlane | None = None, left_out: float = MIN_LEFT_OUT) -> None:
        self.plane = plane or PathPlane()
        self._corners = path.corners()
        steps = (math.dist(a, b) for a, b in pairwise(self._corners))
        self._arc_lengths = tuple(accumulate(steps, initial=0.0))  # along the path to every corner
        self._left_out = positive("left_out", left_out, "m")
        self.start()

    def start(self) -> None:
        """Forget all contacts and begin again."""
        self._mark_recorder = MarkRecorder()
        self._arc_length = 0.0  # along the path, to where the present leg began or begins
        self._landing = False
        self._met = False
        self._leave_out = self._left_out

    def feel(self, felt: ContactPeriod) -> bool:
        """Record one period in contact; return whether the leg has found its end."""
        self._mark_recorder.feel(felt)
        self._met, self._leave_out = True, self._left_out
        return False

    def next(self, ended: LegResult | None) -> Leg | None:
        """Return the next leg, or None at the end."""
        if ended is None:
            return self._land(0.0)
        aim = self.plane.base(self._at(self._arc_length), self.plane.flat(ended.tip)[2]) if self._landing else None
        self._mark_recorder.end(ended, aim)
        if ended.how is LegEnd.LOST or (ended.how is LegEnd.MISSED and not self._met):
            return None
        if ended.how is LegEnd.REACHED:
            if not self._landing:
                return None
            self._landing = False
            return Stroke(self._corners[bisect_right(self._arc_lengths, self._arc_length) :])
        arc_length = (self._arc_length if self._landing else self._reached(ended)) + self._leave_out
        self._leave_out *= 2.0
        return self._land(arc_length) if arc_length < self._arc_lengths[-1] - ARRIVAL_DISTANCE else None

    def _land(self, arc_length: float) -> Leg:
        self._arc_length, self._landing = arc_length, True
        return Hop(self._at(arc_length))

    def _at(self, arc_length: float) -> Point:
        """The place so far along the path [m]."""
        k = min(bisect_right(self._arc_lengths, arc_length), len(self._arc_lengths) - 1)
        (ax, ay), (bx, by) = self._corners[k - 1], self._corners[k]
        share = (arc_length - self._arc_lengths[k - 1]) / (self._arc_lengths[k] - self._arc_lengths[k - 1])
        return (ax + share * (bx - ax), ay + share * (by - ay))

    def _reached(self, ended: LegResult) -> float:
        """How far along the path the tip came [m]: to the place nearest to it, on the part of it that was left."""
        u, v, _ = self.plane.flat(ended.tip)
        first = bisect_right(self._arc_lengths, self._arc_length) - 1
        tried = []
        for k, (a, b) in enumerate(pairwise(self._corners[first:]), first):
            share = _share((u, v), a, b)
            nearest = (a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]))
            tried.append(
                (
                    math.dist((u, v), nearest),
                    self._arc_lengths[k] + share * (self._arc_lengths[k + 1] - self._arc_lengths[k]),
                )
            )
        return max(min(tried)[1], self._arc_length)


def _share(point: Point, a: Point, b: Point) -> float:
    """Where on a segment the place nearest to a point lies, from 0 at its beginning to 1 at its end."""
    du, dv = b[0] - a[0], b[1] - a[1]
    along = ((point[0] - a[0]) * du + (point[1] - a[1]) * dv) / (du * du + dv * dv)
    return min(max(along, 0.0), 1.0)


def tap_grid(width: float, depth: float, spacing: float, center: Point = (0.0, 0.0)) -> tuple[Point, ...]:
    """Return points of a grid over a rectangle, at most `spacing` apart, in the order of a raster [m]."""
    across = math.ceil(positive("width", width, "m") / positive("spacing", spacing, "m") - 1e-9)
    along = math.ceil(positive("depth", depth, "m") / spacing - 1e-9)
    points = []
    for j in range(along + 1):
        v = center[1] + depth * (j / along - 0.5)
        row = [(center[0] + width * (i / across - 0.5), v) for i in range(across + 1)]
        points += row if j % 2 == 0 else row[::-1]
    return tuple(points)


class Taps(MarkingStrategy):
    """Approaches, touches and retreats at every point; a miss is marked, and the next point tried."""

    def __init__(self, points: tuple[Point, ...], retreat: float = 5e-3, plane: PathPlane | None = None) -> None:
        """Take the points [m] and how far to retreat after each touch [m]."""
        if not points:
            raise InvalidValueError("there are no points to tap: give at least 1")
        self.plane = plane or PathPlane()
        self._legs = tuple(SingleTouch(point, retreat) for point in points)
        self.start()

    def start(self) -> None:
        """Forget all contacts and begin again."""
        self._mark_recorder = MarkRecorder()
        self._next = 0

    def feel(self, felt: ContactPeriod) -> bool:
        """Record one period in contact; return whether the leg has found its end."""
        self._mark_recorder.feel(felt)
        return False

    def next(self, ended: LegResult | None) -> Leg | None:
        """Return the next leg, or None at the end."""
        if ended is not None:
            at = self._legs[self._next - 1].at
            self._mark_recorder.end(ended, self.plane.base(at, self.plane.flat(ended.tip)[2]))
        if self._next == len(self._legs):
            return None
        self._next += 1
        return self._legs[self._next - 1]
