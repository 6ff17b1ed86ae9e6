"""Motion along a polygon, at rest only at its corners, and travel above an object."""

import math
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np

from palpate.compiling import machine_code, njit
from palpate.controllers.paths.strategy import PathPlane, Point
from palpate.errors import InvalidValueError, positive
from palpate.spatial import Vector, rotate

_MAX_CURVE_TURN = math.radians(30.0)
"""A corner that turns by more is a corner, at which the tip stops; by less, part of a curve."""

STEERING_RATE = 5.0
"""Rate at which an offset from the line is taken back [1/s]: a tenth of the bandwidth of a 100 rad/s servo."""

ARRIVAL_DISTANCE = 1e-4
"""A corner at which the tip stops counts as reached this close to it [m]."""

MIN_CORNER_SPEED = 1e-3
"""Least speed towards a corner [m/s]: without it the last tenth of a millimetre would take for ever."""

CORNER, HEADING, LENGTH, TURN, LIMIT = 0, 2, 4, 5, 6
"""Columns of a path: each corner, direction and length of the chord to it, by how much the path turns there if the
tip does not stop [rad], and the largest speed through it [m/s]; 0: it stops."""

TARGET, _CURRENT = 0, 1
"""Where in its state the number of the corner is to which the tip goes, and its speed [m/s]."""


class PathFollower:
    """Follows a polygon in the plane of the path with bounded acceleration.

    The tip is steered back to its line with a rate of `STEERING_RATE`. The speed towards a corner at which it
    stops is bounded by sqrt(2 a d), from which a can still stop it where it counts as arrived. Through gentle
    corners it keeps its speed.

    A corner that turns by phi between chords of length l stands for an arc of radius l / (2 tan(phi / 2)), and
    speed^2 / radius is kept below the acceleration. Along a chord the heading turns evenly, as on that arc: by
    half of phi before and half after it. (A heading that jumped would shake the tip: with 40 Hz for chords of
    0.5 mm at 20 mm/s, near what an arm's servos ring with.) Towards slower places it brakes in time: speeds are
    bounded from the end backwards by v_k^2 <= v_(k+1)^2 + 2 a l.

    Attributes:
        acceleration: Largest [m/s^2].
        path: Corners, headings and speeds for `path_velocity`.
        state: Target and speed for `path_velocity`.
    """

    def __init__(self, corners: tuple[Point, ...], acceleration: float) -> None:
        """Take a path of at least two corners and a bound on acceleration [m/s^2]."""
        if len(corners) < 2:
            raise InvalidValueError(f"the path has {len(corners)} corners: it needs at least 2")
        self.acceleration = positive("acceleration", acceleration, "m/s^2")
        lengths = [math.dist(a, b) for a, b in pairwise(corners)]
        if not min(lengths) > 0.0:
            at = lengths.index(min(lengths))
            raise InvalidValueError(f"corners {at} and {at + 1} are both {corners[at]} m: they give no direction")
        headings = [
            ((b[0] - a[0]) / length, (b[1] - a[1]) / length)
            for (a, b), length in zip(pairwise(corners), lengths, strict=True)
        ]
        turns = [0.0, *(_turn(a, b) for a, b in pairwise(headings)), 0.0]
        curved = [turn if abs(turn) < _MAX_CURVE_TURN else 0.0 for turn in turns]
        limits = _corner_speeds(turns, lengths, acceleration)
        chords = zip([(0.0, 0.0), *headings], [0.0, *lengths], strict=True)
        rows = zip(corners, chords, curved, limits, strict=True)
        self.path = np.array([(*corner, *to, length, turn, most) for corner, (to, length), turn, most in rows])
        self.state = np.array([1.0, 0.0])

    def stop(self) -> None:
        """Begin again from rest: something else has moved the tip."""
        self.state[_CURRENT] = 0.0

    @property
    def finished(self) -> bool:
        """Whether the last corner was reached."""
        return bool(self.state[TARGET] >= len(self.path))

    def velocity(self, position: Point, slope: float, speed: float, period: float) -> Point:
        """Return the velocity in the plane of the path from here [m/s].

        Args:
            position: Where the tip is, in that plane [m].
            slope: Distance in the plane per distance along the surface, in (0, 1].
            speed: Wanted along the surface [m/s].
            period: Time until the next call [s].
        """
        velocity: Point = _kernel()(self.path, self.state, self.acceleration, position, slope, speed, period)
        return velocity


def _corner_speeds(turns: list[float], lengths: list[float], acceleration: float) -> list[float]:
    """Largest speed at each corner [m/s], by which angle the path turns there."""
    limits = [0.0] * len(turns)
    for k in range(len(turns) - 2, 0, -1):
        turn = abs(turns[k])
        if turn < _MAX_CURVE_TURN:
            curvature = 2.0 * math.tan(0.5 * turn) / min(lengths[k - 1], lengths[k])
            own = math.sqrt(acceleration / curvature) if curvature > 0.0 else math.inf
            limits[k] = min(own, math.sqrt(limits[k + 1] ** 2 + 2.0 * acceleration * lengths[k]))
    return limits


