"""Edges, steps, holes and concavities too tight for the tip, from how contact and tip move.

With an outward normal n the middle of a spherical tip is c + R n, so as it rolls dp = dc + R dn. On a convex edge
the contact stays and the tip moves, dc = 0; in a concavity as tight as the tip, the tip stays and the contact
moves, dp = 0, and where it is tighter the contact jumps across the tip. Both hold for every convex tip that keeps
its orientation; only how far the normal turns differs.
"""

import math
from dataclasses import dataclass

from palpate.controllers.paths.contact_period import ContactPeriod
from palpate.controllers.paths.marks import Mark, PathEvent
from palpate.errors import positive
from palpate.spatial import Vector, add, dot, norm, scale, subtract


@dataclass(frozen=True, slots=True)
class FeatureLimits:
    """What counts as a feature.

    Attributes:
        turn: The normal must turn by this much [rad]: 15 degrees are thirty standard deviations of a contact's
            normal.
        window: A jump must happen while the tip moves less than this [m].
        contrast: On an edge the contact moves this many times less than the tip; in a corner, more: a convex
            radius below R / (contrast - 1), a concave one below R contrast / (contrast - 1).
        together: Features within this path length of the tip belong together [m]: about the width of the tip.
        step: Least difference of heights that makes a step [m].
    """

    turn: float = math.radians(15.0)
    window: float = 3e-4
    contrast: float = 4.0
    together: float = 8e-3
    step: float = 3e-4

    def __post_init__(self) -> None:
        for name, unit in (("turn", "rad"), ("window", "m"), ("contrast", ""), ("together", "m"), ("step", "m")):
            positive(name, getattr(self, name), unit)


class FeatureWatch:
    """Finds features, one call per period in contact."""

    def __init__(self, limits: FeatureLimits | None = None) -> None:
        self._limits = limits or FeatureLimits()
        self._least_cos = math.cos(self._limits.turn)
        self._before: ContactPeriod | None = None  # where the window began
        self._anchor: ContactPeriod | None = None  # since when the contact stays
        self._calm: ContactPeriod | None = None  # the anchor before that: not leaning over an edge yet
        self._level: ContactPeriod | None = None  # the last before the present group of features
        self._found: list[tuple[PathEvent, Vector]] = []
        self._since = 0.0  # path length of the tip since the last of them
        self._last: ContactPeriod | None = None
        self._edge_reported = False

    def feel(self, felt: ContactPeriod) -> Mark | None:
        """Take one period; return what was completed, usually nothing."""
        last, before, anchor = self._last, self._before, self._anchor
        self._last = felt
        if last is None or before is None or anchor is None:
            self._before = self._anchor = felt
            return None
        limits = self._limits
        self._since += norm(subtract(felt.tip, last.tip))
        moved, went = norm(subtract(felt.contact, before.contact)), norm(subtract(felt.tip, before.tip))
        if moved > limits.contrast * went and dot(felt.normal, before.normal) < self._least_cos:
            self._note(PathEvent.TIGHT, scale(0.5, add(felt.contact, before.contact)), before)
            self._before = self._anchor = felt
            self._edge_reported = False
            return None
        if went >= limits.window:
            self._before = felt
        moved, went = norm(subtract(felt.contact, anchor.contact)), norm(subtract(felt.tip, anchor.tip))
        if went > limits.window and limits.contrast * moved > went:
            self._calm, self._anchor, self._edge_reported = anchor, felt, False
        elif not self._edge_reported and dot(felt.normal, anchor.normal) < self._least_cos:
            self._edge_reported = True
            self._note(PathEvent.EDGE, felt.contact, self._calm or anchor)
        if self._found and self._since > limits.together:
            return self.close()
        return None

    def close(self) -> Mark | None:
        """Return what is still open, at the end of a leg; then start afresh."""
        found, level, now = self._found, self._level, self._last
        self._found, self._level = [], None
        if not found or level is None or now is None:
            return None
        kinds = {event for event, _ in found}
        position = found[0][1]
        rise = dot(subtract(now.contact, level.contact), level.normal)
        both = PathEvent.STEP if abs(rise) > self._limits.step else PathEvent.HOLE
        event = both if len(kinds) > 1 else found[0][0]
        return Mark(event, position, _reason(event, rise))

    def leave(self) -> Mark | None:
        """Return what is still open, and forget where the tip was: it lifts."""
        mark = self.close()
        self._before = self._anchor = self._calm = self._last = None
        self._edge_reported = False
        return mark

    def _note(self, event: PathEvent, position: Vector, level: ContactPeriod) -> None:
        if not self._found:
            self._level = level
        self._found.append((event, position))
        self._since = 0.0


def _reason(event: PathEvent, rise: float) -> str:
    if event is PathEvent.EDGE:
        return "the tip rolled over a convex edge"
    if event is PathEvent.TIGHT:
        return "the contact jumped across the tip: what lies between is tighter than the tip and was not felt"
    if event is PathEvent.STEP:
        return f"beyond an edge the surface goes on {1e3 * abs(rise):.2f} mm {'higher' if rise > 0.0 else 'lower'}"
    return "an opening narrower than the tip: its bottom was not felt"
