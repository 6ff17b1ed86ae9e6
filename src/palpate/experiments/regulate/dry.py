"""`palpate regulate --dry-run`: what a regulation of force would do."""

from palpate.commands.answer import Answer
from palpate.commands.dry_run import MILLI, foretell, limit_figures, robot_words
from palpate.experiments.explore.pressing import PRESSING
from palpate.experiments.regulate.config import RegulateConfig
from palpate.experiments.regulate.plan import RegulationPlan, plan
from palpate.reporting.data import KeyFigure

FILES = ("report.html", "forces.csv")


def foretell_regulate(config: RegulateConfig) -> Answer:
    """Plan a regulation, and say what it would do.

    Raises:
        InvalidValueError: It cannot be realised, or the folder not be written.
    """
    planned = plan(config)
    pressed = (f"before that it presses the surface at rest, for at most {PRESSING:g} s once it has landed.",)
    return foretell(
        "regulate",
        f"Regulation of force on a {config.surface} {config.object}",
        config.out,
        FILES,
        _figures(planned),
        robot=robot_words(config.robot, planned.robot),
        warnings=pressed if config.identify else (),
    )


def _figures(planned: RegulationPlan) -> tuple[KeyFigure, ...]:
    config, parameters = planned.config, planned.parameters
    moved = config.motion != "still"
    return (
        KeyFigure("expected duration", planned.expected_duration, "s", "without pressing first"),
        KeyFigure("profile", config.profile, "", f"held for {parameters.duration:.4g} s"),
        KeyFigure("force", config.force, "N"),
        KeyFigure("greatest force asked for", config.greatest, "N"),
        KeyFigure("least force asked for", config.least, "N"),
        KeyFigure("motion", config.motion, "", "of the tip along the surface, by something else"),
        KeyFigure("speed", MILLI * config.motion_speed if moved else 0.0, "mm/s", "largest of that motion"),
        KeyFigure("landing speed", MILLI * parameters.landing_speed, "mm/s"),
        KeyFigure("way down", MILLI * parameters.approach_distance, "mm", "on which the surface is looked for"),
        *limit_figures(planned.limits),
    )
