"""The motion along a surface that a leg requests, period by period, while force control keeps the tip on it."""

import math
from typing import Protocol

from palpate.controllers.paths.contact_period import ContactPeriod
from palpate.controllers.paths.legs import Circuit, LegEnd, SingleTouch, Stroke
from palpate.controllers.paths.path_follower import PathFollower
from palpate.controllers.paths.plane import PathPlane, Point
from palpate.controllers.paths.progress import Progress
from palpate.errors import positive
from palpate.spatial import ZERO, Vector, add_scaled, dot, rotate, rotate_back, scale

MAX_SLOPE = math.radians(70.0)
"""Steepest slope on which a stroke is followed [rad]: beyond it a path given along the axis makes no progress, and
a tip that came over an edge would slide down the side for ever."""

DWELL = 0.1
"""How long a touch rests on the surface after it has settled [s]: what is felt meanwhile goes into the map."""

START_TOLERANCE = 2e-3
"""A tip farther than this from where its stroke should begin goes to it in a straight line from where it is [m];
one that is nearer steers back to the stroke's own first line."""


class Slide(Protocol):
    """One leg's motion along the surface."""

    def step(self, felt: ContactPeriod, speed: float) -> Vector | LegEnd:
        """Return the velocity along the surface for the next period [m/s], or how the leg has ended.

        Args:
            felt: What is felt, with the normal that is expected when the velocity acts.
            speed: Wanted along the surface [m/s].
        """
        ...

    def stop(self) -> None:
        """Begin again from rest: something else has moved the tip."""
        ...


class StrokeSlide:
    """Along a polygon, seen along the plane's axis. A `Slide`."""

    def __init__(self, stroke: Stroke, begin: Point, plane: PathPlane, acceleration: float, period: float) -> None:
        """Take the leg, where it begins in the plane [m], and the largest acceleration [m/s^2]."""
        positive("acceleration", acceleration, "m/s^2")
        corners = [begin]
        for corner in stroke.corners:
            if math.dist(corner, corners[-1]) > PathFollower.ARRIVED:
                corners.append(corner)
        self._follower = PathFollower(tuple(corners), acceleration) if len(corners) > 1 else None
        self._plane, self._period = plane, period
        self._progress = Progress(period)
        self._least_cos = math.cos(MAX_SLOPE)

    def stop(self) -> None:
        """See `Slide`."""
        self._progress.rest()
        if self._follower is not None:
            self._follower.stop()

    def step(self, felt: ContactPeriod, speed: float) -> Vector | LegEnd:
        """See `Slide`: the path's velocity, raised or lowered so that it lies in the tangent plane."""
        rotation, follower, progress = self._plane.rotation_base_plane, self._follower, self._progress
        nu, nv, nh = rotate_back(rotation, felt.normal)
        if nh < self._least_cos:  # beside the object, or over its edge
            return LegEnd.STEEP
        if follower is None:
            return LegEnd.REACHED
        progress.step(felt.tip)
        if progress.stalled:
            return LegEnd.BLOCKED
        u, v, _ = self._plane.flat(felt.tip)
        hu, hv = follower.heading
        climb = -(nu * hu + nv * hv) / nh
        slope = 1.0 / math.sqrt(1.0 + climb * climb)
        vu, vv = follower.velocity((u, v), slope, speed, self._period)
        if follower.finished:
            return LegEnd.REACHED
        along = rotate(rotation, (vu, vv, -(nu * vu + nv * vv) / nh))
        progress.command(along)
        return along


class CircuitSlide:
    """Where the surface leads, at any slope. A `Slide`."""

    def __init__(self, circuit: Circuit, acceleration: float, period: float) -> None:
        """Take the leg and the largest acceleration along the surface [m/s^2]."""
        self._circuit = circuit
        self._most_change = positive("acceleration", acceleration, "m/s^2") * period
        self._progress = Progress(period)
        self._current = 0.0

    def stop(self) -> None:
        """See `Slide`."""
        self._progress.rest()
        self._current = 0.0

    def step(self, felt: ContactPeriod, speed: float) -> Vector | LegEnd:
        """See `Slide`."""
        progress = self._progress
        progress.step(felt.tip)
        if progress.distance > self._circuit.longest:
            return LegEnd.OVERLONG
        direction = self._circuit.steering.direction(felt)
        if direction is None or progress.stalled:
            return LegEnd.BLOCKED
        self._current = min(self._current + self._most_change, speed)
        direction = add_scaled(direction, -dot(direction, felt.normal), felt.normal)
        along = scale(self._current, direction)
        progress.command(along)
        return along


class Dwell:
    """Rests where the tip is, for `DWELL`. A `Slide`."""

    def __init__(self, period: float) -> None:
        """Take the control period [s]."""
        self._left = round(DWELL / period)

    def stop(self) -> None:
        """See `Slide`."""

    def step(self, felt: ContactPeriod, speed: float) -> Vector | LegEnd:
        """See `Slide`."""
        self._left -= 1
        return ZERO if self._left >= 0 else LegEnd.REACHED


def slide(
    leg: Stroke | Circuit | SingleTouch,
    begin: Point,
    tip: Point,
    plane: PathPlane,
    acceleration: float,
    period: float,
) -> Slide:
    """Return the motion along the surface of a leg.

    Args:
        leg: Which.
        begin: Where the leg before it should have ended, in the plane [m].
        tip: Where the tip is, in the plane [m].
        plane: Of the path.
        acceleration: Largest along the surface [m/s^2].
        period: Of control [s].
    """
    if isinstance(leg, Stroke):
        return StrokeSlide(
            leg, begin if math.dist(begin, tip) <= START_TOLERANCE else tip, plane, acceleration, period
        )
    if isinstance(leg, Circuit):
        return CircuitSlide(leg, acceleration, period)
    return Dwell(period)
