"""What a tip calibration is measured by; imports nothing heavy."""

from collections.abc import Callable
from typing import Any

from palpate.experiments.kit.figure import Figure, FigureValue

MICRO = 1e6


def _true(column: str, meaning: str, unit: str, value: Callable[[Any, Any], FigureValue]) -> Figure:
    """An error against the simulated tip; None if nobody knows it."""
    return Figure(
        column, meaning, unit, lambda found: None if found.judged is None else value(found.judged, found.fit)
    )


def _found(column: str, meaning: str, unit: str, value: Callable[[Any], FigureValue]) -> Figure:
    """A figure of what was found; None if nothing was touched."""
    return Figure(column, meaning, unit, lambda found: None if found.fit is None else value(found.fit))


FIGURES = (
    Figure("usable", "whether the tip is to be used", "", lambda found: found.usable),
    _true("size_error_m", "error of the worst length", "m", lambda true, fit: true.size_error(fit)),
    _true("center_error_m", "error of the centre", "m", lambda true, fit: true.center_error(fit)),
    _true("turn_error_rad", "error of the orientation", "rad", lambda true, fit: true.turn_error(fit)),
    _true("stiffness_error", "error of the stiffness, a share", "", lambda true, fit: true.stiffness_error(fit)),
    Figure("center_sd_m", "SD of the centre, worst axis", "m", lambda found: found.largest_sd),
    _found("scatter_m", "scatter of the arm's places", "m", lambda fit: fit.scatter),
    _found("rows", "touches evaluated, each force one", "", lambda fit: len(fit.touches)),
    _found("broken", "assumptions that do not hold", "", lambda fit: len(fit.verdict.broken)),
    Figure("simulated_s", "duration of the planned touches", "s", lambda found: found.run.duration),
)
"""Those that matter most first."""
