"""The motion along a surface that a leg requests, period by period, while force control keeps the tip on it."""

import math
from functools import cache
from typing import Any, Protocol

import numpy as np

from palpate.compiling import machine_code, njit
from palpate.controllers.paths.contour import prepare_steering
from palpate.controllers.paths.path_follower import ARRIVAL_DISTANCE, HEADING, TARGET, PathFollower, path_velocity
from palpate.controllers.paths.strategy import (
    Circuit,
    ContactPeriod,
    LegEnd,
    PathPlane,
    Point,
    SingleTouch,
    Stroke,
)
from palpate.controllers.small_vectors import length
from palpate.errors import positive
from palpate.spatial import ZERO, Vector, add_scaled, dot, scale

_WATCHED_TIME = 0.5
"""Duration of the stretches in which progress is checked [s]: a servo starts or turns round in a tenth of it."""

_MIN_PROGRESS = 0.1
"""Least share of the commanded distance that a moving tip covers; a blocked one covers none of it."""

KNOWN, _LAST, _DIRECTION, SPEED, _COMMANDED, _COVERED, _COUNT, _STALLED, _DISTANCE = 0, 1, 4, 7, 8, 9, 10, 11, 12
"""Where in its state what is kept: whether a place of the tip is known, this, and what was commanded from there
on."""


class _Progress:
    """Adds up the distance of the tip in the commanded direction, in which noise of its position cancels.

    Attributes:
        state: State of `advance` and `command`.
    """

    def __init__(self, period: float) -> None:
        """Take the control period [s]."""
        self._period = period
        self.state = np.zeros(13)

    @property
    def distance(self) -> float:
        """Covered so far [m]."""
        return float(self.state[_DISTANCE])

    @property
    def stalled(self) -> bool:
        """Whether the tip made no progress in the last stretch."""
        return bool(self.state[_STALLED])

    def rest(self) -> None:
        """The tip was moved otherwise: look at a new stretch."""
        self.state[:_DISTANCE] = 0.0

    def step(self, tip: Vector) -> None:
        """Take where the tip is [m]."""
        _kernels()[0](self.state, self._period, tip)

    def command(self, velocity: Vector) -> None:
        """Take the velocity along the surface commanded for the next period [m/s]."""
        _kernels()[1](self.state, velocity)


@njit(cache=True)
def advance(state: Any, period: float, tip: Vector) -> None:
    """See `_Progress.step`."""
    covered = 0.0
    for i in range(3):
        covered += (tip[i] - state[_LAST + i]) * state[_DIRECTION + i]
        state[_LAST + i] = tip[i]
    if state[KNOWN] == 0.0:
        state[KNOWN] = 1.0
        return
    state[_DISTANCE] += covered
    state[_COVERED] += covered
    state[_COMMANDED] += state[SPEED] * period
    state[_COUNT] += 1.0
    if state[_COUNT] == max(1.0, np.rint(_WATCHED_TIME / period)):
        state[_STALLED] = 1.0 if state[_COVERED] < _MIN_PROGRESS * state[_COMMANDED] else 0.0
        state[_COMMANDED] = state[_COVERED] = state[_COUNT] = 0.0


@njit(cache=True)
def command(state: Any, velocity: Vector) -> None:
    """See `_Progress.command`."""
    speed = length(velocity[0], velocity[1], velocity[2])
    state[SPEED] = speed
    for i in range(3):
        state[_DIRECTION + i] = 1.0 / speed * velocity[i] if speed > 0.0 else 0.0


@cache
def _kernels() -> tuple[Any, Any]:
    state = np.zeros(13)
    return machine_code(advance, state, 0.0, ZERO), machine_code(command, state, ZERO)


_MAX_SLOPE = math.radians(70.0)
"""Steepest slope on which a stroke is followed [rad]: beyond it a path given along the axis makes no progress, and
a tip that came over an edge would slide down the side for ever."""

_LEAST_COS = math.cos(_MAX_SLOPE)

_DWELL_TIME = 0.1
"""Rest of a touch on the surface after it has settled [s]; its contacts go into the map."""

_START_TOLERANCE = 2e-3
"""A tip farther than this from where its stroke should begin goes to it in a straight line from where it is [m];
one that is nearer steers back to the stroke's own first line."""


class Slide(Protocol):
    """One leg's motion along the surface."""

    def step(self, felt: ContactPeriod, ahead: Vector, speed: float) -> Vector | LegEnd:
        """Return the velocity along the surface for the next period [m/s], or how the leg has ended.

        Args:
            felt: Contact of this period.
            ahead: The object's outward normal that is expected when the velocity acts.
            speed: Wanted along the surface [m/s].
        """
        ...

    def stop(self) -> None:
        """Begin again from rest: something else has moved the tip."""
        ...


