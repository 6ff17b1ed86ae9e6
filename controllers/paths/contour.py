"""Round an object once: along a level curve or an edge."""

import math

from palpate.controllers.paths.contact_period import ContactPeriod
from palpate.controllers.paths.features import FeatureLimits
from palpate.controllers.paths.legs import Circuit, Hop, Leg, LegEnd, LegResult
from palpate.controllers.paths.mark_recorder import MarkRecorder
from palpate.controllers.paths.marks import Mark
from palpate.controllers.paths.plane import PathPlane, Point
from palpate.controllers.paths.steering import Steering
from palpate.errors import positive
from palpate.spatial import Vector, add_scaled, dot, norm, subtract

MAX_OF_A_TURN = 1.5 * math.pi
"""A simple closed curve turns by 2 pi; less than three quarters of it is a bend that passes by the beginning."""

LEFT = 5.0
"""The tip must have been this many tolerances away from the beginning before it can return."""

SETTLED = 0.2
"""The beginning is where the tip first came this much of the tolerance near to the curve: one that is itself off
by a tolerance would be passed by."""

HEADING_STEP = 0.5
"""Headings are taken over this part of the tolerance: from period to period they would be noise."""


class Contour:
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

    @property
    def marks(self) -> tuple[Mark, ...]:
        """As `Strategy`."""
        return self._mark_recorder.marks

    def start(self) -> None:
        """As `Strategy`."""
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
        """As `Strategy`: true where the curve closes."""
        self._mark_recorder.feel(felt)
        if self._next < 2 or self.closed:
            return self.closed
        if self.beginning is None:
            if abs(self._steering.offset(felt)) <= SETTLED * self._tolerance:
                self.beginning = self._last = felt.tip
            return False
        self._follow(felt.tip)
        away = norm(subtract(felt.tip, self.beginning))
        self._left = self._left or away > LEFT * self._tolerance
        self.closed = self._left and away <= self._tolerance and abs(self._turned) > MAX_OF_A_TURN
        return self.closed

    def next(self, ended: LegResult | None) -> Leg | None:
        """As `Strategy`."""
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
        if size < HEADING_STEP * self._tolerance:
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
