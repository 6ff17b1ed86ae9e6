"""Follows a polygon: rests briefly at its corners, but not at those of a curve given as many short chords."""

import math
from itertools import pairwise

from palpate.controllers.paths.plane import Point
from palpate.errors import InvalidValueError, positive

SHARPEST = math.radians(30.0)
"""A corner that turns by more is a corner, at which the tip stops; by less, part of a curve."""


class PathFollower:
    """Follows a polygon in the plane of the path with bounded acceleration.

    The tip is steered back to its line with a rate of `STEERING`. The speed towards a corner at which it stops is
    bounded by sqrt(2 a d), from which a can still stop it where it counts as arrived; through gentle corners it
    keeps its speed.

    A corner that turns by phi between chords of length l stands for an arc of radius l / (2 tan(phi / 2)), and
    speed^2 / radius is kept below the acceleration. Along a chord the heading turns evenly, as on that arc: by
    half of phi before and half after it. (A heading that jumped would shake the tip: with 40 Hz for chords of
    0.5 mm at 20 mm/s, near what an arm's servos ring with.) Towards slower places it brakes in time: speeds are
    bounded from the end backwards by v_k^2 <= v_(k+1)^2 + 2 a l.
    """

    STEERING = 5.0
    """Rate at which an offset from the line is taken back [1/s]: a tenth of what a 100 rad/s servo allows."""

    ARRIVED = 1e-4
    """A corner at which the tip stops counts as reached this close to it [m]."""

    SLOWEST = 1e-3
    """Least speed towards a corner [m/s]: without it the last tenth of a millimetre would take for ever."""

    def __init__(self, corners: tuple[Point, ...], acceleration: float) -> None:
        """Take a path of at least two corners and a bound on acceleration [m/s^2]."""
        if len(corners) < 2:
            raise InvalidValueError(f"the path has {len(corners)} corners: it needs at least 2")
        self._corners = corners
        self._acceleration = positive("acceleration", acceleration, "m/s^2")
        self._lengths = lengths = [math.dist(a, b) for a, b in pairwise(corners)]
        if not min(lengths) > 0.0:
            at = lengths.index(min(lengths))
            raise InvalidValueError(f"corners {at} and {at + 1} are both {corners[at]} m: they give no direction")
        self._headings = [
            ((b[0] - a[0]) / length, (b[1] - a[1]) / length)
            for (a, b), length in zip(pairwise(corners), lengths, strict=True)
        ]
        turns = [0.0, *(_turn(a, b) for a, b in pairwise(self._headings)), 0.0]
        self._turns = [turn if abs(turn) < SHARPEST else 0.0 for turn in turns]
        self._limits = self._corner_speeds(turns)
        self._target = 1
        self._current = 0.0

    def _corner_speeds(self, turns: list[float]) -> list[float]:
        """Largest speed at each corner [m/s], by which angle the path turns there."""
        limits, lengths = [0.0] * len(self._corners), self._lengths
        for k in range(len(self._corners) - 2, 0, -1):
            turn = abs(turns[k])
            if turn < SHARPEST:
                curvature = 2.0 * math.tan(0.5 * turn) / min(lengths[k - 1], lengths[k])
                own = math.sqrt(self._acceleration / curvature) if curvature > 0.0 else math.inf
                limits[k] = min(own, math.sqrt(limits[k + 1] ** 2 + 2.0 * self._acceleration * lengths[k]))
        return limits

    def stop(self) -> None:
        """Begin again from rest: something else has moved the tip."""
        self._current = 0.0

    @property
    def finished(self) -> bool:
        """Whether the last corner was reached."""
        return self._target >= len(self._corners)

    @property
    def heading(self) -> Point:
        """Unit direction of the present leg; zero when finished."""
        return (0.0, 0.0) if self.finished else self._headings[self._target - 1]

    def velocity(self, position: Point, slope: float, speed: float, period: float) -> Point:
        """Return the velocity in the plane of the path from here [m/s].

        Args:
            position: Where the tip is, in that plane [m].
            slope: Distance in the plane per distance along the surface, in (0, 1].
            speed: Wanted along the surface [m/s].
            period: Time until the next call [s].
        """
        while not self.finished:
            (ux, uy), b = self._headings[self._target - 1], self._corners[self._target]
            dx, dy = b[0] - position[0], b[1] - position[1]
            remaining = dx * ux + dy * uy
            through = self._limits[self._target]
            if remaining > (0.0 if through > 0.0 else self.ARRIVED):
                break
            self._target += 1
            if through == 0.0:
                self._current = 0.0
                return (0.0, 0.0)
        else:
            return (0.0, 0.0)
        left = remaining if through > 0.0 else remaining - self.ARRIVED
        step = 0.5 * self._acceleration * period
        allowed = math.sqrt(step * step + through * through + 2.0 * self._acceleration * left) - step
        self._current = min(self._current + self._acceleration * period, speed, max(allowed, self.SLOWEST))
        fastest = speed * slope
        offset = min(max(self.STEERING * (dy * ux - dx * uy), -fastest), fastest)
        forward = min(self._current * slope, math.sqrt(fastest * fastest - offset * offset))
        bend = self._bend(remaining)
        c, s = math.cos(bend), math.sin(bend)
        ux, uy = c * ux - s * uy, s * ux + c * uy
        return (forward * ux - offset * uy, forward * uy + offset * ux)

    def _bend(self, remaining: float) -> float:
        """Angle of the arc against its chord [rad], so far before the end of the chord [m]."""
        k, length = self._target, self._lengths[self._target - 1]
        behind = length - remaining
        return 0.5 * (_near(self._turns[k], remaining, length) - _near(self._turns[k - 1], behind, length))


def _near(turn: float, distance: float, length: float) -> float:
    """A turn by so much, growing evenly along a chord; along a long one only where the arc keeps near it."""
    reach = min(length, 4.0 * PathFollower.ARRIVED / max(abs(turn), 1e-9))
    return turn * min(max(1.0 - distance / reach, 0.0), 1.0)


def _turn(a: Point, b: Point) -> float:
    """Angle from one direction to another [rad], positive to the left."""
    return math.atan2(a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1])
