"""At which forces and speeds the supervisor would stop a run, for its dry run."""

from palpate.reporting.data import KeyFigure
from palpate.runtime import Limits


def limit_figures(limits: Limits) -> tuple[KeyFigure, ...]:
    """Return force and speed limit."""
    return (
        KeyFigure("force limit", limits.force, "N", "of the supervisor, which then draws back"),
        KeyFigure("speed limit", 1e3 * limits.speed, "mm/s", "of the supervisor, which then stops it"),
    )
