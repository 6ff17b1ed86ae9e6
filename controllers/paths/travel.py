"""Travel above an object: up along the axis, then straight across."""

import math

from palpate.controllers.paths.path_follower import PathFollower
from palpate.controllers.paths.plane import PathPlane, Point
from palpate.spatial import Vector, rotate

NEAR = 5e-4
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
            plane: Of the path.
            speed: [m/s].
            acceleration: [m/s^2].
            period: Of control [s].
        """
        u, v, h = plane.flat(tip)
        self.height = max(height, h)
        self.to, self._plane = to, plane
        self._speed, self._acceleration, self._period = speed, acceleration, period
        self.risen, self.finished = self.height - h <= NEAR, False
        self._along: PathFollower | None = None
        if not self.risen:  # up is a path of its own
            self._along = PathFollower(((h, 0.0), (self.height, 0.0)), acceleration)
        else:
            self._across((u, v))

    def _across(self, place: Point) -> None:
        self.risen = True
        self.finished = math.dist(place, self.to) <= NEAR
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
