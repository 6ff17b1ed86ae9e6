"""`palpate friction --dry-run`: what rubbing a surface would be like."""

from palpate.commands.answer import Answer
from palpate.commands.dry_run import MILLI, foretell, limit_figures, robot_words
from palpate.experiments.friction.config import FrictionConfig
from palpate.experiments.friction.library import library_of
from palpate.experiments.friction.plan import FrictionPlan, plan
from palpate.reporting.data import KeyFigure

FILES = ("report.html", "friction.yaml")


def foretell_friction(config: FrictionConfig) -> Answer:
    """Plan how a surface is rubbed, and say what would be done.

    Raises:
        InvalidValueError: It cannot be realised, or the folder not be written.
    """
    library_of(config)
    planned = plan(config)
    return foretell(
        "friction",
        f"Friction of a {config.object} by touch",
        config.out,
        FILES,
        _figures(planned),
        robot=robot_words(config.robot, planned.robot),
        warnings=_warnings(planned),
    )


def _figures(planned: FrictionPlan) -> tuple[KeyFigure, ...]:
    wanted = planned.wanted
    speeds = (wanted.speed, *wanted.speeds)
    return (
        KeyFigure("expected duration", planned.expected_duration, "s"),
        KeyFigure("loads", len(wanted.loads), "", ", ".join(f"{load:g} N" for load in wanted.loads)),
        KeyFigure("greatest force asked for", max(wanted.loads), "N"),
        KeyFigure("speed", MILLI * wanted.speed, "mm/s", "of strokes at every load"),
        KeyFigure("fastest stroke", MILLI * max(speeds), "mm/s"),
        KeyFigure("longest stroke", MILLI * wanted.most_travel, "mm"),
        KeyFigure("twist, largest", wanted.most_angle if wanted.most_spin else 0.0, "rad", "one way"),
        *limit_figures(planned.limits),
    )


def _warnings(planned: FrictionPlan) -> tuple[str, ...]:
    said = []
    if not planned.wanted.most_spin:
        said.append("this robot does not turn its tip: it finds mu, but not e.")
    if planned.left_out:
        speeds = ", ".join(f"{MILLI * speed:g}" for speed in planned.left_out)
        said.append(f"strokes at {speeds} mm/s are left out: they would go too far on this object.")
    return tuple(said)
