"""Whether a tip that is told to slide gets on."""

from palpate.spatial import ZERO, Vector, dot, norm, scale, subtract

WATCHED = 0.5
"""Stretches of this length are looked at [s]: ten times what a servo takes to start and to turn round."""

LEAST_PART = 0.1
"""Of the way that was asked for, which a tip that gets on makes at least: one that is held goes nowhere."""


class Progress:
    """Counts the way of the tip in the direction that it was told, so that noise of its position cancels.

    Attributes:
        way: So far [m].
        stalled: Whether it did not get on in the last stretch.
    """

    def __init__(self, period: float) -> None:
        """Take the control period [s]."""
        self._period = period
        self._periods = max(1, round(WATCHED / period))
        self.way = 0.0
        self.rest()

    def rest(self) -> None:
        """The tip was moved otherwise: look at a new stretch."""
        self.stalled = False
        self._last: Vector | None = None
        self._direction: Vector = ZERO
        self._speed = 0.0
        self._begin()

    def _begin(self) -> None:
        self._asked = self._made = 0.0
        self._count = 0

    def step(self, tip: Vector) -> None:
        """Take where the tip is [m]."""
        last, self._last = self._last, tip
        if last is None:
            return
        made = dot(subtract(tip, last), self._direction)
        self.way += made
        self._made += made
        self._asked += self._speed * self._period
        self._count += 1
        if self._count == self._periods:
            self.stalled = self._made < LEAST_PART * self._asked
            self._begin()

    def told(self, velocity: Vector) -> None:
        """Take the velocity along the surface that it is told to have next [m/s]."""
        self._speed = norm(velocity)
        self._direction = scale(1.0 / self._speed, velocity) if self._speed > 0.0 else ZERO
