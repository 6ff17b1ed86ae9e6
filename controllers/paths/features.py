"""Edges, steps, holes and concavities too tight for the tip, from how contact and tip move.

With an outward normal n the middle of a spherical tip is c + R n, so as it rolls dp = dc + R dn. On a surface of
radius r, positive where it is convex, dc = r dn: the contact goes where the normal turns to on a convex edge, and
against it in a concavity. On a sharp edge the contact stays and the tip moves, dc = 0; in a concavity as tight as
the tip, the tip stays and the contact moves, dp = 0, and where it is tighter the contact jumps across the tip or,
felt at both points at once, moves across as if it were as tight as the tip. This holds for every convex tip that
keeps its orientation, but for how far the normal turns.
"""

import math
from dataclasses import dataclass, replace

from palpate.controllers.paths.strategy import ContactPeriod, LegEnd, LegResult, Mark, PathEvent
from palpate.errors import check_positive, not_negative
from palpate.spatial import Vector, add, dot, scale, subtract

_STILL_ANGLE = math.radians(1.5)
"""A turn begins where the normal was last within so much of the anchor's: three standard deviations of one."""

_STILL_COS = math.cos(_STILL_ANGLE)

_MIN_QUIET_LENGTH = 1e-3
"""Path length of the tip without a turn after which a feature has ended [m]."""

_MAX_ARC = math.radians(120.0)
"""A radius is taken of no longer an arc: from its chord, which says nothing of a full turn."""

_RESTING_SHARE = 0.1
"""Largest motion of the tip over that of the contact, in a concavity as sharp as the tip."""

_SHARP_SHARE = 0.1
"""Largest radius of a sharp convex edge over the radius of the tip's path around it."""


@dataclass(frozen=True, slots=True)
class FeatureLimits:
    """Bounds of a feature.

    Attributes:
        turn: The normal must turn by this much [rad]: 15 degrees are thirty standard deviations of a contact's
            normal.
        window: A jump must happen while the tip moves less than this [m].
        contrast: On an edge the contact moves this many times less than the tip; in a corner, more: a convex
            radius below R / (contrast - 1), a concave one below R contrast / (contrast - 1).
        together: Features within this path length of the tip belong together [m], as a step or a hole: about the
            width of the tip; 0: each is by itself.
        step: Least difference of heights that makes a step [m].
    """

    turn: float = math.radians(15.0)
    window: float = 3e-4
    contrast: float = 2.5
    together: float = 8e-3
    step: float = 3e-4

    def __post_init__(self) -> None:
        check_positive(self, turn="rad", window="m", contrast="", step="m")
        not_negative("together", self.together, "m")


@dataclass(frozen=True, slots=True)
class _Turn:
    """A turn of the normal n, in which the contact c and the tip p move.

    Attributes:
        event: Kind of the turn.
        level: The last period on the surface before it.
        begun: Where it begins.
        ended: Where it ends.
        position: Where it was noticed [m].
        angle: By how much the normal turned [rad].
    """

    event: PathEvent | None
    level: ContactPeriod
    begun: ContactPeriod
    ended: ContactPeriod
    position: Vector
    angle: float

    @property
    def radius(self) -> float:
        """Radius of the surface, positive where it is convex [m]."""
        return _radius_between(self.begun.contact, self.ended.contact, self.begun, self.ended)

    @property
    def rolled(self) -> float:
        """Radius of the path of the tip, positive where it is convex [m]."""
        return _radius_between(self.begun.tip, self.ended.tip, self.begun, self.ended)


def _radius_between(a: Vector, b: Vector, begun: ContactPeriod, ended: ContactPeriod) -> float:
    """Return the radius of an arc from a to b, over which the normal turned as between two periods [m]."""
    dn = subtract(ended.normal, begun.normal)
    return dot(subtract(b, a), dn) / dot(dn, dn)


