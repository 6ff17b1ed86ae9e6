"""Marks on a map: features, and places that could not be felt, with the reason."""

import math
from dataclasses import dataclass
from enum import StrEnum

from palpate.spatial import Vector


class PathEvent(StrEnum):
    """What happened on a path."""

    EDGE = "edge"
    """The tip rolled over a convex edge: the contact hardly moved while the normal turned."""
    STEP = "step"
    """An edge and a corner close together, and another height beyond."""
    HOLE = "hole"
    """An edge, a jump and an edge, and the same height beyond: narrower than the tip."""
    TIGHT = "tight"
    """A concavity tighter than the tip: the contact jumped across the tip, what lies between was not felt."""
    FILLET = "fillet"
    """A concavity little wider than the tip, which followed it."""
    STEEP = "steep"
    """Steeper than what can be followed: the rest of the leg was left out."""
    LOST = "lost"
    """The surface was lost and not found again by one slow bounded search."""
    UNREACHABLE = "unreachable"
    """Nothing was met where the tip should have landed, or the robot cannot go there."""
    BLOCKED = "blocked"
    """The force rose against the motion: the rest of the leg was left out."""
    OPEN = "open"
    """A contour that should close did not."""


@dataclass(frozen=True, slots=True)
class Mark:
    """One event, for the map.

    Attributes:
        event: What it was.
        position: Where, base frame [m]: the contact if there was one, otherwise the tip's origin.
        reason: A sentence for the report.
        radius: Of the surface across an edge or a concavity, positive where it is convex [m]; NaN where none was
            felt. Of a concavity sharper than the tip, minus the tip's: it is smaller than that.
    """

    event: PathEvent
    position: Vector
    reason: str
    radius: float = math.nan