class _StrokeSlide:
    """Along a polygon, seen along the plane's axis. A `Slide`."""

    def __init__(self, stroke: Stroke, begin: Point, plane: PathPlane, acceleration: float, period: float) -> None:
        """Take the leg, where it begins in the plane [m], and the largest acceleration [m/s^2]."""
        positive("acceleration", acceleration, "m/s^2")
        corners = [begin]
        for corner in stroke.corners:
            if math.dist(corner, corners[-1]) > ARRIVAL_DISTANCE:
                corners.append(corner)
        self._follower = PathFollower(tuple(corners), acceleration) if len(corners) > 1 else None
        self._plane, self._period = plane, period
        self._frame = np.array([*plane.rotation_base_plane, plane.origin])
        self._progress = _Progress(period)

    def stop(self) -> None:
        """See `Slide`."""
        self._progress.rest()
        if self._follower is not None:
            self._follower.stop()

    def step(self, felt: ContactPeriod, ahead: Vector, speed: float) -> Vector | LegEnd:
        """See `Slide`: the path's velocity, raised or lowered so that it lies in the tangent plane."""
        follower = self._follower
        if follower is None:
            return LegEnd.STEEP if dot(ahead, self._plane.axis) < _LEAST_COS else LegEnd.REACHED
        end, along = _stroke()(
            self._frame,
            follower.path,
            follower.state,
            follower.acceleration,
            self._progress.state,
            self._period,
            felt.tip,
            ahead,
            speed,
        )
        if end:
            return ENDS[end - 1]
        velocity: Vector = along
        return velocity


ENDS = (LegEnd.STEEP, LegEnd.BLOCKED, LegEnd.REACHED)


@njit(cache=True)
def _stroke_velocity(
    frame: Any,
    path: Any,
    following: Any,
    acceleration: float,
    progress: Any,
    period: float,
    tip: Vector,
    normal: Vector,
    speed: float,
) -> tuple[int, Vector]:
    """Return which of `ENDS` it came to, 1 the first of them, 0: none; and the velocity."""
    x, y, z = frame[0], frame[1], frame[2]
    nu = x[0] * normal[0] + y[0] * normal[1] + z[0] * normal[2]
    nv = x[1] * normal[0] + y[1] * normal[1] + z[1] * normal[2]
    nh = x[2] * normal[0] + y[2] * normal[1] + z[2] * normal[2]
    if nh < _LEAST_COS:  # beside the object, or over its edge
        return 1, ZERO
    advance(progress, period, tip)
    if progress[_STALLED]:
        return 2, ZERO
    p, q, r = tip[0] - frame[3, 0], tip[1] - frame[3, 1], tip[2] - frame[3, 2]
    place = (x[0] * p + y[0] * q + z[0] * r, x[1] * p + y[1] * q + z[1] * r)
    k = int(following[TARGET])
    climb = -(nu * path[k, HEADING] + nv * path[k, HEADING + 1]) / nh
    slope = 1.0 / math.sqrt(1.0 + climb * climb)
    vu, vv = path_velocity(path, following, acceleration, place, slope, speed, period)
    if following[TARGET] >= len(path):
        return 3, ZERO
    vh = -(nu * vu + nv * vv) / nh
    along = (
        x[0] * vu + x[1] * vv + x[2] * vh,
        y[0] * vu + y[1] * vv + y[2] * vh,
        z[0] * vu + z[1] * vv + z[2] * vh,
    )
    command(progress, along)
    return 0, along


@cache
def _stroke() -> Any:
    path, state = np.zeros((2, 7)), np.zeros(2)
    return machine_code(
        _stroke_velocity, np.zeros((4, 3)), path, state, 0.0, _Progress(1.0).state, 0.0, ZERO, ZERO, 0.0
    )


class _CircuitSlide:
    """Where the surface leads, at any slope. A `Slide`."""

    def __init__(self, circuit: Circuit, acceleration: float, period: float) -> None:
        """Take the leg and the largest acceleration along the surface [m/s^2]."""
        self._circuit = circuit
        self._most_change = positive("acceleration", acceleration, "m/s^2") * period
        self._progress = _Progress(period)
        self._current = 0.0

    def stop(self) -> None:
        """See `Slide`."""
        self._progress.rest()
        self._current = 0.0

    def step(self, felt: ContactPeriod, ahead: Vector, speed: float) -> Vector | LegEnd:
        """See `Slide`."""
        progress = self._progress
        progress.step(felt.tip)
        if progress.distance > self._circuit.longest:
            return LegEnd.OVERLONG
        direction = self._circuit.steering.direction(ContactPeriod(felt.tip, felt.contact, ahead))
        if direction is None or progress.stalled:
            return LegEnd.BLOCKED
        self._current = min(self._current + self._most_change, speed)
        direction = add_scaled(direction, -dot(direction, ahead), ahead)
        along = scale(self._current, direction)
        progress.command(along)
        return along


class _Dwell:
    """Rests where the tip is, for `_DWELL_TIME`. A `Slide`."""

    def __init__(self, period: float) -> None:
        """Take the control period [s]."""
        self._left = round(_DWELL_TIME / period)

    def stop(self) -> None:
        """See `Slide`."""

    def step(self, felt: ContactPeriod, ahead: Vector, speed: float) -> Vector | LegEnd:
        """See `Slide`."""
        self._left -= 1
        return ZERO if self._left >= 0 else LegEnd.REACHED


def prepare() -> None:
    """Compile what slides and flights would otherwise wait for in their first period."""
    a_line = PathFollower(((0.0, 0.0), (1.0, 0.0)), 1.0)
    a_line.velocity((0.0, 0.0), 1.0, 1.0, 1.0)
    progress = _Progress(1.0)
    progress.step(ZERO)
    progress.command(ZERO)
    _stroke()
    prepare_steering()


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
        plane: Plane of the path.
        acceleration: Largest along the surface [m/s^2].
        period: Control period [s].
    """
    if isinstance(leg, Stroke):
        return _StrokeSlide(
            leg, begin if math.dist(begin, tip) <= _START_TOLERANCE else tip, plane, acceleration, period
        )
    if isinstance(leg, Circuit):
        return _CircuitSlide(leg, acceleration, period)
    return _Dwell(period)
