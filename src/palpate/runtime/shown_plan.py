"""What people see of a plan: where the tip goes next, and what there is to say besides the surface."""

import math
from dataclasses import dataclass
from typing import Protocol

from palpate.runtime.data import Command, Observation, Sample
from palpate.spatial import Vector

MOST_CORNERS = 1000
"""Of a path: more than a picture tells apart; every so manieth is shown."""

MOST_MARKS = 300
"""The newest; the others are in the report."""


@dataclass(frozen=True, slots=True)
class ShownMark:
    """One place with a word.

    Attributes:
        event: What it was, in a word.
        position: Where, base frame [m].
    """

    event: str
    position: Vector


@dataclass(frozen=True, slots=True)
class ShownPlan:
    """The plan as it is now.

    Attributes:
        leg: What is being done, in a word; "" if nothing is.
        path: Corners that the leg leads to, in order, in the plane of the path, base frame [m]; none where what
            is felt leads.
        axis: Unit vector away from the object, base frame: in which direction the path is drawn above it.
        marks: All so far, in order.
    """

    leg: str = ""
    path: tuple[Vector, ...] = ()
    axis: Vector = (0.0, 0.0, 1.0)
    marks: tuple[ShownMark, ...] = ()

    def bounded(self) -> "ShownPlan":
        """Return it with no more corners and marks than a view can show."""
        step = math.ceil(len(self.path) / MOST_CORNERS)
        path = self.path if step < 2 else (*self.path[:-1:step], self.path[-1])
        return ShownPlan(self.leg, path, self.axis, self.marks[-MOST_MARKS:])


@dataclass(frozen=True, slots=True)
class PlanChange:
    """A plan, and from when on it was the one.

    Attributes:
        time: As in samples [s].
        plan: From then on.
    """

    time: float
    plan: ShownPlan


class PlanSource(Protocol):
    """Knows the plan of a run that goes on."""

    def news(self) -> ShownPlan | None:
        """Return the plan if it is another one than at the last call, else None; called once per period."""
        ...


class PlanDiary:
    """An `Observer` that keeps every plan of a run."""

    def __init__(self, source: PlanSource) -> None:
        """Take what is asked in every period."""
        self._source = source
        self._changes: list[PlanChange] = []

    def __call__(self, sample: Sample, now: Observation, command: Command) -> None:
        """Keep the plan if it is another one."""
        plan = self._source.news()
        if plan is not None:
            self._changes.append(PlanChange(now.time, plan))

    @property
    def changes(self) -> tuple[PlanChange, ...]:
        """Each plan, and from when on it was the one."""
        return tuple(self._changes)
