"""`palpate grasp --dry-run`: what a grasp would do."""

from palpate.commands.answer import Answer
from palpate.commands.dry_run import MILLI, foretell, robot_words
from palpate.experiments.grasp.config import GraspConfig
from palpate.experiments.grasp.foretold import foretold
from palpate.experiments.grasp.plan import GraspPlan, plan
from palpate.experiments.grasp.strength import LARGEST_GRIP
from palpate.reporting.data import KeyFigure

FILES = ("report.html", "grasp.csv")


def foretell_grasp(config: GraspConfig) -> Answer:
    """Plan a grasp, and say what it would do.

    Raises:
        InvalidValueError: It cannot be realised, or the folder not be written.
    """
    planned = plan(config)
    if not planned.hand.real:
        planned.backend()  # what cannot be simulated is refused when it is built; it moves when it is started
    robot = planned.hand.robot
    return foretell(
        "grasp",
        f"Grasp of a {config.object} with {config.fingers} fingers",
        config.out,
        FILES,
        _figures(planned),
        robot=_hand_words(config) if robot is None else robot_words(str(config.robot), robot),
        warnings=foretold(planned),
    )


def _hand_words(config: GraspConfig) -> str:
    return f"a simulated hand of {config.fingers} fingers"


def _figures(planned: GraspPlan) -> tuple[KeyFigure, ...]:
    config = planned.config
    twice = "and as long again beside it, without spin" if config.against_ignoring_spin else ""
    return (
        KeyFigure("expected duration", planned.expected_duration, "s", twice),
        KeyFigure("lift height", MILLI * config.lift_height, "mm"),
        KeyFigure("lift speed", MILLI * config.lift_speed, "mm/s"),
        KeyFigure("greatest grip asked for", LARGEST_GRIP, "N", "of each finger"),
        KeyFigure("friction mu, believed", planned.believed.friction),
        KeyFigure("spin length e, believed", MILLI * planned.believed.spin_length, "mm"),
        KeyFigure(
            "grip limit", planned.limits.grip_force, "N", "of the supervisor, which then stops it, grip kept"
        ),
        KeyFigure("force limit", planned.limits.force, "N", "likewise"),
    )