def _turn(a: Point, b: Point) -> float:
    """Angle from one direction to another [rad], positive to the left."""
    return math.atan2(a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1])


@njit(cache=True)
def path_velocity(
    path: Any, state: Any, acceleration: float, position: Point, slope: float, speed: float, period: float
) -> Point:
    """See `PathFollower.velocity`."""
    while True:
        k = int(state[TARGET])
        if k >= len(path):
            return 0.0, 0.0
        ux, uy = path[k, HEADING], path[k, HEADING + 1]
        dx, dy = path[k, CORNER] - position[0], path[k, CORNER + 1] - position[1]
        remaining = dx * ux + dy * uy
        through = path[k, LIMIT]
        if remaining > (0.0 if through > 0.0 else ARRIVAL_DISTANCE):
            break
        state[TARGET] += 1.0
        if through == 0.0:
            state[_CURRENT] = 0.0
            return 0.0, 0.0
    left = remaining if through > 0.0 else remaining - ARRIVAL_DISTANCE
    step = 0.5 * acceleration * period
    allowed = math.sqrt(step * step + through * through + 2.0 * acceleration * left) - step
    state[_CURRENT] = min(state[_CURRENT] + acceleration * period, speed, max(allowed, MIN_CORNER_SPEED))
    fastest = speed * slope
    offset = min(max(STEERING_RATE * (dy * ux - dx * uy), -fastest), fastest)
    forward = min(state[_CURRENT] * slope, math.sqrt(fastest * fastest - offset * offset))
    # angle of the arc against its chord, so far before the end of the chord
    length = path[k, LENGTH]
    to, behind = _near(path[k, TURN], remaining, length), _near(path[k - 1, TURN], length - remaining, length)
    bend = 0.5 * (to - behind)
    c, s = math.cos(bend), math.sin(bend)
    ux, uy = c * ux - s * uy, s * ux + c * uy
    return forward * ux - offset * uy, forward * uy + offset * ux


@njit(cache=True)
def _near(turn: float, distance: float, length: float) -> float:
    """A turn by so much, growing evenly along a chord; along a long one only where the arc keeps near it."""
    reach = min(length, 4.0 * ARRIVAL_DISTANCE / max(abs(turn), 1e-9))
    return turn * min(max(1.0 - distance / reach, 0.0), 1.0)


@cache
def _kernel() -> Any:
    return machine_code(path_velocity, np.zeros((2, 7)), np.zeros(2), 0.0, (0.0, 0.0), 0.0, 0.0, 0.0)


NEAR_PLACE = 5e-4
"""A tip as near to its place as this need not travel [m]."""


class Travel:
    """From where the tip is to above a place, from rest to rest.

    Attributes:
        to: Where it goes, in the plane [m].
        height: At which it goes across, above the plane [m].
        risen: Whether the tip is there.
        finished: Whether it is above its place, too.
    """

    def __init__(
        self,
        tip: Vector,
        to: Point,
        height: float,
        plane: PathPlane,
        speed: float,
        acceleration: float,
        period: float,
    ) -> None:
        """Take start, goal and limits of the motion.

        Args:
            tip: Where the tip is, base frame [m].
            to: Where to go, in the plane [m].
            height: At which to go across, above the plane [m]; a tip that is higher stays there.
            plane: Plane of the path.
            speed: [m/s].
            acceleration: [m/s^2].
            period: Control period [s].
        """
        u, v, h = plane.flat(tip)
        self.height = max(height, h)
        self.to, self._plane = to, plane
        self._speed, self._acceleration, self._period = speed, acceleration, period
        self.risen, self.finished = self.height - h <= NEAR_PLACE, False
        self._along: PathFollower | None = None
        if not self.risen:  # up is a path of its own
            self._along = PathFollower(((h, 0.0), (self.height, 0.0)), acceleration)
        else:
            self._across((u, v))

    def _across(self, place: Point) -> None:
        self.risen = True
        self.finished = math.dist(place, self.to) <= NEAR_PLACE
        self._along = None if self.finished else PathFollower((place, self.to), self._acceleration)

    def velocity(self, tip: Vector) -> Vector:
        """Return the velocity for the next period from where the tip is [m/s], base frame."""
        u, v, h = self._plane.flat(tip)
        vu = vv = vh = 0.0
        follower = self._along
        if follower is not None:
            if self.risen:
                vu, vv = follower.velocity((u, v), 1.0, self._speed, self._period)
                self.finished = follower.finished
            else:
                vh, _ = follower.velocity((h, 0.0), 1.0, self._speed, self._period)
                if follower.finished:
                    self._across((u, v))
        return rotate(self._plane.rotation_base_plane, (vu, vv, vh))
