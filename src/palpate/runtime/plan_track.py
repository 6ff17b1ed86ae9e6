"""How far along its path the tip is: what is behind it, and what is still to come."""

import math
from collections.abc import Sequence

import numpy as np

from palpate.errors import FloatArray
from palpate.runtime.shown_plan import ShownPlan
from palpate.spatial import Vector, add_scaled, dot, norm, subtract

STEP = 3e-4
"""The tip's path is kept in steps of this [m]: finer than rows lie apart, so that no corner is passed unseen."""

AT_CORNER = 2.0
"""Nearer to a corner than so many steps the tip counts as there: it cuts corners, and comes in steps."""

MOST_STEPS = 20_000
"""Of the path; beyond, every second point of it is left out: six metres until then."""


class PlanTrack:
    """Where the tip went, and what remains of the present leg, seen along the axis.

    The line is drawn at one height: that at which the tip began, above the object.
    """

    def __init__(self) -> None:
        """Begin without a plan."""
        self.clear()

    def clear(self) -> None:
        """Forget where the tip went, and the plan."""
        self._plan, self._height = ShownPlan(), math.nan
        self._done: list[Vector] = []
        self._step = STEP
        self._corner = 0  # of the path, which the tip is heading for
        self._began: Vector | None = None  # where the leg did

    def follow(self, plan: ShownPlan) -> None:
        """Take another plan; marks alone do not begin the leg anew."""
        if plan.path != self._plan.path or plan.leg != self._plan.leg:
            self._corner, self._began = 0, self._done[-1] if self._done else None
        self._plan = plan

    def move(self, positions: FloatArray) -> None:
        """Take where the tip was, base frame, shape (n, 3) [m]."""
        # neighbours are near each other: most are gone before Python looks at them
        cells = np.floor(positions / (0.5 * self._step))
        change = np.ones(len(cells), bool)
        change[1:] = (cells[1:] != cells[:-1]).any(axis=1)
        points: Sequence[Sequence[float]] = positions[change].tolist()
        for x, y, z in points:
            self._move((x, y, z))

    @property
    def done(self) -> FloatArray:
        """Where the tip went, lifted to the height of the line, shape (n, 3) [m]."""
        return np.array(self._done).reshape(-1, 3)

    @property
    def rest(self) -> FloatArray:
        """From the tip through the corners to come, likewise, shape (n, 3) [m]; empty without a path."""
        ahead = self._plan.path[self._corner :]
        if not ahead or not self._done:
            return np.empty((0, 3))
        return np.array([self._done[-1], *(self._lifted(corner) for corner in ahead)])

    def _move(self, at: Vector) -> None:
        if math.isnan(self._height):
            self._height = dot(at, self._plan.axis)
        place = self._lifted(at)
        if not self._done or norm(subtract(place, self._done[-1])) >= self._step:
            self._done.append(place)
            if len(self._done) > MOST_STEPS:
                self._done, self._step = self._done[::2], 2.0 * self._step
        path = self._plan.path
        while self._corner + 1 < len(path) and self._is_past(place):
            self._corner += 1

    def _is_past(self, place: Vector) -> bool:
        """Whether the tip has been at the corner that it is heading for, or has left it already."""
        corner, after = (self._lifted(self._plan.path[self._corner + i]) for i in (0, 1))
        if norm(subtract(place, corner)) < AT_CORNER * self._step:
            return True
        before = self._began if self._corner == 0 else self._lifted(self._plan.path[self._corner - 1])
        if before is None:
            before = self._done[0]
        return _distance(place, corner, after) + self._step < _distance(place, before, corner)

    def _lifted(self, point: Vector) -> Vector:
        height = 0.0 if math.isnan(self._height) else self._height
        return add_scaled(point, height - dot(point, self._plan.axis), self._plan.axis)


def _distance(point: Vector, a: Vector, b: Vector) -> float:
    """Distance of a point from a segment [m]."""
    along = subtract(b, a)
    square = dot(along, along)
    t = 0.0 if square == 0.0 else min(max(dot(subtract(point, a), along) / square, 0.0), 1.0)
    return norm(subtract(point, add_scaled(a, t, along)))
