"""`palpate explore`: an exploration with its progress, its files and its summary on the terminal."""

from rich.console import Console

from palpate.experiments.explore import Attempt, write_exploration
from palpate.experiments.explore_config import ExploreConfig
from palpate.experiments.explore_objects import FROM_FILE
from palpate.experiments.explore_plan import ExplorationPlan, plan
from palpate.experiments.explore_pressing import prepared
from palpate.experiments.explore_report import exploration_report
from palpate.experiments.explored_map import STEPS
from palpate.experiments.output_folder import make_folder
from palpate.experiments.progress import doing, step_progress
from palpate.experiments.run_told import INTERRUPTED, kept_if_interrupted, log_writer, run_shown, tell_of
from palpate.reporting import summary_table
from palpate.runtime import Ending


def run_explore(config: ExploreConfig) -> int:
    """Explore, record, write the files and print the summary; what was found until a Ctrl-C is written too.

    Returns:
        0 if the exploration finished, 130 if it was interrupted, else 1.

    Raises:
        InvalidValueError: The configuration cannot be realised, pressing has found nothing, or the folder cannot
            be written.
        KeyboardInterrupt: While it pressed, before the exploration had begun: there is nothing to write yet; or
            while the report was made.
        OSError: A file cannot be written.
    """
    console = Console()
    with doing(console, "planning"):
        planned = plan(config)
    make_folder(config.out)
    if config.identify:
        with doing(console, "pressing, to find stiffness and delay"):
            planned = prepared(planned)
    attempt = Attempt(planned)
    log = log_writer(planned)
    result, interrupted = run_shown(
        console, planned.expected_duration, lambda observer: attempt.run((observer,), (log,))
    )
    with kept_if_interrupted(result):
        with step_progress(console, STEPS) as tell:
            exploration = attempt.found(result, tell)
        with doing(console, "drawing the report"):
            files = write_exploration(exploration, config.out)
    console.print(summary_table(exploration_report(exploration)))
    _warn_of_walls(console, planned)
    tell_of(console, result, files)
    if interrupted:
        return INTERRUPTED
    return 0 if result.ending is Ending.DONE else 1


def _warn_of_walls(console: Console, planned: ExplorationPlan) -> None:
    """Say that the next object may have a wall, where nobody knows what it is like."""
    config, wall = planned.config, planned.wall
    if config.speed > wall.speed and (config.beyond or config.object in FROM_FILE):
        console.print(f"A wall or step in the way would have been {wall}", highlight=False, soft_wrap=True)
