"""Whether the errors expected between rows are as small as the goal asks."""

from palpate.controllers.paths.goal import Goal, GoalError
from palpate.errors import FloatArray

__all__ = ["meets", "reached"]

SLIVER = 0.01
"""Part of a field that no strip covers: rows begin and end within a stretch of where they were meant to."""


def meets(error: FloatArray, area: FloatArray, wanted: float, measure: GoalError) -> bool:
    """Return whether errors are as wanted: their largest, or their mean square.

    Args:
        error: Expected in each cell, shape (n,) [m].
        area: Of the cells, shape (n,) [m^2].
        wanted: Error [m].
        measure: Of which kind.
    """
    if measure is GoalError.LARGEST:
        return bool(error.max(initial=0.0) <= wanted)
    return bool((error**2 * area).sum() <= area.sum() * wanted**2)


def reached(
    goal: Goal, margin: float, error: FloatArray, gap: FloatArray, area: FloatArray, *, field: float, prior: float
) -> bool:
    """Return whether the goal is met over as much of the field as it asks for, the best known parts first.

    Args:
        goal: What is wanted.
        margin: Part of the goal's error that may be expected.
        error: Expected in each cell between two rows, shape (n,) [m].
        gap: Distance of the rows, shape (n,) [m].
        area: Of the cells, shape (n,) [m^2].
        field: Area of the whole field [m^2].
        prior: Cells between rows farther apart than this do not count as known [m].
    """
    wanted = goal.area * field * (1.0 - SLIVER)
    known = gap <= prior
    if goal.area >= 1.0 and not known.all():
        return False
    error, area = error[known], area[known]
    order = error.argsort()
    best = area[order].cumsum() <= max(wanted, area.sum() * goal.area)
    error, area = error[order][best], area[order][best]
    if area.sum() < wanted - area.max(initial=0.0):
        return False
    return meets(error, area, margin * goal.error, goal.measure)
