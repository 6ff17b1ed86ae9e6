"""The plan of an exploring controller, for display."""

from collections.abc import Sequence

from palpate.controllers import ExploreController
from palpate.controllers.paths import Circuit, Hop, Leg, Mark, PathPlane, Point, SingleTouch, Stroke
from palpate.runtime.shown_plan import ShownMark, ShownPlan

LOOK_EVERY = 10
"""Periods between two looks at the marks: ten milliseconds, three times as often as figures are drawn."""


class PlanWatch:
    """Tells when the plan of a controller has changed. A `PlanSource`."""

    def __init__(self, controller: ExploreController) -> None:
        """Take what is to be watched."""
        self._controller = controller
        self._leg: Leg | None = None
        self._marks, self._periods = 0, 0

    def news(self) -> ShownPlan | None:
        """See `PlanSource`: a fraction of a microsecond where nothing is new."""
        controller, leg = self._controller, self._controller.leg
        self._periods -= 1
        if leg is self._leg and self._periods > 0:
            return None
        self._periods = LOOK_EVERY
        marks = controller.strategy.marks
        if leg is self._leg and len(marks) == self._marks:
            return None
        self._leg, self._marks = leg, len(marks)
        return shown_plan(leg, controller.strategy.plane, marks)


def shown_plan(leg: Leg | None, plane: PathPlane, marks: Sequence[Mark]) -> ShownPlan:
    """Return what a view shows of a leg and of marks."""
    shown = tuple(ShownMark(mark.event.value, mark.position) for mark in marks)
    name: str = ""
    points: tuple[Point, ...] = ()
    match leg:
        case Hop():
            name, points = "hop", (leg.to,)
        case Stroke():
            name, points = "stroke", leg.corners
        case SingleTouch():
            name, points = "touch", (leg.at,)
        case Circuit():
            name = "circuit"  # its points are known only while it is felt
        case None:
            pass
    return ShownPlan(name, tuple(plane.base(point) for point in points), plane.axis, shown)