class FeatureWatch:
    """Finds features, one call per period in contact."""

    def __init__(self, limits: FeatureLimits | None = None) -> None:
        self._limits = limits or FeatureLimits()
        self._least_cos = math.cos(self._limits.turn)
        self._quiet = max(self._limits.together, _MIN_QUIET_LENGTH)
        self._anchor: ContactPeriod | None = None  # since when contact and tip do not move alike
        self._calm: ContactPeriod | None = None  # the anchor before that: not leaning over an edge yet
        self._still: ContactPeriod | None = None  # the last with the anchor's normal
        self._turning: _Turn | None = None
        self._found: list[_Turn] = []
        self._since = 0.0  # path length of the tip since the last of them
        self._last: ContactPeriod | None = None

    def feel(self, felt: ContactPeriod) -> Mark | None:
        """Take one period; return a completed feature, usually None."""
        last, anchor, still = self._last, self._anchor, self._still
        self._last = felt
        if last is None or anchor is None or still is None:
            self._anchor = self._still = felt
            return None
        cosine, contrast = dot(felt.normal, anchor.normal), self._limits.contrast
        moved, went = math.dist(felt.contact, anchor.contact), math.dist(felt.tip, anchor.tip)
        if cosine < self._least_cos:
            jumped = dot(felt.normal, last.normal) < self._least_cos
            self._turned(self._calm or anchor, last if jumped else still, felt)
            self._anchor = self._still = felt
        elif went > self._limits.window and contrast * moved > went and contrast * went > moved:
            self._since += went
            self._calm = anchor
            self._anchor = self._still = felt
        elif cosine >= _STILL_COS:
            self._still = felt
        if self._since > self._quiet:
            self._finish()
        return self._emit() if self._found and self._since >= self._limits.together else None

    def close(self) -> Mark | None:
        """Return the open feature at the end of a leg; then start afresh."""
        self._finish()
        return self._emit()

    def leave(self) -> Mark | None:
        """Return the open feature, and forget the position of the tip, which lifts."""
        mark = self.close()
        self._anchor = self._calm = self._still = self._last = None
        return mark

    def _turned(self, level: ContactPeriod, begun: ContactPeriod, felt: ContactPeriod) -> None:
        """Take a turn of the normal from one period to another."""
        turn = _Turn(None, level, begun, felt, felt.contact, math.acos(min(dot(begun.normal, felt.normal), 1.0)))
        if self._limits.contrast * abs(turn.radius) < turn.rolled:
            turn = replace(turn, event=PathEvent.EDGE)
        elif -turn.radius > self._limits.contrast * abs(turn.rolled):
            middle = scale(0.5, add(felt.contact, begun.contact))
            rests = abs(turn.rolled) < _RESTING_SHARE * abs(turn.radius)
            turn = replace(turn, event=PathEvent.TIGHT if rests else PathEvent.FILLET, position=middle)
        before = self._turning
        if turn.event is not None:
            self._since = 0.0
        if before is None or before.event is not turn.event:
            self._finish()
            self._turning = turn
        elif before.angle + turn.angle < _MAX_ARC:
            self._turning = replace(before, ended=felt, angle=before.angle + turn.angle)

    def _finish(self) -> None:
        turn, self._turning = self._turning, None
        if turn is not None and turn.event is not None:
            self._found.append(turn)

    def _emit(self) -> Mark | None:
        found, now = self._found, self._last
        if not found or now is None:
            return None
        self._found = []
        first, level = found[0], found[0].level
        if first.event is not None and len({turn.event is PathEvent.EDGE for turn in found}) == 1:
            turn = max(found, key=lambda each: each.angle)
            # on a sharp edge the contact wanders a little either way: its radius is 0, not concave
            radius = max(turn.radius, 0.0) if first.event is PathEvent.EDGE else turn.radius
            return Mark(first.event, first.position, _bend(turn), radius)
        rise = dot(subtract(now.contact, level.contact), level.normal)
        if abs(rise) > self._limits.step:
            side = "higher" if rise > 0.0 else "lower"
            reason = f"beyond an edge the surface goes on {1e3 * abs(rise):.2f} mm {side}"
            return Mark(PathEvent.STEP, first.position, reason)
        return Mark(PathEvent.HOLE, first.position, "an opening narrower than the tip: its bottom was not felt")


def _bend(turn: _Turn) -> str:
    """Return a phrase for the curvature of the surface."""
    size = 1e3 * abs(turn.radius)
    if turn.event is PathEvent.TIGHT:
        return f"concave, sharper than the tip, which touched at two points: a radius of at most {size:.2f} mm"
    if turn.event is PathEvent.FILLET:
        return f"concave, a radius of {size:.2f} mm"
    if turn.radius < _SHARP_SHARE * turn.rolled:
        return f"convex, sharp: a radius of at most {1e3 * _SHARP_SHARE * turn.rolled:.2f} mm"
    return f"convex, a radius of {size:.2f} mm"


_EVENTS = {
    LegEnd.MISSED: (PathEvent.UNREACHABLE, "nothing was met within the approach distance"),
    LegEnd.LOST: (PathEvent.LOST, "the surface was lost, and one slow bounded search did not find it"),
    LegEnd.STEEP: (PathEvent.STEEP, "steeper than what can be followed: the rest of the leg was left out"),
    LegEnd.BLOCKED: (
        PathEvent.BLOCKED,
        "the force rose against the motion, or the robot's room ended: the rest of the leg was left out",
    ),
    LegEnd.OVERLONG: (PathEvent.OPEN, "the contour did not close within the length that was allowed"),
}

_OUT_OF_REACH = "the tip could not be brought there: something an obstacle was met, or the robot's workspace ended"


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
        """Take the end of a leg; `aim` is the place of its landing [m], None for a leg without one."""
        mark = self._watch.leave()
        if mark is not None:
            self._marks.append(mark)
        if ended.how is LegEnd.BLOCKED and aim is not None:
            self._marks.append(Mark(PathEvent.UNREACHABLE, aim, _OUT_OF_REACH))
        elif ended.how in _EVENTS:
            event, reason = _EVENTS[ended.how]
            self._marks.append(Mark(event, self._contact or ended.tip, reason))
        self._contact = None


class MarkingStrategy:
    """Base class of strategies whose marks a `MarkRecorder` keeps."""

    _mark_recorder: MarkRecorder

    @property
    def marks(self) -> tuple[Mark, ...]:
        """Marks so far, in order."""
        return self._mark_recorder.marks
