"""Records the marks of a strategy."""

from palpate.controllers.paths.contact_period import ContactPeriod
from palpate.controllers.paths.features import FeatureLimits, FeatureWatch
from palpate.controllers.paths.legs import LegEnd, LegResult
from palpate.controllers.paths.marks import Mark, PathEvent
from palpate.spatial import Vector

EVENTS = {
    LegEnd.MISSED: (PathEvent.UNREACHABLE, "nothing was met within the approach distance"),
    LegEnd.LOST: (PathEvent.LOST, "the surface was lost, and one slow bounded search did not find it"),
    LegEnd.STEEP: (PathEvent.STEEP, "steeper than what can be followed: the rest of the leg was left out"),
    LegEnd.BLOCKED: (
        PathEvent.BLOCKED,
        "the force rose against the motion, or the robot's room ended: the rest of the leg was left out",
    ),
    LegEnd.OVERLONG: (PathEvent.OPEN, "the contour did not close within the length that was allowed"),
}

OUT_OF_REACH = "the tip could not be brought there: something an obstacle was met, or the robot's workspace ended"


class MarkRecorder:
    """Marks from features that were felt and from legs that did not end well."""

    def __init__(self, limits: FeatureLimits | None = None) -> None:
        self._watch = FeatureWatch(limits)
        self._marks: list[Mark] = []
        self._contact: Vector | None = None

    @property
    def marks(self) -> tuple[Mark, ...]:
        """All so far, in order."""
        return tuple(self._marks)

    def feel(self, felt: ContactPeriod) -> None:
        """Take one period in contact."""
        self._contact = felt.contact
        mark = self._watch.feel(felt)
        if mark is not None:
            self._marks.append(mark)

    def end(self, ended: LegResult, aim: Vector | None = None) -> None:
        """Take the end of a leg; `aim` is where it should have landed, if that was what it was for [m]."""
        mark = self._watch.leave()
        if mark is not None:
            self._marks.append(mark)
        if ended.how is LegEnd.BLOCKED and aim is not None:
            self._marks.append(Mark(PathEvent.UNREACHABLE, aim, OUT_OF_REACH))
        elif ended.how in EVENTS:
            event, reason = EVENTS[ended.how]
            self._marks.append(Mark(event, self._contact or ended.tip, reason))
        self._contact = None
