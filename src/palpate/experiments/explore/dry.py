"""`palpate explore --dry-run`: what an exploration would do."""

import math

from palpate.commands.answer import Answer
from palpate.commands.dry_run import MILLI, foretell, limit_figures, robot_words
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.plan import ExplorationPlan, plan
from palpate.experiments.explore.pressing import PRESSING
from palpate.experiments.explore.scans import ContourScan, RasterScan, Scan, SpiralScan
from palpate.reporting.data import KeyFigure

FILES = (
    "report.html",
    "contacts.ply",
    "contacts.csv",
    "marks.csv",
    "map.ply",
    "map.stl",
    "height_map.csv",
)
"""Of an exploration that feels enough for a map."""


def foretell_explore(config: ExploreConfig) -> Answer:
    """Plan an exploration, and say what it would do.

    Raises:
        InvalidValueError: It cannot be realised, or the folder not be written.
    """
    planned = plan(config)
    return foretell(
        "explore",
        f"Exploration of {config.article} {config.object} by touch",
        config.out,
        FILES,
        _figures(planned),
        robot=robot_words(config.robot, planned.robot),
        warnings=_warnings(planned),
    )


def path_length(scan: Scan) -> float:
    """Return how long the path of the tip's middle is, seen from above, landings not counted [m].

    NaN where what is felt decides.
    """
    if isinstance(scan, RasterScan):
        return scan.raster.length
    if isinstance(scan, SpiralScan):
        return scan.spiral.length
    if isinstance(scan, ContourScan):
        return scan.foreseen.length
    return math.nan


def _figures(planned: ExplorationPlan) -> tuple[KeyFigure, ...]:
    config, scan, parameters = planned.config, planned.scan, planned.parameters
    (x0, y0), (x1, y1) = scan.box
    length = path_length(scan)
    unknown = "what is felt decides" if math.isnan(length) else "seen from above"
    return (
        KeyFigure("path", scan.line),
        KeyFigure("expected duration", planned.expected_duration, "s", "without pressing first"),
        KeyFigure("longest duration", planned.longest_duration, "s", "then it is stopped"),
        KeyFigure("path length", MILLI * length, "mm", unknown),
        KeyFigure("path along x", MILLI * (x1 - x0), "mm", f"from {MILLI * x0:.4g} to {MILLI * x1:.4g} mm"),
        KeyFigure("path along y", MILLI * (y1 - y0), "mm", f"from {MILLI * y0:.4g} to {MILLI * y1:.4g} mm"),
        KeyFigure("force", config.force, "N", "to hold"),
        KeyFigure("greatest force asked for", config.greatest_force, "N"),
        KeyFigure("speed", MILLI * config.speed, "mm/s", "along the surface"),
        KeyFigure("landing speed", MILLI * parameters.landing_speed, "mm/s"),
        *limit_figures(planned.limits),
    )


def _warnings(planned: ExplorationPlan) -> tuple[str, ...]:
    said = []
    if planned.config.identify:
        said.append(f"before that it presses where it begins, for at most {PRESSING:g} s once it has landed.")
    return tuple(said)
