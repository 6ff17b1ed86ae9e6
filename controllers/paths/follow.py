"""Follows a path that is known beforehand, and goes on beyond what cannot be followed."""

import math
from bisect import bisect_right
from itertools import accumulate, pairwise
from typing import Protocol

from palpate.controllers.paths.contact_period import ContactPeriod
from palpate.controllers.paths.legs import Hop, Leg, LegEnd, LegResult, Stroke
from palpate.controllers.paths.mark_recorder import MarkRecorder
from palpate.controllers.paths.marks import Mark
from palpate.controllers.paths.path_follower import ARRIVED
from palpate.controllers.paths.plane import PathPlane, Point
from palpate.errors import positive

LEFT_OUT = 2e-3
"""How much of the path is left out at least after a place that could not be followed [m]."""


class Path(Protocol):
    """A polygon: a raster, a spiral, waypoints."""

    def corners(self) -> tuple[Point, ...]:
        """Return the corners, in order, in the plane of the path [m]."""
        ...


class Follow:
    """Lands at the first corner and slides along the path.

    Where it is too steep or blocked, or nothing is met, the place is marked and the path goes on `left_out`
    further on, and twice as far every time that this leads to nothing either: of a path that lies beside the
    object the number of tries grows with the logarithm of its length. A loss ends it; so does a first landing
    that meets nothing.
    """

    def __init__(self, path: Path, plane: PathPlane | None = None, left_out: float = LEFT_OUT) -> None:
        self.plane = plane or PathPlane()
        self._corners = path.corners()
        steps = (math.dist(a, b) for a, b in pairwise(self._corners))
        self._arc_lengths = tuple(accumulate(steps, initial=0.0))  # along the path to every corner
        self._left_out = positive("left_out", left_out, "m")
        self.start()

    @property
    def marks(self) -> tuple[Mark, ...]:
        """As `Strategy`."""
        return self._mark_recorder.marks

    def start(self) -> None:
        """As `Strategy`."""
        self._mark_recorder = MarkRecorder()
        self._arc_length = 0.0  # along the path, to where the present leg began or begins
        self._landing = False
        self._met = False
        self._leave_out = self._left_out

    def feel(self, felt: ContactPeriod) -> bool:
        """As `Strategy`."""
        self._mark_recorder.feel(felt)
        self._met, self._leave_out = True, self._left_out
        return False

    def next(self, ended: LegResult | None) -> Leg | None:
        """As `Strategy`."""
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
        return self._land(arc_length) if arc_length < self._arc_lengths[-1] - ARRIVED else None

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
