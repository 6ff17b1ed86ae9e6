"""Whether a tip that is commanded to slide makes progress."""

from palpate.spatial import ZERO, Vector, dot, norm, scale, subtract

WATCHED = 0.5
"""Stretches of this length are looked at [s]: ten times what a servo takes to start and to turn round."""

MIN_PART = 0.1
"""Least share of the commanded distance that a moving tip covers; a blocked one covers none of it."""


class Progress:
    """Adds up the distance of the tip in the commanded direction, in which noise of its position cancels.

    Attributes:
        distance: Covered so far [m].
        stalled: Whether the tip made no progress in the last stretch.
    """

    def __init__(self, period: float) -> None:
        """Take the control period [s]."""
        self._period = period
        self._periods = max(1, round(WATCHED / period))
        self.distance = 0.0
        self.rest()

    def rest(self) -> None:
        """The tip was moved otherwise: look at a new stretch."""
        self.stalled = False
        self._last: Vector | None = None
        self._direction: Vector = ZERO
        self._speed = 0.0
        self._begin()

    def _begin(self) -> None:
        self._commanded = self._covered = 0.0
        self._count = 0

    def step(self, tip: Vector) -> None:
        """Take where the tip is [m]."""
        last, self._last = self._last, tip
        if last is None:
            return
        covered = dot(subtract(tip, last), self._direction)
        self.distance += covered
        self._covered += covered
        self._commanded += self._speed * self._period
        self._count += 1
        if self._count == self._periods:
            self.stalled = self._covered < MIN_PART * self._commanded
            self._begin()

    def command(self, velocity: Vector) -> None:
        """Take the velocity along the surface commanded for the next period [m/s]."""
        self._speed = norm(velocity)
        self._direction = scale(1.0 / self._speed, velocity) if self._speed > 0.0 else ZERO
