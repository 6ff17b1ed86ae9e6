"""Follows a path that is known beforehand, and goes on beyond what cannot be followed."""

import math
from itertools import pairwise
from typing import Protocol

from palpate.controllers.paths.diary import Diary
from palpate.controllers.paths.felt import Felt
from palpate.controllers.paths.legs import Ended, Hop, Leg, LegEnd, Stroke
from palpate.controllers.paths.marks import Mark
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

    Where it is too steep or blocked, or nothing is met, the place is marked and the path goes on from its next
    corner, at least `left_out` further on. A loss ends it.
    """

    def __init__(self, path: Path, plane: PathPlane | None = None, left_out: float = LEFT_OUT) -> None:
        self.plane = plane or PathPlane()
        self._corners = path.corners()
        self._left_out = positive("left_out", left_out, "m")
        self.start()

    @property
    def marks(self) -> tuple[Mark, ...]:
        """As `Strategy`."""
        return self._diary.marks

    def start(self) -> None:
        """As `Strategy`."""
        self._diary = Diary()
        self._next = 0  # corner where the present leg began or begins
        self._landing = False

    def feel(self, felt: Felt) -> bool:
        """As `Strategy`."""
        self._diary.feel(felt)
        return False

    def next(self, ended: Ended | None) -> Leg | None:
        """As `Strategy`."""
        if ended is None:
            return self._hop(0)
        self._diary.end(ended)
        if ended.how is LegEnd.LOST:
            return None
        if ended.how is LegEnd.REACHED:
            rest = self._corners[self._next + 1 :]
            if not self._landing or not rest:
                return None
            self._landing = False
            return Stroke(rest)
        at = self._next if self._landing else self._reached(ended)
        return self._hop(self._beyond(at))

    def _hop(self, corner: int) -> Leg | None:
        if corner >= len(self._corners):
            return None
        self._next, self._landing = corner, True
        return Hop(self._corners[corner])

    def _reached(self, ended: Ended) -> int:
        """The corner that the tip was heading for: the end of the segment nearest to it."""
        u, v, _ = self.plane.flat(ended.tip)
        segments = list(pairwise(self._corners))[self._next :]
        distances = [_distance((u, v), a, b) for a, b in segments]
        return self._next + 1 + distances.index(min(distances))

    def _beyond(self, corner: int) -> int:
        """The first corner from here on that is far enough along the path."""
        way, k = 0.0, corner + (1 if self._landing else 0)
        while k < len(self._corners) and way < self._left_out:
            way += math.dist(self._corners[k - 1], self._corners[k]) if k else 0.0
            k += 1
        return max(k - 1, corner) if way >= self._left_out else len(self._corners)


def _distance(point: Point, a: Point, b: Point) -> float:
    """Distance of a point from a segment [m]."""
    du, dv = b[0] - a[0], b[1] - a[1]
    t = ((point[0] - a[0]) * du + (point[1] - a[1]) * dv) / (du * du + dv * dv)
    t = min(max(t, 0.0), 1.0)
    return math.dist(point, (a[0] + t * du, a[1] + t * dv))
