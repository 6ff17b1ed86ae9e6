"""An exploration for scripts: configuration in, what was found out."""

from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.exploration import Exploration, found_by
from palpate.experiments.explore.plan import plan
from palpate.experiments.kit.recorded_run import carry_out
from palpate.robots.values import load_named_robot
from palpate.runtime import Observer


def explore(config: ExploreConfig, observers: tuple[Observer, ...] = ()) -> Exploration:
    """Plan an exploration, press first if that is asked for, and carry it out.

    Args:
        config: What to do.
        observers: Called every period, for example to show progress.

    Raises:
        InvalidValueError: It cannot be realised, or pressing has found nothing.
    """
    planned = plan(config, load_named_robot(config.robot), {}).prepared()
    return found_by(planned, carry_out(planned, observers))
