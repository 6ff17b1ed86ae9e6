"""Probing by single touches."""

import math

from palpate.controllers.paths.contact_period import ContactPeriod
from palpate.controllers.paths.legs import Leg, LegResult, SingleTouch
from palpate.controllers.paths.mark_recorder import MarkRecorder
from palpate.controllers.paths.marks import Mark
from palpate.controllers.paths.plane import PathPlane, Point
from palpate.errors import InvalidValueError, positive


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


class Taps:
    """Approaches, touches and retreats at every point; a miss is marked, and the next point tried."""

    def __init__(self, points: tuple[Point, ...], retreat: float = 5e-3, plane: PathPlane | None = None) -> None:
        """Take the points [m] and how far to retreat after each touch [m]."""
        if not points:
            raise InvalidValueError("there are no points to tap: give at least 1")
        self.plane = plane or PathPlane()
        self._legs = tuple(SingleTouch(point, retreat) for point in points)
        self.start()

    @property
    def marks(self) -> tuple[Mark, ...]:
        """As `Strategy`."""
        return self._mark_recorder.marks

    def start(self) -> None:
        """As `Strategy`."""
        self._mark_recorder = MarkRecorder()
        self._next = 0

    def feel(self, felt: ContactPeriod) -> bool:
        """As `Strategy`."""
        self._mark_recorder.feel(felt)
        return False

    def next(self, ended: LegResult | None) -> Leg | None:
        """As `Strategy`."""
        if ended is not None:
            at = self._legs[self._next - 1].at
            self._mark_recorder.end(ended, self.plane.base(at, self.plane.flat(ended.tip)[2]))
        if self._next == len(self._legs):
            return None
        self._next += 1
        return self._legs[self._next - 1]
